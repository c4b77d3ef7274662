"""A lab's code as an ES module, and its data as JSON.

Entry points: `compile_lab(lab, name)`, `pieces(lab)`.

1. Every piece of code that an author writes becomes a function of its own, whose first parameter
   holds what lab code sees (`model`, `data`, `mj`, `sim`, `ctx`, `lib`); a setter's second is
   `value`. A module is strict, so a misspelt assignment is an error and no new global.
2. The same functions serve the browser's worker (`code`, a module) and the trial (`literal`, an
   expression). A page needs no `eval`, so its policy can forbid it.
3. A piece is put into the module only when it parses by itself and as the function that it becomes
   (`pieces` gives what to try), so that no piece can end its function and begin another, and none
   keeps the others from loading.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, Literal, TypeAlias

from msgspec import Struct

from coursebuild.core.model import Lab, LabControl, LabPlot
from coursebuild.core.text.source import Span

Entry: TypeAlias = tuple[str | int, ...]
"""The way to a piece inside the lab's JSON: `("controls", 2, "set")`."""

_NAMES = "{model, data, mj, sim, ctx, lib}"


class LabCode(Struct, frozen=True):
    """A piece of lab code."""

    entry: Entry
    form: Literal["statements", "expression", "target"]
    """Statements are run, an expression gives a value, a target is assigned to."""
    code: str
    span: Span
    """The entry in the lesson that it belongs to."""
    takes_value: bool = False
    """Whether it reads `value`."""

    @property
    def function(self) -> str:
        """It as it stands in the module, a function."""
        # A line end closes a comment with which a piece may end.
        match self.form:
            case "target":
                return f"({_NAMES}, value) => {{ ({self.code}\n) = value;\n}}"
            case "expression":
                return f"({_NAMES}) => ({self.code}\n)"
            case "statements":
                value = ", value" if self.takes_value else ""
                return f"({_NAMES}{value}) => {{ {self.code}\n}}"


class LabModule(Struct, frozen=True):
    """A lab, ready to be run."""

    name: str
    """Unique in the course and stable: `4.2-lab-1`."""
    code: str
    """An ES module."""
    literal: str
    """The same as a JavaScript expression, for an engine without modules."""
    config: str
    """What is data, as JSON."""


def pieces(lab: Lab) -> tuple[LabCode, ...]:
    """Every piece of code of a lab, in the order of its fields."""
    return tuple(_pieces(lab))


def _pieces(lab: Lab) -> Iterator[LabCode]:
    for name, code in (("setup", lab.setup), ("controller", lab.controller)):
        if code:
            yield LabCode((name,), "statements", code, lab.span)
    for i, control in enumerate(lab.controls):
        if control.set is not None:
            yield LabCode(("controls", i, "set"), "target", control.set, control.span, True)
        if control.apply is not None:
            yield LabCode(("controls", i, "apply"), "statements", control.apply, control.span, True)
        if control.run is not None:
            yield LabCode(("controls", i, "run"), "statements", control.run, control.span)
    for i, readout in enumerate(lab.readouts):
        yield LabCode(("readouts", i, "expr"), "expression", readout.expr, readout.span)
    for i, plot in enumerate(lab.plots):
        for j, trace in enumerate(plot.traces):
            yield LabCode(("plots", i, "traces", j, "expr"), "expression", trace.expr, trace.span)
    for i, claim in enumerate(lab.expect):
        yield LabCode(("expect", i, "expr"), "expression", claim.expr, claim.span)


def compile_lab(lab: Lab, name: str) -> LabModule:
    """The module of a lab whose pieces all parse by themselves."""
    members = tuple(_members(lab))
    code = "".join(f"export const {member} = {text};\n" for member, text in members)
    literal = "{" + ", ".join(f"{member}: {text}" for member, text in members) + "}"
    return LabModule(name, code, f"({literal})", config_json(lab, name))


def _members(lab: Lab) -> Iterator[tuple[str, str]]:
    functions = {piece.entry: piece.function for piece in pieces(lab)}
    for name in ("setup", "controller"):
        if (name,) in functions:
            yield name, functions[(name,)]
    yield "controls", _list(_control(functions, i, one) for i, one in enumerate(lab.controls))
    yield "readouts", _list(functions["readouts", i, "expr"] for i in range(len(lab.readouts)))
    yield (
        "plots",
        _list(
            _list(functions["plots", i, "traces", j, "expr"] for j in range(len(plot.traces)))
            for i, plot in enumerate(lab.plots)
        ),
    )
    yield "expect", _list(functions["expect", i, "expr"] for i in range(len(lab.expect)))


def _list(items: Iterator[str]) -> str:
    return "[" + ", ".join(items) + "]"


def _control(functions: Mapping[Entry, str], i: int, control: LabControl) -> str:
    for field, member in (("run", "run"), ("set", "set"), ("apply", "set")):
        if ("controls", i, field) in functions:
            return f"{{{member}: {functions['controls', i, field]}}}"
    name = json.dumps(control.param or control.label)
    return f"{{set: ({{ctx}}, value) => {{ ctx[{name}] = value; }}}}"


# --- data


def config_json(lab: Lab, name: str) -> str:
    """What the page, the worker and the trial need to know besides code, as JSON."""
    config: dict[str, Any] = {
        "id": name,
        "title": lab.title,
        "model": lab.model,
        "key": lab.key,
        "height": lab.height,
        "camera": _camera(lab),
        "toggles": list(lab.toggles),
        "overlays": list(lab.overlays),
        "forceScale": lab.force_scale,
        "autoplay": lab.autoplay,
        "stopAt": lab.stop_at,
        "trail": lab.trail,
        "seed": lab.seed,
        "controls": [_control_data(control) for control in lab.controls],
        "readouts": [{"label": r.label, "digits": r.digits} for r in lab.readouts],
        "plots": [_plot_data(plot) for plot in lab.plots],
        "expect": [
            {
                "after": [step if isinstance(step, str) else dict(step) for step in claim.after],
                "t": claim.t,
                "min": claim.minimum,
                "max": claim.maximum,
            }
            for claim in lab.expect
        ],
    }
    return json.dumps(config, ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def _camera(lab: Lab) -> dict[str, Any] | None:
    camera = lab.camera
    if camera is None:
        return None
    return {
        "azimuth": camera.azimuth,
        "elevation": camera.elevation,
        "distance": camera.distance,
        "target": None if camera.target is None else list(camera.target),
    }


def _control_data(control: LabControl) -> dict[str, Any]:
    return {
        "type": control.kind,
        "label": control.label,
        "unit": control.unit,
        "min": control.minimum,
        "max": control.maximum,
        "step": control.step,
        "value": control.value,
        "digits": control.digits,
        "options": [list(option) for option in control.options],
        "param": control.param,
        "init": control.init,
        "reset": control.reset,
    }


def _plot_data(plot: LabPlot) -> dict[str, Any]:
    return {
        "ylabel": plot.ylabel,
        "xlabel": plot.xlabel,
        "window": plot.window,
        "ymin": plot.ymin,
        "ymax": plot.ymax,
        "height": plot.height,
        "refLines": [{"y": y, "label": label} for y, label in plot.ref_lines],
        "traces": [{"label": t.label, "dash": t.dash} for t in plot.traces],
    }
