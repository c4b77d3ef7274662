"""A lab as a Python script that does natively what the lab does in the page.

Entry points: `export_script(lab, about)`; `filled`, the script with the controls at given values.

1. Every piece of the lab's code is translated (`python_code`). Where one cannot be, there is no
   script, and the reason is told.
2. The pieces are put together in the order in which the lab's core runs them (see docs/labs.md),
   with the helpers that they use.
3. `{{control:N}}` stands in the text for the value of control N; the page puts it in.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping

from msgspec import Struct

from coursebuild.labs import export_text as text
from coursebuild.labs.export_text import About
from coursebuild.labs.javascript import parse_expression, parse_statements
from coursebuild.labs.javascript_tokens import UntranslatableError
from coursebuild.labs.javascript_tree import Assign, Name, Statement
from coursebuild.labs.python_code import (
    RESERVED,
    Piece,
    expression,
    setter,
    statements,
)
from coursebuild.labs.python_context import field_types
from coursebuild.labs.python_library import LIBRARY
from coursebuild.labs.python_values import Code, Names, Type, Used
from coursebuild.model import Lab, LabControl

_PLACE = re.compile(r"\{\{control:\d+\}\}")
_HALVES = re.compile("[\ud800-\udfff]")
"""Halves of characters, which no file can hold."""


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


def export_script(lab: Lab, about: About) -> Export | str:
    """The script of a lab, or why there is none."""
    if lab.kind != "simlab":
        return "its kind has code of its own"
    if lab.xml is not None and "file" in lab.xml.text:
        return "the model in the lab may be made of several files"
    try:
        return _Script(lab, about).export()
    except UntranslatableError as error:
        return f"{error} has no counterpart in Python"


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
        i: control.options[0][1] if control.value is None else control.value
        for i, control in enumerate(lab.controls)
        if control.kind != "button"
    }


class _Script:
    """Translates a lab, and writes the script."""

    def __init__(self, lab: Lab, about: About) -> None:
        self.lab = lab
        self.about = about
        self.used = Used()
        self.taken = {*RESERVED, *_RESERVED}
        self.functions: list[str] = []
        self.constants = [self._constant(control) for control in lab.controls]
        self.values = [
            None if name is None else _value(name, control)
            for name, control in zip(self.constants, lab.controls, strict=True)
        ]
        self.context = field_types(self._parameters(), self._code())
        self.args = "model, data, ctx" if self.context else "model, data"
        self.signature = "model: mujoco.MjModel, data: mujoco.MjData"
        self.signature += ", ctx: Ctx" if self.context else ""

    def _name(self, text: str, otherwise: str) -> str:
        """A name of Python that nothing else has."""
        words = re.findall(r"[a-z0-9]+", text.lower())
        name = "_".join(words)[:50].strip("_")
        name = otherwise if not name or name[0].isdigit() else name
        number, own = 2, name
        while own in self.taken or own.upper() in self.taken:
            own, number = f"{name}_{number}", number + 1
        self.taken |= {own, own.upper()}
        return own

    def _constant(self, control: LabControl) -> str | None:
        if control.kind == "button":
            return None
        return self._name(control.param or control.label, "control").upper()

    def _parameters(self) -> dict[str, Type]:
        found: dict[str, Type] = {}
        for control, value in zip(self.lab.controls, self.values, strict=True):
            if control.param is not None and value is not None:
                if control.param in found:
                    raise UntranslatableError(f"`ctx.{control.param}` of two controls")
                found[control.param] = value.type
        return found

    def _code(self) -> Iterator[tuple[tuple[Statement, ...], Type | None]]:
        """All statements, each piece with the type of `value` in it."""
        for code in (self.lab.setup, self.lab.controller):
            yield parse_statements(code), None
        for control, value in zip(self.lab.controls, self.values, strict=True):
            kind = value.type if value is not None else None
            if control.set is not None:
                target = parse_expression(control.set)
                yield (Assign((target,), "", Name("value")),), kind
            for run in (control.apply, control.run):
                if run is not None:
                    yield parse_statements(run), kind

    def _names(self, value: Code | None = None) -> Names:
        return Names(self.context, value)

    # --- the script

    def export(self) -> Export:
        """Everything, put together; what is used is known only at the end."""
        start = self._start()
        buttons = [self._button(c) for c in self.lab.controls if c.run is not None]
        step = self._step()
        readouts = self._readouts()
        body = [*text.load(self.lab), *self.functions, *start]
        for _, lines in buttons:
            body += lines
        body += [*step, *text.simulate(self.signature, self.args), *readouts]
        body += text.report(self.signature, self.args)
        names = tuple(name for name, _ in buttons)
        body += text.main(self.args, bool(self.context), names)
        script = "\n".join([*self._head(), *body, ""])
        shown = sum(name is not None for name in self.constants)
        if len(_PLACE.findall(script)) != shown or _HALVES.search(script):
            raise UntranslatableError("a text that no script can hold")
        return Export(self.about.name, script, names, self.used.exact)

    def _head(self) -> list[str]:
        """All that comes before the functions of the lab."""
        helpers = text.helpers(self.used.helpers)
        modules = self.used.modules | text.context_modules(self.context)
        modules |= {line for name in helpers for line in LIBRARY[name].imports}
        modules |= {"import numpy as np"} if self.lab.readouts else set()
        lines = text.docstring(self.lab, self.about)
        lines += ["", *text.imports(modules, self.lab.xml is not None), ""]
        lines += [f"SECONDS = {text.number(self.about.seconds)}  # of simulated time"]
        for i, (name, control) in enumerate(zip(self.constants, self.lab.controls, strict=True)):
            value = self.values[i]
            if name is not None and value is not None:
                lines += text.constant(i, name, control, value.type == "num")
        lines += text.DIVERGED
        if self.lab.xml is not None:
            lines += [f"XML = {text.long_text(self.lab.xml.text)}"]
        for name in helpers:
            lines += ["", LIBRARY[name].source.rstrip()]
        if "Random" in helpers:
            lines += ["", "", f"random = Random({self.lab.seed or 0})"]
        return [*lines, *text.context_class(self.context)]

    # --- pieces

    def _placed(self, piece: Piece, name: str, told: str) -> list[str]:
        """The lines of a piece among others, or a call of a function that is added for it."""
        if not piece.alone and not piece.returns:
            return list(piece.lines)
        name = self._name(name, "piece")
        self.functions += text.function(name, self.signature, told, piece.lines)
        return [f"{name}({self.args})"]

    def _applied(self, i: int) -> list[str]:
        """A control's setter at its present value."""
        control, value = self.lab.controls[i], self.values[i]
        names = self._names(value)
        if control.set is not None:
            piece = setter(control.set, names, self.used)
        elif control.apply is not None:
            piece = statements(control.apply, names, self.used)
        else:
            assert control.param is not None and value is not None
            number = self.context[control.param] == "num" and value.type != "num"
            present = f"float({value.text})" if number else value.text
            return [f"ctx.{control.param} = {present}"]
        told = f"Apply the control “{text.plain(control.label)}”."
        return self._placed(piece, f"set {control.label}", told)

    def _start(self) -> list[str]:
        probe = self._probe()
        controls = self.lab.controls
        settable = [i for i, control in enumerate(controls) if control.kind != "button"]
        params = [i for i in settable if controls[i].param is not None]
        once = [i for i in settable if i not in params and not controls[i].init]
        again = [i for i in settable if i not in params and controls[i].init]
        first = [line for i in params for line in self._applied(i)] + self._to_keyframe(
            "Random" in probe.helpers
        )
        middle = [line for i in once for line in self._applied(i)]
        last: list[str] = []
        if self.lab.setup:
            piece = statements(self.lab.setup, self._names(), self.used)
            last += self._placed(piece, "set up", "The lab's own preparation.")
        last += [line for i in again for line in self._applied(i)]
        last += ["mujoco.mj_forward(model, data)"]
        if not probe.resets:
            told = "Bring the lab to its start."
            return text.function("start", self.signature, told, [*first, *middle, *last])
        middle = ["if first:", *(f"    {line}" for line in middle)] if middle else []
        told = "What happens at the start (`first`) and at every reset."
        signature = f"{self.signature}, *, first: bool = False"
        start = [f"reset({self.args}, first=True)"]
        lines = text.function("reset", signature, told, [*first, *middle, *last])
        return lines + text.function("start", self.signature, "Bring the lab to its start.", start)

    def _probe(self) -> Used:
        """What the code of the lab uses, found before anything is written."""
        used = Used()
        for code in (self.lab.setup, self.lab.controller):
            statements(code, self._names(), used)
        for control, value in zip(self.lab.controls, self.values, strict=True):
            if control.apply is not None:
                statements(control.apply, self._names(value), used)
            if control.set is not None:
                setter(control.set, self._names(value), used)
            if control.run is not None:
                statements(control.run, self._names(), used, button=True)
        return used

    def _to_keyframe(self, random: bool) -> list[str]:
        key = self.lab.key
        lines = ["mujoco.mj_resetData(model, data)"]
        if key is not None:
            number = str(key) if isinstance(key, int) else f"model.key({json.dumps(key)}).id"
            lines = [f"mujoco.mj_resetDataKeyframe(model, data, {number})"]
        if random:
            lines += ["random.restart()"]
        return [*lines, "mujoco.mj_forward(model, data)"]

    def _button(self, control: LabControl) -> tuple[str, list[str]]:
        assert control.run is not None
        exact = self.used.exact  # buttons are not pressed where results are compared
        piece = statements(control.run, self._names(), self.used, button=True)
        self.used.exact = exact
        name = self._name(control.label, "button")
        lines = list(piece.lines)
        if piece.returns:
            lines = self._placed(piece, f"press {control.label}", "What the button does.")
        lines = ["mujoco.mj_forward(model, data)", *lines, "mujoco.mj_forward(model, data)"]
        told = f"The button “{text.plain(control.label)}”."
        return name, text.function(name, self.signature, told, lines)

    def _step(self) -> list[str]:
        lines: list[str] = []
        if self.lab.controller:
            piece = statements(self.lab.controller, self._names(), self.used)
            if piece.returns:
                lines += self._control(piece)
            else:
                lines += piece.lines
        told = "One step: the lab's controller, then MuJoCo." if lines else "One step."
        return text.function("step", self.signature, told, [*lines, "mujoco.mj_step(model, data)"])

    def _control(self, piece: Piece) -> list[str]:
        self.functions += text.function(
            "control", self.signature, "The controller.", list(piece.lines)
        )
        return [f"control({self.args})"]

    def _readouts(self) -> list[str]:
        told = "Label, value and decimal places of what the lab shows."
        lines = ["data = current(model, data)"] if self.lab.readouts else []
        lines += ["return ["]
        exact = self.used.exact
        for readout in self.lab.readouts:
            value = expression(readout.expr, self._names(), self.used)
            label = json.dumps(readout.label, ensure_ascii=False)
            lines.append(f"    ({label}, {value.text}, {readout.digits}),")
        self.used.exact = exact
        lines = ["return []"] if not self.lab.readouts else [*lines, "]"]
        result = "list[tuple[str, float | str, int]]"
        made = text.function("readouts", self.signature, told, lines, result)
        return [*(text.current() if self.lab.readouts else []), *made]


def _value(name: str, control: LabControl) -> Code:
    """What `value` is in the code of a control."""
    if control.kind == "slider":
        return Code(name, "num")
    values = [value for _, value in control.options]
    numbers = [value for value in values if not isinstance(value, str)]
    if not numbers:
        return Code(name, "str")
    if len(numbers) < len(values):
        raise UntranslatableError("a choice between texts and numbers")
    if any(value != int(value) or abs(value) >= 2**31 for value in numbers):
        return Code(name, "num")
    bound = max(abs(value) for value in numbers)
    return Code(name, "int" if min(numbers) < 0 else "nat", bound=bound)


_RESERVED = "SECONDS XML DIVERGED WORD current seconds xml diverged word".split()
"""Names that a script has besides those that its code can see."""
