"""A lab as a Python script that does natively what the lab does in the page, and its trial.

`script.jinja` puts the translated pieces together in the order in which the lab runs them
(docs/explanation/how-labs-run.md). `{{control:N}}` in the text stands for the value of control N,
which the page fills in. A script is not offered if its result differs from the lab's, or if it
fails for any value that the page may fill in.
"""

from __future__ import annotations

import functools
import json
import keyword
import math
import platform
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from msgspec import Struct

from coursebuild.api import Lesson, Store, Trial, TrialContext, regex
from coursebuild.core.text.source import unique_name
from coursebuild.core.values import fingerprint
from coursebuild.features.lab.engines.native import (
    LAB_ENGINE,
    EngineDescription,
    NativeEngine,
    NativeError,
    Readout,
    ScriptReply,
    lab_digest,
)
from coursebuild.features.lab.export.expressions import RESERVED, python_name
from coursebuild.features.lab.export.translate import (
    context_fields,
    translate_expression,
    translate_statements,
)
from coursebuild.features.lab.javascript import UntranslatableError
from coursebuild.features.lab.model import SIMLAB, Lab, Test, Writing
from coursebuild.features.lab.reply import PARITY_RTOL, MainRun, unpack_arrays
from coursebuild.features.lab.schema import Button, Control, Select, Slider

_HALF_CHARACTER = regex("[\ud800-\udfff]")
_PLACE = regex(r"\{\{control:(\d+)\}\}")
_ENVIRONMENT = Environment(
    trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True, undefined=StrictUndefined
)
_TEMPLATE = _ENVIRONMENT.from_string(Path(__file__).with_name("script.jinja").read_text("utf-8"))
_WIDTH = 88


class ExportMetadata(Struct, frozen=True):
    """Where a script comes from, and how long it runs."""

    name: str
    """Name of the file: `lab_4_2_1.py`."""
    origin: str
    """As in `a lab of lesson 4.2, “Mass and inertia”`."""
    course: str
    engine: str
    seconds: float


class Export(Struct, frozen=True):
    """The script of a lab."""

    name: str
    text: str
    """With `{{control:N}}` for the value of control N."""
    buttons: tuple[str, ...]


def file_name(lab: str) -> str:
    """Return the file name of a lab's script: `4.2-lab-1` → `lab_4_2_1.py`."""
    return f"lab_{re.sub(r'[^a-z0-9]+', '_', lab.lower().replace('-lab-', '_')).strip('_')}.py"


def fill_in_values(export: Export, values: Mapping[int, float | str]) -> str:
    """Fill the values of the controls into a script, as the page does."""
    return _PLACE.sub(lambda match: _literal(values[int(match[1])]), export.text)


def _literal(value: float | str) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return str(int(value)) if abs(value) < 1e15 and value == int(value) else repr(value)


def initial_values(lab: Lab) -> dict[int, float | str]:
    """Return the values with which the controls of a lab start."""
    controls = enumerate(lab.fields.controls)
    return {i: control.start for i, control in controls if not isinstance(control, Button)}


def export_script(
    lab: Lab,
    metadata: ExportMetadata,
    engine: EngineDescription,
    model: Mapping[str, bytes],
    writing: Writing | None = None,
) -> Export | str:
    """Write the script of a lab, or say why there is none; with `writing`, one that judges.

    `model` holds the files of its model by path, that of the model itself first.
    """
    if lab.kind != SIMLAB:
        return "its kind has code of its own"
    try:
        texts = {path: data.decode() for path, data in model.items()}
    except UnicodeDecodeError:
        return "its model has files that are no text"
    try:
        return _export(lab, metadata, engine, texts, writing)
    except UntranslatableError as error:
        return f"{error} has no counterpart in Python"
    except (RecursionError, MemoryError, SyntaxError):  # Python, too, has a limit
        return "code that is nested too deeply has no counterpart in Python"


