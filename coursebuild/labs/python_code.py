"""Pieces of lab code as Python.

Entry points: `statements(code, …)`, `setter(target, …)`, `expression(code, …)`; `field_types`,
which finds what the code keeps in `ctx`.

A piece becomes the lines of a function's body. Whether it may stand among other lines is told with
it: one that has variables of its own needs a function of its own.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import assert_never

from coursebuild.labs.engine_names import ARRAYS, SCALARS, SIZES
from coursebuild.labs.javascript import parse_expression, parse_statements
from coursebuild.labs.javascript_tree import (
    Array,
    Assign,
    Binary,
    Block,
    Call,
    Declare,
    Evaluate,
    Expression,
    For,
    If,
    Index,
    Jump,
    Member,
    Name,
    Number,
    Spread,
    Statement,
    While,
)
from coursebuild.labs.python_calls import Calls
from coursebuild.labs.python_values import (
    NAMED,
    NUMBERS,
    Code,
    Names,
    Type,
    Used,
    Variable,
    floating,
    refuse,
)

_INDENT = "    "
RESERVED = frozenset(
    """
        model data ctx lib math np mujoco sim index power norm rad deg energy momentum maximum
        minimum sign rounded random normal_force angular_momentum of_everything abs float int any
        Ctx Energy Random WORD load start reset step simulate readouts report main control range
        model_path struct print max min len range
    """.split()
) | frozenset(keyword.kwlist + keyword.softkwlist)
"""Names that nothing else in a script may have."""


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of code in Python."""

    lines: tuple[str, ...]
    alone: bool = False
    """Whether it needs a function of its own: it has variables."""
    returns: bool = False
    """Whether it may end before its last line."""


def statements(code: str, names: Names, used: Used, *, button: bool = False) -> Piece:
    """Statements; `button`: what only concerns the page's clock is left out.

    Raises:
        UntranslatableError: they cannot be translated.
    """
    writer = _Statements(names, used, button)
    lines = tuple(writer.block(parse_statements(code)))
    return Piece(lines, bool(writer.taken), writer.returns)


def setter(target: str, names: Names, used: Used) -> Piece:
    """The assignment of `value` to a target.

    Raises:
        UntranslatableError: it cannot be translated.
    """
    writer = _Statements(names, used, button=False)
    assign = Assign((parse_expression(target),), "", Name("value"))
    return Piece(tuple(writer.statement(assign)))


def expression(code: str, names: Names, used: Used) -> Code:
    """An expression that gives a number or a text.

    Raises:
        UntranslatableError: it cannot be translated, or gives something else.
    """
    made = _Statements(names, used, button=False).value(parse_expression(code), single=True)
    if made.type not in (*NUMBERS, "str"):
        raise refuse(f"{NAMED[made.type]} where a number or a text should be")
    return made


class _Statements(Calls):
    """Translates statements."""

    def __init__(self, names: Names, used: Used, button: bool) -> None:
        super().__init__(names, used)
        self.button = button
        self.taken: set[str] = set()
        self.returns = False

    def block(self, body: Iterable[Statement]) -> Iterator[str]:
        """Statements in a scope of their own."""
        self.scopes.append({})
        for statement in body:
            yield from self.statement(statement)
        self.scopes.pop()

    def indented(self, body: Iterable[Statement]) -> list[str]:
        return [_INDENT + line for line in self.block(body)] or [_INDENT + "pass"]

    def statement(self, statement: Statement) -> Iterator[str]:
        """The lines of a statement."""
        match statement:
            case Assign(targets, operator, value):
                yield self.assignment(targets, operator, value)
            case Declare(name, value, constant):
                yield self.declaration(name, value, constant)
            case Evaluate(evaluated):
                yield from self.evaluation(evaluated)
            case If(test, then, otherwise):
                yield f"if {self.test(test).text}:"
                yield from self.indented(then)
                yield from self.otherwise(otherwise)
            case While(test, body):
                yield f"while {self.test(test).text}:"
                yield from self.indented(body)
            case For():
                yield from self.loop(statement)
            case Block(body):
                yield from self.block(body)
            case Jump(word):
                self.returns = self.returns or word == "return"
                yield word
            case _:
                assert_never(statement)

    def otherwise(self, body: tuple[Statement, ...]) -> Iterator[str]:
        if not body:
            return
        if len(body) == 1 and isinstance(body[0], If):
            first, *rest = self.statement(body[0])
            yield f"el{first}"
            yield from rest
        else:
            yield "else:"
            yield from self.indented(body)

    # --- variables

    def declare(self, name: str, type: Code, constant: bool) -> str:
        """A variable of the innermost scope; its name in Python, where scopes are not nested."""
        if name in _ENGINE_NAMES or name in self.scopes[-1]:
            raise refuse(f"a variable `{name}`")
        own = name.strip("$").replace("$", "_") or "x"
        while own in RESERVED or own in self.taken or own.startswith("__"):
            own = f"{own.lstrip('_')}_"
        self.taken.add(own)
        code = Code(own, type.type, bound=type.bound, element=type.element)
        self.scopes[-1][name] = Variable(code, constant)
        return own

    def declaration(self, name: str, value: Expression, constant: bool) -> str:
        code = self.value(value, single=True)
        if code.type in ("nothing", "rows"):
            raise refuse(f"{NAMED[code.type]} in a variable")
        if not constant:
            code = floating(code) if code.type in NUMBERS else code
        text = code.text
        return f"{self.declare(name, code, constant)} = {text}"

    # --- assignments

    def assignment(self, targets: tuple[Expression, ...], operator: str, value: Expression) -> str:
        if operator == "":
            places = [self.place(target) for target in targets]
            text = self.stored(value, [type for _, type in places])
            return " = ".join([*(place for place, _ in places), text])
        (target,) = targets
        place, type = self.place(target)
        direct = operator in ("+", "-", "*", "/") and type == "num" and place == self._read(target)
        if direct:
            return f"{place} {operator}= {self.number(value).text}"
        return f"{place} = {self.stored(Binary(operator, target, value), [type])}"

    def _read(self, target: Expression) -> str:
        return self.number(target).text

    def stored(self, value: Expression, types: list[Type]) -> str:
        """A value for places of these types."""
        if all(type == "element" for type in types):
            pass
        first = types[0]
        if len(set(types)) > 1:
            raise refuse("an assignment to places of several types")
        match first:
            case "num":
                code = self.number(value)
                return floating(code).text if code.type != "num" else code.text
            case "nat" | "int":
                return self.integer(value)
            case _:
                code = self.value(value, single=first == "bool")
                if code.type != first:
                    raise refuse(f"{NAMED[code.type]} where {NAMED[first]} should be")
                return code.text

    def place(self, target: Expression) -> tuple[str, Type]:
        """What can be assigned to, with the type that it takes."""
        raise NotImplementedError
