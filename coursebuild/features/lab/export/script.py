"""A lab as a Python script that does natively what the lab does in the page.

Entry points: `export_script(lab, metadata)`; `filled`, the script with values for its controls.

1. Every piece of the lab's code is translated (`statements`). Where one cannot be, there is
   no script, and the reason is said.
2. The pieces are put together in the order in which the lab's core runs them (see
   docs/explanation/how-labs-run.md), with the helpers that they use.
3. `{{control:N}}` stands in the text for the value of control N; the page puts it in.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterable, Iterator, Mapping

from msgspec import Struct

from coursebuild.features.lab.export import text
from coursebuild.features.lab.export.calls import INEXACT
from coursebuild.features.lab.export.library import (
    LIBRARY,
    RESERVED,
    helpers,
    imports,
    names_in,
)
from coursebuild.features.lab.export.statements import (
    Translation,
    field_types,
    translate_expression,
    translate_statements,
)
from coursebuild.features.lab.export.text import ExportMetadata
from coursebuild.features.lab.export.values import Code, Type
from coursebuild.features.lab.javascript import UntranslatableError
from coursebuild.features.lab.model import SIMLAB, Lab
from coursebuild.features.lab.schema import Button, Control, Select, Slider

_PLACE = re.compile(r"\{\{control:\d+\}\}")
_RESERVED = "SECONDS XML DIVERGED WORD current seconds xml diverged word".split()
"""Names that a script has besides those that its code can see."""
_FORWARD = "mujoco.mj_forward(model, data)"


class Export(Struct, frozen=True):
    """A script."""

    name: str
    text: str
    """With `{{control:N}}` for the value of control N."""
    buttons: tuple[str, ...]
    """Names of the functions of the lab's buttons."""
    exact: bool
    """Whether its result can be that of the lab to the last bit."""


def file_name(lab: str) -> str:
    """The name of the script of a lab: `4.2-lab-1` → `lab_4_2_1.py`."""
    return f"lab_{re.sub(r'[^a-z0-9]+', '_', lab.lower().replace('-lab-', '_')).strip('_')}.py"


def export_script(lab: Lab, metadata: ExportMetadata) -> Export | str:
    """The script of a lab, or why there is none."""
    if lab.kind != SIMLAB:
        return "its kind has code of its own"
    if lab.xml is not None and "file" in lab.xml.text:
        return "the model in the lab may be made of several files"
    try:
        return _Script(lab, metadata).export()
    except UntranslatableError as error:
        return f"{error} has no counterpart in Python"
    except (RecursionError, SyntaxError):  # Python, too, has a limit
        return "code that is nested too deeply has no counterpart in Python"


def filled(export: Export, values: Mapping[int, float | str]) -> str:
    """The script with the controls at these values, as the page does it."""

    def literal(match: re.Match[str]) -> str:
        value = values[int(match.group()[10:-2])]
        if isinstance(value, str):
            return json.dumps(value, ensure_ascii=False)
        return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)

    return _PLACE.sub(literal, export.text)


def initial_values(lab: Lab) -> dict[int, float | str]:
    """The values that the controls of a lab start with."""
    return {
        i: control.start
        for i, control in enumerate(lab.fields.controls)
        if not isinstance(control, Button)
    }


class _Control(Struct, frozen=True):
    """A control that has a value."""

    control: Slider | Select
    value: Code
    """The constant in the script: what `value` is in the control's code."""
    applied: Translation