def _export(
    lab: Lab,
    metadata: ExportMetadata,
    engine: EngineDescription,
    model: Mapping[str, str],
    writing: Writing | None,
) -> Export:
    code, names = lab.fields, _names(lab.fields.controls)
    translate = functools.partial(translate_statements, engine)
    setters = {
        i: (control, _setter(control))
        for i, control in enumerate(code.controls)
        if not isinstance(control, Button)
    }
    buttons = {i: c for i, c in enumerate(code.controls) if isinstance(c, Button)}
    pieces = [code.setup, code.controller, *(setter for _, setter in setters.values())]
    fields = context_fields([*pieces, *(button.run for button in buttons.values())])
    if writing is not None and writing.formula[-1]:
        fields["answer"] = "answer"

    constants: list[str] = []
    # Setters by the time at which the lab runs them.
    settings: dict[str, list[str]] = {"param": [], "once": [], "again": []}
    for i, (control, setter) in setters.items():
        constants += [*_comment(control), f"{names[i]} = {{{{control:{i}}}}}"]
        phase = "param" if control.param is not None else "again" if control.init else "once"
        settings[phase] += translate(setter, fields, names[i])
    button_functions = [
        {
            "name": names[i],
            "doc": f"The button “{_one_line(button.label)}”.",
            "lines": translate(button.run, fields, button=True),
        }
        for i, button in buttons.items()
    ]
    values = (
        (json.dumps(readout.label, ensure_ascii=False), readout.expr, readout.digits)
        for readout in code.readouts
    )
    translate_value = functools.partial(translate_expression, engine)
    *variables, formula = writing.formula if writing is not None else ("",)
    presses = {button.label: names[i] for i, button in buttons.items()}
    tests = [
        {
            "name": name,
            "doc": _one_line(test.name),
            "run": ", ".join(filter(None, [_literal(test.t), presses.get(test.name)])),
            "check": ", ".join([translate_value(test.expr, fields), *test.arguments()]),
        }
        for name, test in ({} if writing is None else _test_names(writing.tests)).items()
    ]
    text = _TEMPLATE.render(
        introduction=_introduction(lab, metadata, writing),
        formula=formula and translate_value(formula, (), variables),
        variables=", ".join(map(python_name, variables)),
        tests=tests,
        seconds=_literal(metadata.seconds),
        constants=constants,
        python=".".join(platform.python_version_tuple()[:2]),
        engine=metadata.engine,
        main=json.dumps(next(iter(model))),
        xml=_long_text(next(iter(model.values()))),
        files=[(json.dumps(path), _long_text(text)) for path, text in model.items()],
        fields=fields,
        keyframe=_keyframe(code.key),
        setup=translate(code.setup, fields),
        controller=translate(code.controller, fields),
        settings=settings,
        buttons=button_functions,
        resets="sim.reset" in "".join(button.run for button in buttons.values()),
        readouts=[(label, translate_value(e, fields), digits) for label, e, digits in values],
    )
    if len(_PLACE.findall(text)) != len(setters) or _HALF_CHARACTER.search(text):
        raise UntranslatableError("a text that no script can hold")
    return Export(metadata.name, text, tuple(names[i] for i in buttons))


def _test_names(tests: Iterable[Test]) -> dict[str, Test]:
    names: dict[str, Test] = {}
    for test in tests:
        name = "_".join(["test", *re.findall(r"[a-z0-9]+", test.name.lower())])[:60].strip("_")
        names[unique_name(name, names, "_")] = test
    return names


def _names(controls: Sequence[Control]) -> list[str]:
    names: list[str] = []
    for control in controls:
        is_button = isinstance(control, Button)
        label = control.label if isinstance(control, Button) else control.param or control.label
        name = "_".join(re.findall(r"[a-z0-9]+", label.lower()))[:50].strip("_")
        if not name or name[0].isdigit():
            name = f"{'button' if is_button else 'control'}_{name}".strip("_")
        name = name if is_button else name.upper()
        names.append(unique_name(name, {*names, *RESERVED, *keyword.kwlist}, "_"))
    return names


def _setter(control: Slider | Select) -> str:
    if control.set is not None:
        return f"({control.set}\n) = value"
    return control.apply or f"ctx.{control.param} = value"


def _keyframe(key: int | str | None) -> str:
    if key is None:
        return "mujoco.mj_resetData(model, data)"
    number = str(key) if isinstance(key, int) else f"model.key({json.dumps(key)}).id"
    return f"mujoco.mj_resetDataKeyframe(model, data, {number})"


