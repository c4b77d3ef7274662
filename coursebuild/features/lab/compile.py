"""A lab's code as an ES module, its data for JSON, and what its trial depends on.

1. Every piece of code becomes a function whose first parameter holds what lab code sees; a setter's
   second is `value`. A module is strict, so a misspelt assignment is an error and no new global.
2. The same functions serve the browser's worker (a module) and the trial (an expression). A page
   needs no `eval`, so its policy can forbid it.
3. A piece must parse both by itself and as its function, so that none can end its function and
   begin another, and none keeps the others from loading.

What a trial depends on, besides its model's files, is computed without an engine.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from msgspec import Struct, to_builtins

from coursebuild.api import Inputs, Trial
from coursebuild.core.run.child import LIMITS
from coursebuild.core.run.script_environment import package_version
from coursebuild.core.text.source import key_of
from coursebuild.features.lab import schema
from coursebuild.features.lab.engines import native
from coursebuild.features.lab.model import BUILT_IN_KINDS, MJCF, ODE, PLOT, Entry, Lab, LabCode


class LabModule(Struct, frozen=True):
    """A lab as an engine runs it."""

    name: str
    """Unique in the course and stable: `4.2-lab-1`."""
    code: str
    """An ES module."""
    literal: str
    """The code as a JavaScript expression, for an engine without modules."""
    config: dict[str, Any]


def pieces(lab: Lab) -> Iterator[LabCode]:
    """Yield every piece of code of a lab, in the order of its fields."""
    for name in ("setup", "controller"):
        if code := getattr(lab.fields, name):
            yield LabCode((name,), "statements", code)
    for i, control in enumerate(lab.fields.controls):
        if isinstance(control, schema.Button):
            yield LabCode(("controls", i, "run"), "statements", control.run)
        elif control.set is not None:
            yield LabCode(("controls", i, "set"), "target", control.set)
        elif control.apply is not None:
            yield LabCode(("controls", i, "apply"), "setter", control.apply)
    for i, readout in enumerate(lab.fields.readouts):
        yield LabCode(("readouts", i, "expr"), "expression", readout.expr)
    for i, plot in enumerate(lab.fields.plots):
        for entry, expression in _curves(i, plot):
            yield LabCode(entry, "expression", expression)
    for i, claim in enumerate(lab.fields.expect):
        if claim.expr is not None:
            yield LabCode(("expect", i, "expr"), "expression", claim.expr)
    if lab.fields.goal is not None:
        yield LabCode(("goal", "expr"), "expression", lab.fields.goal.expr)


def compile_lab(lab: Lab, name: str) -> LabModule:
    """Make the module of a lab whose pieces all parse by themselves."""
    members = tuple(_members(lab))
    code = "".join(f"export const {member} = {text};\n" for member, text in members)
    literal = "{" + ", ".join(f"{member}: {text}" for member, text in members) + "}"
    fields = lab.fields
    overlays = fields.overlays
    switches = schema.Overlays.__struct_fields__ if isinstance(overlays, schema.Overlays) else ()
    config = {"id": name} | {field: getattr(fields, field) for field in _FIELDS}
    config |= {
        "overlays": [o for o in switches if getattr(overlays, o)] if switches else overlays,
        "controls": [control_data(control) for control in fields.controls],
        "readouts": [{"label": r.label, "digits": r.digits} for r in fields.readouts],
        "plots": [
            {name: getattr(plot, name) for name in _PLOT}
            | {"traces": [{"label": trace.label, "dash": trace.dash} for trace in plot.traces]}
            | ({} if plot.x is None else {"x": True, "xlabel": plot.xlabel or plot.x})
            for plot in fields.plots
        ],
        "expect": [
            {"after": c.steps, "t": c.t, "min": c.min, "max": c.max, "diverges": c.diverges}
            for c in fields.expect
        ],
    }
    if fields.goal is not None:
        # Each act: its time, the number of its control and, except for a button, the value.
        numbers = {control.label: i for i, control in enumerate(fields.controls)}
        log: list[tuple[float | str, ...]] = []
        for act in fields.goal.log:
            if isinstance(act.do, str):
                log.append((act.t, numbers[act.do]))
            else:
                log += ((act.t, numbers[label], value) for label, value in act.do.items())
        config["goal"] = {"hold": fields.goal.hold, "log": log}
    if lab.kind == MJCF and lab.xml is not None:
        config |= {"kind": MJCF, "xml": lab.xml.text.rstrip("\n"), "starts": lab.starts}
    data: dict[str, Any] = to_builtins(config)
    return LabModule(name, code, f"({literal})", data)


def _curves(i: int, plot: schema.Plot) -> Iterator[tuple[Entry, str]]:
    """Yield what is computed for a plot: its traces, then what its horizontal axis shows."""
    for j, trace in enumerate(plot.traces):
        yield ("plots", i, "traces", j, "expr"), trace.expr
    if plot.x is not None:
        yield ("plots", i, "x"), plot.x


def _members(lab: Lab) -> Iterator[tuple[str, str]]:
    functions, fields = {piece.entry: piece.function for piece in pieces(lab)}, lab.fields
    for name in ("setup", "controller"):
        if (name,) in functions:
            yield name, functions[(name,)]
    controls = (_control(functions, i, control) for i, control in enumerate(fields.controls))
    yield "controls", _list(controls)
    yield "readouts", _list(functions["readouts", i, "expr"] for i, _ in enumerate(fields.readouts))
    plots = (
        _list(functions[entry] for entry, _ in _curves(i, plot))
        for i, plot in enumerate(fields.plots)
    )
    yield "plots", _list(plots)
    claims = (functions.get(("expect", i, "expr"), "null") for i, _ in enumerate(fields.expect))
    yield "expect", _list(claims)
    if fields.goal is not None:
        yield "goal", functions["goal", "expr"]


def _list(items: Iterator[str]) -> str:
    return "[" + ", ".join(items) + "]"


def _control(functions: Mapping[Entry, str], i: int, control: schema.Control) -> str:
    for field, member in (("run", "run"), ("set", "set"), ("apply", "set")):
        if ("controls", i, field) in functions:
            return f"{{{member}: {functions['controls', i, field]}}}"
    name = json.dumps(getattr(control, "param", None) or control.label)
    return f"{{set: ({{ctx}}, value) => {{ ctx[{name}] = value; }}}}"


# --- data

_FIELDS = (
    *("title", "model", "key", "height", "camera", "toggles", "overlays", "forceScale"),
    *("autoplay", "grab", "stopAt", "start", "still", "film", "trail", "seed"),
)
"""Fields of a lab that are passed on as written; only overlays become a list."""
_PLOT = ("ylabel", "xlabel", "window", "ymin", "ymax", "height", "refLines")
"""Fields of a plot that are passed on as written."""


_CONTROL = {
    "type": None, "label": None, "unit": "", "min": None, "max": None, "step": None,
    "value": None, "digits": None, "options": (), "param": None, "init": False, "reset": False,
    "play": False,
}  # fmt: skip
"""Fields of a control, of whatever kind, and their defaults."""


def control_data(control: schema.Control) -> dict[str, Any]:
    """Return a control as the page needs it."""
    fields = to_builtins(control)
    if isinstance(control, schema.Select):
        fields["value"] = control.start
    return {name: fields.get(name, default) for name, default in _CONTROL.items()}


# --- trials

_DISPLAY_FIELDS = ("id", "title", "model", "height", "toggles", "still")
"""Data of a lab on which no trial depends."""


def trial_inputs(trial: Trial) -> Inputs | None:
    """Return the inputs of a lab's trial; `None` if the lab is of the course's own kinds."""
    lab = trial.block
    if not isinstance(lab, Lab) or lab.kind not in BUILT_IN_KINDS:
        return None
    if lab.kind in (PLOT, ODE):
        return equation_inputs(lab, trial.name)
    return inputs_of(lab, compile_lab(lab, trial.name))


def inputs_of(lab: Lab, module: LabModule) -> Inputs:
    """Return what the trial of a lab depends on besides the files of its model."""
    text = key_of(
        json.dumps(trial_data(module)),
        module.literal,
        f"{lab.verify.seconds}/{lab.verify.rtol is None}",
        lab.xml.text if lab.xml is not None else f"models/{lab.fields.model}.xml",
    )
    conditions = (
        ("MuJoCo", native.LAB_ENGINE),
        ("how a lab is repeated natively", native.lab_digest("engines/native_worker.py")[:12]),
        ("the browser's engine and its trial", native.asset_digest(native.WASM, native.TRIAL)[:12]),
    )
    return Inputs(f"lab {module.name}", text, (), LIMITS.lab, (), conditions)


def equation_inputs(lab: Lab, name: str) -> Inputs:
    """Return what the trial of a lab without an engine depends on."""
    conditions = (
        ("SciPy", package_version("scipy")),
        ("how a lab without an engine is tried", native.lab_digest("equations", "schema.py")[:12]),
        ("the page's own code", native.asset_digest(native.EQUATION_TRIAL)[:12]),
    )
    return Inputs(f"lab {name}", key_of(lab.config), (), LIMITS.lab, (), conditions)


def trial_data(module: LabModule) -> dict[str, Any]:
    """Return the data of a lab without what no trial depends on."""
    return {name: value for name, value in module.config.items() if name not in _DISPLAY_FIELDS}
