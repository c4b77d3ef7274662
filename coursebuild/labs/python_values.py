"""Python expressions with their types, and arithmetic with them as JavaScript does it.

Entry points: `Code`, `literal`, `arithmetic`, `floating`.

Numbers in JavaScript are doubles. In Python they are `int` only where they stay small and no zero
can be negative (`int`, and `nat` that is never below 0), so that indices read as they should;
everything else is a float, `num`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal, TypeAlias

from msgspec import Struct, field

from coursebuild.labs.engine_names import Element
from coursebuild.labs.javascript_tokens import UntranslatableError

Type: TypeAlias = Literal["nat", "int", "num", "bool", "str", "vector", "rows", "energy", "nothing"]
"""Of a Python expression; `rows` is an array that has two dimensions there, and one in JavaScript.
"""
NUMBERS = ("nat", "int", "num")

CONDITIONAL, OR, AND, NOT, COMPARISON, BITS, SUM, PRODUCT, SIGN, POWER, ATOM = range(11)
"""How strongly Python's operators bind."""
_EXACT = 2.0**53
SMALL = 2.0**31


class Code(Struct, frozen=True):
    """A Python expression."""

    text: str
    type: Type
    strength: int = ATOM
    bound: float = SMALL
    """A `nat` or `int` is at most so far from 0."""
    element: Element = "f64"
    """What an array holds."""

    def within(self, strength: int) -> str:
        """It as an operand of an operator that binds so strongly."""
        return self.text if self.strength >= strength else f"({self.text})"


class Used(Struct):
    """What the code that was translated needs."""

    helpers: set[str] = field(default_factory=set)
    modules: set[str] = field(default_factory=set)
    resets: bool = False
    """Whether the function `reset` is called."""
    exact: bool = True
    """Whether no function is involved whose last bit may differ from one library to another."""


class Variable(Struct, frozen=True):
    """A variable of the code: what it is called in Python, and its type."""

    code: Code
    constant: bool = True


class Names(Struct, frozen=True):
    """What the code may refer to besides the engine."""

    context: Mapping[str, Type]
    """The fields of `ctx`."""
    value: Code | None
    """What `value` stands for."""


NAMED: dict[Type, str] = {
    "nat": "a number",
    "int": "a number",
    "num": "a number",
    "bool": "a truth value",
    "str": "a text",
    "vector": "an array",
    "rows": "an array",
    "energy": "an object",
    "nothing": "nothing",
}


def literal(text: str) -> Code:
    """A number of JavaScript, as it is written."""
    plain = text.replace("_", "")
    if plain[:2].lower() in ("0x", "0o", "0b"):
        whole = int(plain, 0)
        if whole >= SMALL:
            return Code(repr(float(whole)), "num")
        return Code(plain.lower(), "nat", bound=float(whole))
    if plain.isdecimal() and float(plain) < SMALL:
        return Code(plain, "nat", bound=float(plain))
    value = float(plain)
    if math.isinf(value):
        raise refuse(f"the number `{text}`")
    if plain.startswith("."):
        plain = f"0{plain}"
    same = plain[-1].isdecimal() and ("." in plain or "e" in plain) and ".e" not in plain
    return Code(plain if same else repr(value), "num")


def floating(code: Code) -> Code:
    """The number as a float."""
    if code.type == "num":
        return code
    if code.text.isdecimal():
        return Code(f"{code.text}.0", "num")
    if code.text.startswith("-") and code.text[1:].isdecimal():
        return Code(f"{code.text}.0", "num", SIGN)
    return Code(f"float({code.text})", "num")


def arithmetic(operator: str, a: Code, b: Code) -> Code:
    """`+`, `-`, `*` and `/` of numbers."""
    strength = SUM if operator in "+-" else PRODUCT
    whole = "num" not in (a.type, b.type)
    type: Type = "num"
    bound = SMALL
    if whole and operator in "+-":
        bound = a.bound + b.bound
        type = "nat" if a.type == b.type == "nat" and operator == "+" else "int"
    elif a.type == b.type == "nat" and operator == "*":
        bound = a.bound * b.bound
        type = "nat"
    if type != "num" and bound >= _EXACT:
        type = "num"
    if whole and type == "num" and operator != "/":
        a = floating(a)
    text = f"{a.within(strength)} {operator} {b.within(strength + 1)}"
    return Code(text, type, strength, bound)


def refuse(what: str) -> UntranslatableError:
    """Why something is not translated."""
    return UntranslatableError(what)