def _introduction(lab: Lab, metadata: ExportMetadata, writing: Writing | None) -> str:
    title = f"{_one_line(lab.fields.title)}: " if lab.fields.title else ""
    runners = ["uv run", "python"]
    if writing is None:
        use = (
            "It starts and steps as the lab in the page does, with the controls as they were "
            "there, and prints the lab's readouts and the state at the end."
        )
    else:
        use = f"Change `{writing.subject}` below until all trials of the page pass."
        runners.append("pytest")
    origin = f"From the course “{_one_line(metadata.course)}”, for MuJoCo {metadata.engine}. {use}"
    first = f"{title}{_one_line(metadata.origin)}, as a script."
    texts = (textwrap.fill(text, _WIDTH) for text in (first, origin, "Run it with:"))
    return "\n\n".join([*texts, "\n".join(f"    {runner} {metadata.name}" for runner in runners)])


def _comment(control: Slider | Select) -> list[str]:
    unit = f" ({_one_line(control.unit)})" if control.unit else ""
    text = f"The control “{_one_line(control.label)}”{unit}"
    if isinstance(control, Select):
        pairs = ((_one_line(label), _literal(value)) for label, value in control.options)
        texts = (value if label == value else f"{value} ({label})" for label, value in pairs)
        text += f", one of {', '.join(texts)}"
    else:
        text += f", from {control.min:g} to {control.max:g}"
    return [f"# {line}" for line in textwrap.wrap(text, _WIDTH)]


def _one_line(text: str) -> str:
    printable = "".join(c if c.isprintable() else " " for c in text)
    return " ".join(printable.replace("\\", "/").replace('"', "'").split())


def _long_text(text: str) -> str:
    is_unprintable = any(not c.isprintable() and c != "\n" for c in text)
    if "\\" in text or '"""' in text or is_unprintable or text.endswith('"'):
        return repr(text)
    return f'"""\\\n{text}"""'


_RELATIVE = 1e-9
_ABSOLUTE = 1e-12
"""Tolerances of readouts of the same state."""
_INFINITE: dict[Any, str] = {math.inf: "∞", -math.inf: "−∞"}
"""Infinite values as a trial's reply writes them."""


class LabExport(Struct, frozen=True):
    """The script that a page offers to download, or why there is none."""

    script: tuple[str, str] | None
    """Name and text of the file, with `{{control:N}}` for values of controls."""
    reason: str = ""


def export_metadata(
    context: TrialContext, trial: Trial, kind: str, name: str, seconds: float
) -> ExportMetadata:
    """Say where a script comes from, of a `kind` such as `a lab`."""
    owner = next((o for o in context.course.owners if o.id == trial.owner), None)
    origin = f"{kind} of the page “{trial.owner if owner is None else owner.title}”"
    if isinstance(owner, Lesson):
        origin = f"{kind} of lesson {owner.id}, “{owner.title}”"
    return ExportMetadata(name, origin, context.course.title, LAB_ENGINE, seconds)


def export_lab(
    context: TrialContext,
    native: NativeEngine,
    trial: Trial,
    lab: Lab,
    model: Mapping[str, bytes],
    main: MainRun,
) -> LabExport:
    """Write and try the script of a lab, or take it from the store.

    `model` is as in `export_script`, `main` the main run of the lab's trial.
    """
    start, end = (main["pictures"][i]["time"] for i in (0, -1))
    metadata = export_metadata(
        context, trial, "a lab", file_name(trial.name), round(end - start, 9)
    )
    readouts = [picture["readouts"] for picture in main["pictures"]]
    code = lab_digest(".", "export/script.jinja")
    key = fingerprint((code, lab.config, metadata, {**model}, main.get("recorded"), readouts))
    write = functools.partial(_try_export, native, lab, metadata, model, main)
    return kept_export(context.run_store.store, key, write)


