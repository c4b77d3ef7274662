"""A lab as a Python script that does natively what the lab does in the page.

Entry points: `export_script(lab, metadata)`; `fill_in_values`, for the values of its controls.

The template `script.jinja` puts the translated pieces of the lab's code together in the order in
which the lab runs them (docs/explanation/how-labs-run.md). In the text `{{control:N}}` stands for
the value of control N, which the page fills in.
"""

from __future__ import annotations

import functools
import json
import keyword
import re
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path

from jinja2 import Environment, StrictUndefined, Template
from msgspec import Struct

from coursebuild.core.text.source import unique_name
from coursebuild.features.lab.export.expressions import RESERVED
from coursebuild.features.lab.export.translate import (
    context_fields,
    translate_expression,
    translate_statements,
)
from coursebuild.features.lab.javascript import UntranslatableError
from coursebuild.features.lab.model import SIMLAB, Lab
from coursebuild.features.lab.schema import Button, Control, Select, Slider

_HALF_CHARACTER = re.compile("[\ud800-\udfff]")
_PLACE = re.compile(r"\{\{control:(\d+)\}\}")
_TEMPLATE = Path(__file__).with_name("script.jinja")
_WIDTH = 88


class ExportMetadata(Struct, frozen=True):
    """Where a script comes from, and how long it runs."""

    name: str
    """Name of the file: `lab_4_2_1.py`."""
    origin: str
    """As in `a lab of lesson 4.2, “Mass and inertia”`."""
    course: str
    engine: str
    """Version of MuJoCo."""
    seconds: float
    """Simulated time."""


class Export(Struct, frozen=True):
    """The script of a lab."""

    name: str
    text: str
    """With `{{control:N}}` for the value of control N."""
    buttons: tuple[str, ...]
    """Names of the functions of the lab's buttons."""


def file_name(lab: str) -> str:
    """Return the file name of a lab's script: `4.2-lab-1` → `lab_4_2_1.py`."""
    return f"lab_{re.sub(r'[^a-z0-9]+', '_', lab.lower().replace('-lab-', '_')).strip('_')}.py"


def fill_in_values(export: Export, values: Mapping[int, float | str]) -> str:
    """Fill the values of the controls into a script, as the page does."""
    return _PLACE.sub(lambda match: _literal(values[int(match[1])]), export.text)


def _literal(value: float | str) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)


def initial_values(lab: Lab) -> dict[int, float | str]:
    """Return the values with which the controls of a lab start."""
    controls = enumerate(lab.fields.controls)
    return {i: control.start for i, control in controls if not isinstance(control, Button)}


def export_script(lab: Lab, metadata: ExportMetadata) -> Export | str:
    """Write the script of a lab, or say why there is none."""
    if lab.kind != SIMLAB:
        return "its kind has code of its own"
    if lab.xml is not None and "file" in lab.xml.text:
        return "the model in the lab may be made of several files"
    try:
        return _export(lab, metadata)
    except UntranslatableError as error:
        return f"{error} has no counterpart in Python"
    except (RecursionError, MemoryError, SyntaxError):  # Python, too, has a limit
        return "code that is nested too deeply has no counterpart in Python"