class _Script:
    """Translates a lab, and writes the script."""

    def __init__(self, lab: Lab, metadata: ExportMetadata) -> None:
        self.lab, self.metadata = lab, metadata
        self.taken = {*RESERVED, *_RESERVED}
        self.functions: list[str] = []
        values = [self._constant(control) for control in lab.fields.controls]
        self.context = field_types(self._parameters(values), _pieces(lab, values))
        self.args = "model, data, ctx" if self.context else "model, data"
        self.signature = "model: mujoco.MjModel, data: mujoco.MjData"
        self.signature += ", ctx: Ctx" if self.context else ""
        self.setup = translate_statements(lab.fields.setup, self.context)
        self.controller = translate_statements(lab.fields.controller, self.context)
        self.controls = {
            i: _Control(control, value, self._applied(control, value))
            for i, (control, value) in enumerate(zip(lab.fields.controls, values, strict=True))
            if value is not None and not isinstance(control, Button)
        }
        self.runs = [
            (control, translate_statements(control.run, self.context, button=True))
            for control in lab.fields.controls
            if isinstance(control, Button)
        ]
        translations = [self.setup, self.controller, *(run for _, run in self.runs)]
        translations += [control.applied for control in self.controls.values()]
        self.used = names_in("\n".join(line for piece in translations for line in piece.lines))

    def _name(self, label: str, otherwise: str) -> str:
        """A name of Python that nothing else has."""
        name = "_".join(re.findall(r"[a-z0-9]+", label.lower()))[:50].strip("_")
        name = otherwise if not name or name[0].isdigit() else name
        number, own = 2, name
        while own in self.taken or own.upper() in self.taken:
            own, number = f"{name}_{number}", number + 1
        self.taken |= {own, own.upper()}
        return own

    def _constant(self, control: Control) -> Code | None:
        """The constant of a control; a button has none."""
        if isinstance(control, Button):
            return None
        name = self._name(control.param or control.label, "control").upper()
        if isinstance(control, Slider):
            return Code(name, "num")
        values = [value for _, value in control.options]
        numbers = [value for value in values if not isinstance(value, str)]
        if not numbers:
            return Code(name, "str")
        if len(numbers) < len(values):
            raise UntranslatableError("a choice between texts and numbers")
        if any(value != int(value) or abs(value) >= 2**31 for value in numbers):
            return Code(name, "num")
        return Code(name, "int" if min(numbers) < 0 else "nat")

    def _parameters(self, values: list[Code | None]) -> dict[str, Type]:
        found: dict[str, Type] = {}
        for control, value in zip(self.lab.fields.controls, values, strict=True):
            if value is not None and not isinstance(control, Button) and control.param is not None:
                if control.param in found:
                    raise UntranslatableError(f"`ctx.{control.param}` of two controls")
                found[control.param] = value.type
        return found

    def _applied(self, control: Slider | Select, value: Code) -> Translation:
        """A control's setter at its present value."""
        code = _setter(control)
        if code is not None:
            return translate_statements(code, self.context, value)
        assert control.param is not None
        as_number = self.context[control.param] == "num" and value.type != "num"
        present = f"float({value.text})" if as_number else value.text
        return Translation((f"ctx.{control.param} = {present}",))

    # --- the script

    def export(self) -> Export:
        """Everything, put together; what is used is known only at the end."""
        start = self._start()
        buttons = [self._button(control, run) for control, run in self.runs]
        step = self._step()
        exact = _is_exact("\n".join([*self.functions, *start, step]))
        names = tuple(name for name, _ in buttons)
        sections = [
            *text.context_class(self.context),
            text.load(self.lab),
            *self.functions,
            *start,
            *(section for _, sections in buttons for section in sections),
            step,
            text.simulate(self.signature, self.args),
            *self._readouts(),
            text.report(self.signature, self.args),
            text.main(self.args, bool(self.context), names),
        ]
        script = self._with_head(sections)
        if len(_PLACE.findall(script)) != len(self.controls):
            raise UntranslatableError("a text that no script can hold")
        return Export(self.metadata.name, script, names, exact)

    def _with_head(self, sections: list[str]) -> str:
        """The script, with all that comes before its functions."""
        constants = [f"SECONDS = {text.number(self.metadata.seconds)}  # of simulated time"]
        for i, one in self.controls.items():
            constants += text.constant(i, one.value, one.control)
        constants.append(text.DIVERGED)
        if self.lab.xml is not None:
            constants.append(f"XML = {text.long_text(self.lab.xml.text)}")
        if "random" in names_in(*sections):
            sections = [f"random = Random({self.lab.fields.seed or 0})", *sections]
        parts = ["\n".join(constants), *(LIBRARY[name] for name in helpers(*sections)), *sections]
        body = "\n\n\n".join(parts)
        try:
            body.encode()
        except UnicodeEncodeError:
            raise UntranslatableError("a text that no script can hold") from None
        head = [*text.docstring(self.lab, self.metadata), "", *imports(*parts)]
        return "\n".join([*head, "", body, "", "", 'if __name__ == "__main__":', "    main()", ""])

    # --- pieces

    def _placed(self, piece: Translation, label: str, doc: str) -> list[str]:
        """The lines of a piece among others, or a call of a function that is added for it."""
        if not piece.has_variables and not piece.returns:
            return list(piece.lines)
        name = self._name(label, "piece")
        self.functions.append(text.function(name, self.signature, doc, piece.lines))
        return [f"{name}({self.args})"]

    def _set(self, controls: Iterable[_Control]) -> list[str]:
        """The lines that apply controls."""
        lines: list[str] = []
        for one in controls:
            label = one.control.label
            doc = f"Apply the control “{text.plain(label)}”."
            lines += self._placed(one.applied, f"set {label}", doc)
        return lines

    def _start(self) -> list[str]:
        """The functions that bring the lab to its start."""
        controls = self.controls.values()
        others = [one for one in controls if one.control.param is None]
        first = self._set(one for one in controls if one.control.param is not None)
        first += self._to_keyframe()
        once = self._set(one for one in others if not one.control.init)
        last = self._placed(self.setup, "set up", "The lab's own preparation.")
        last += self._set(one for one in others if one.control.init)
        last.append(_FORWARD)
        doc = "Bring the lab to its start."
        if "reset" not in self.used:
            return [text.function("start", self.signature, doc, [*first, *once, *last])]
        once = ["if first:", *(f"    {line}" for line in once)] if once else []
        signature = f"{self.signature}, *, first: bool = False"
        why = "What happens at the start (`first`) and at every reset."
        return [
            text.function("reset", signature, why, [*first, *once, *last]),
            text.function("start", self.signature, doc, [f"reset({self.args}, first=True)"]),
        ]

    def _to_keyframe(self) -> list[str]:
        key = self.lab.fields.key
        lines = ["mujoco.mj_resetData(model, data)"]
        if key is not None:
            number = str(key) if isinstance(key, int) else f"model.key({json.dumps(key)}).id"
            lines = [f"mujoco.mj_resetDataKeyframe(model, data, {number})"]
        return [*lines, *(["random.restart()"] if "random" in self.used else []), _FORWARD]

    def _button(self, control: Button, run: Translation) -> tuple[str, list[str]]:
        """The name of a button's function, and what it consists of."""
        name = self._name(control.label, "button")
        lines, sections = list(run.lines), []
        if run.returns:
            inner = self._name(f"press {control.label}", "piece")
            doc = "What the button does."
            sections.append(text.function(inner, self.signature, doc, lines))
            lines = [f"{inner}({self.args})"]
        doc = f"The button “{text.plain(control.label)}”."
        lines = [_FORWARD, *lines, _FORWARD]
        return name, [*sections, text.function(name, self.signature, doc, lines)]

    def _step(self) -> str:
        lines = list(self.controller.lines)
        doc = "One step: the lab's controller, then MuJoCo." if lines else "One step."
        if self.controller.returns:
            self.functions.append(
                text.function("control", self.signature, "The controller.", lines)
            )
            lines = [f"control({self.args})"]
        lines.append("mujoco.mj_step(model, data)")
        return text.function("step", self.signature, doc, lines)

    def _readouts(self) -> Iterator[str]:
        lines = ["return []"]
        if self.lab.fields.readouts:
            yield text.CURRENT
            lines = ["data = current(model, data)", "return ["]
            for readout in self.lab.fields.readouts:
                value = translate_expression(readout.expr, self.context).text
                label = json.dumps(readout.label, ensure_ascii=False)
                lines.append(f"    ({label}, {value}, {readout.digits}),")
            lines.append("]")
        doc = "Label, value and decimal places of what the lab shows."
        result = "list[tuple[str, float | str, int]]"
        yield text.function("readouts", self.signature, doc, lines, result)


def _setter(control: Slider | Select) -> str | None:
    """The code that a control runs at a value; `None` where it only has a name."""
    return f"({control.set}\n) = value" if control.set is not None else control.apply


def _pieces(lab: Lab, values: list[Code | None]) -> Iterator[tuple[str, Code | None]]:
    """All statements of a lab, each piece with what `value` stands for in it."""
    yield from ((lab.fields.setup, None), (lab.fields.controller, None))
    for control, value in zip(lab.fields.controls, values, strict=True):
        piece = control.run if isinstance(control, Button) else _setter(control)
        if piece is not None:
            yield piece, value


def _is_exact(code: str) -> bool:
    """Whether no function is involved whose last bit may differ from one library to another."""
    return not INEXACT & names_in(code) and not any(
        isinstance(node, ast.Pow) or (isinstance(node, ast.Attribute) and node.attr in INEXACT)
        for node in ast.walk(ast.parse(code))
    )