def kept_export(store: Store, key: str, write: Callable[[], LabExport]) -> LabExport:
    """Take an export from the store, or write and keep it."""
    export = store.get_value("exports", key, LabExport)
    if export is not None:
        return export
    try:
        export = write()
    except NativeError as error:
        return LabExport(None, f"the script {error}")
    store.put_value("exports", key, export)
    return export


def _try_export(
    native: NativeEngine,
    lab: Lab,
    metadata: ExportMetadata,
    model: Mapping[str, bytes],
    main: MainRun,
) -> LabExport:
    export = export_script(lab, metadata, native.description, model)
    if isinstance(export, str):
        return LabExport(None, export)
    if main["diverged"]:
        return LabExport(None, "its simulation diverges")
    record = main.get("recorded")
    if record is None:
        return LabExport(None, "the lab makes no step")
    start = initial_values(lab)
    variants = []  # each with a single control at another value than at the start
    for i, control in enumerate(lab.fields.controls):
        values: list[float | str] = []
        if isinstance(control, Slider):
            values = [control.min, control.max]
        elif isinstance(control, Select):
            values = [value for _, value in control.options]
        variants += [{**start, i: value} for value in values if value != start[i]]
    request = {
        "path": export.name,
        "text": fill_in_values(export, start),
        "variants": [fill_in_values(export, values) for values in variants],
        "buttons": list(export.buttons),
        "near": record["near"],
    }
    run = native.script(request)
    if run.failure:
        return LabExport(None, f"the script fails: {run.failure}")
    rtol = PARITY_RTOL if lab.verify.rtol is None else lab.verify.rtol
    reason = _difference(main, run, rtol)
    return LabExport(None, reason) if reason else LabExport((export.name, export.text))


# --- the script's run compared with the lab's


def record_for_export(run: dict[str, Any], horizon: int) -> dict[str, Any] | None:
    """Record of a trial's main run what scripts are compared with; `None` if it made no step.

    The state is the last one recorded up to the step `horizon`: later, a difference in the last bit
    may have grown.
    """
    steps, stride, width = run["steps"], run["stride"], run["width"]
    if steps < stride:
        return None
    row = max(1, min(horizon, steps) // stride)
    states = unpack_arrays(run["states"])
    return {
        "steps": steps,
        "last": int(unpack_arrays(run["checksums"])[-1]),
        "near": row * stride,
        "state": states[(row - 1) * width : row * width].tolist(),
    }


def _difference(main: MainRun, run: ScriptReply, rtol: float) -> str | None:
    """Say how a script's run differs from the main run of the trial; `None` if it does not.

    The states may differ by `rtol`, relative to the largest number, or to 1 if that is larger. If
    the last states are the same to the bit, the readouts there are compared, too.
    """
    record = main["recorded"]
    assert record is not None, "without a record no script is tried"
    if run.steps != record["steps"]:
        return f"it makes {run.steps} steps, and the lab {record['steps']}"
    state, lab_state, difference = run.state, record["state"], math.inf
    if len(state) == len(lab_state):
        largest = max([1.0, *map(abs, lab_state)])
        pairs = zip(state, lab_state, strict=True)
        difference = max([0.0, *(abs(a - b) / largest for a, b in pairs)])
    if not difference <= rtol:
        return f"its state after {record['near']} steps is apart from the lab's by {difference:.1e}"
    first, last = main["pictures"][0], main["pictures"][-1]
    reason = _compare_readouts(first["readouts"], run.start, "start")
    if reason is None and run.last == record["last"]:
        reason = _compare_readouts(last["readouts"], run.end, "end")
    return reason


def _compare_readouts(lab_values: Any, readouts: Sequence[Readout], moment: str) -> str | None:
    for (label, value), lab_value in zip(readouts, lab_values or (), strict=False):
        if lab_value is None:  # it is not a number, and the lab shows nothing
            continue
        value = _INFINITE.get(value, value)
        if isinstance(value, str) or isinstance(lab_value, str):
            is_same = value == lab_value
        else:
            is_same = math.isclose(value, lab_value, rel_tol=_RELATIVE, abs_tol=_ABSOLUTE)
        if not is_same:
            lab_readout = f"that of the lab {lab_value}"
            return f"its readout `{label}` is {value} at the {moment}, and {lab_readout}"
    return None