def _export(lab: Lab, metadata: ExportMetadata) -> Export:
    code, names = lab.fields, _names(lab.fields.controls)
    setters = {
        i: (control, _setter(control))
        for i, control in enumerate(code.controls)
        if not isinstance(control, Button)
    }
    buttons = {i: c for i, c in enumerate(code.controls) if isinstance(c, Button)}
    pieces = [code.setup, code.controller, *(setter for _, setter in setters.values())]
    fields = context_fields([*pieces, *(button.run for button in buttons.values())])

    constants: list[str] = []
    # Setters by the time at which the lab runs them.
    settings: dict[str, list[str]] = {"param": [], "once": [], "again": []}
    for i, (control, setter) in setters.items():
        constants += [*_comment(control), f"{names[i]} = {{{{control:{i}}}}}"]
        phase = "param" if control.param is not None else "again" if control.init else "once"
        settings[phase] += translate_statements(setter, fields, names[i])
    button_functions = [
        {
            "name": names[i],
            "doc": f"The button “{_one_line(button.label)}”.",
            "lines": translate_statements(button.run, fields, button=True),
        }
        for i, button in buttons.items()
    ]
    values = (
        (json.dumps(readout.label, ensure_ascii=False), readout.expr, readout.digits)
        for readout in code.readouts
    )
    text = _template().render(
        introduction=_introduction(lab, metadata),
        seconds=_literal(metadata.seconds),
        constants=constants,
        model=json.dumps(code.model),
        xml=None if lab.xml is None else _long_text(lab.xml.text),
        fields=fields,
        keyframe=_keyframe(code.key),
        setup=translate_statements(code.setup, fields),
        controller=translate_statements(code.controller, fields),
        settings=settings,
        buttons=button_functions,
        resets="sim.reset" in "".join(button.run for button in buttons.values()),
        readouts=[(label, translate_expression(e, fields), digits) for label, e, digits in values],
    )
    if len(_PLACE.findall(text)) != len(setters) or _HALF_CHARACTER.search(text):
        raise UntranslatableError("a text that no script can hold")
    return Export(metadata.name, text, tuple(names[i] for i in buttons))


@functools.cache
def _template() -> Template:
    environment = Environment(
        trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True, undefined=StrictUndefined
    )
    return environment.from_string(_TEMPLATE.read_text(encoding="utf-8"))


def _names(controls: Sequence[Control]) -> list[str]:
    """Name the controls in the script: constants, in capitals, and functions for buttons."""
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
    """Return the code that a control runs with its `value`."""
    if control.set is not None:
        return f"({control.set}\n) = value"
    return control.apply or f"ctx.{control.param} = value"


def _keyframe(key: int | str | None) -> str:
    """Write the line that resets the data to the lab's keyframe."""
    if key is None:
        return "mujoco.mj_resetData(model, data)"
    number = str(key) if isinstance(key, int) else f"model.key({json.dumps(key)}).id"
    return f"mujoco.mj_resetDataKeyframe(model, data, {number})"


def _introduction(lab: Lab, metadata: ExportMetadata) -> str:
    """Say what the script is and how to run it."""
    title = f"{_one_line(lab.fields.title)}: " if lab.fields.title else ""
    origin = (
        f"From the course “{_one_line(metadata.course)}”, for MuJoCo {metadata.engine}. It starts "
        "and steps as the lab in the page does, with the controls as they were there, and prints "
        "the lab's readouts and the state at the end."
    )
    path, usage = metadata.name, "Run it with:"
    if lab.xml is None:
        path = f"examples/{metadata.name}"
        usage = f"The model is the course's: save this file as {path} there, and run it with:"
    first = f"{title}{_one_line(metadata.origin)}, as a script."
    texts = (textwrap.fill(text, _WIDTH) for text in (first, origin, usage))
    return "\n\n".join([*texts, f"    python {path}"])


def _comment(control: Slider | Select) -> list[str]:
    """Write the comment above the constant of a control."""
    unit = f" ({_one_line(control.unit)})" if control.unit else ""
    text = f"The control “{_one_line(control.label)}”{unit}"
    if isinstance(control, Select):
        text += ", one of " + ", ".join(_option(*option) for option in control.options)
    else:
        text += f", from {control.min:g} to {control.max:g}"
    return [f"# {line}" for line in textwrap.wrap(text, _WIDTH)]


def _option(label: str, value: float | str) -> str:
    literal = _literal(value)
    return literal if _one_line(label) == literal else f"{literal} ({_one_line(label)})"


def _one_line(text: str) -> str:
    """Put a text of the author on one line, for a comment."""
    printable = "".join(c if c.isprintable() else " " for c in text)
    return " ".join(printable.replace("\\", "/").replace('"', "'").split())


def _long_text(text: str) -> str:
    """Write a text of several lines as a literal of Python."""
    is_unprintable = any(not c.isprintable() and c != "\n" for c in text)
    if "\\" in text or '"""' in text or is_unprintable or text.endswith('"'):
        return repr(text)
    return f'"""\\\n{text}"""'
