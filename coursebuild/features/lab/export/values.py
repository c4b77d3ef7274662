"""Python expressions with their types, and arithmetic and texts as JavaScript has them.

Entry points: `Code`, `literal`, `as_float`, `arithmetic`, `join_texts`.

Numbers in JavaScript are doubles. In Python they are `int` only where they stay small and no zero
can be negative (`int`, and `nat` that is never below 0), so that indices read as they should;
everything else is a float, `num`.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild.features.lab.export.engine_names import Element
from coursebuild.features.lab.javascript import UntranslatableError

Type: TypeAlias = Literal["nat", "int", "num", "bool", "str", "vector", "rows", "energy", "nothing"]
"""Of a Python expression; `rows` is an array that has two dimensions there, and one in JavaScript.
"""
NUMBERS = ("nat", "int", "num")
ARRAYS = ("vector", "rows")

CONDITIONAL, OR, AND, NOT, COMPARISON, BITS, SUM, PRODUCT, SIGN, POWER, ATOM = range(11)
"""Precedence of Python's operators."""
_SMALL = 2**31


class Code(Struct, frozen=True):
    """A Python expression."""

    text: str
    type: Type
    precedence: int = ATOM
    element: Element = "f64"
    """What an array holds."""

    def within(self, precedence: int) -> str:
        """It as an operand of an operator of this precedence."""
        return self.text if self.precedence >= precedence else f"({self.text})"

    @property
    def whole(self) -> int:
        """The number that a literal is; 0 for any other expression."""
        return int(self.text, 0) if self.text[:1].isdigit() and self.type == "nat" else 0

    @property
    def flat(self) -> str:
        """An array that is indexed by one number, as in JavaScript."""
        return f"{self.text}.flat" if self.type == "rows" else self.text

    @property
    def flat_view(self) -> str:
        """An array of one dimension that can be cut and written to."""
        return f"{self.text}.reshape(-1)" if self.type == "rows" else self.text

    @property
    def is_copy(self) -> bool:
        """Whether an array was just made."""
        return "(" in self.text

    @property
    def named(self) -> str:
        """What it is, in words."""
        return NAMED[self.type]


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
    plain = text.replace("_", "").lower()
    if plain.endswith("n") or re.match("0[0-9]", plain) or len(plain) > 300:
        raise UntranslatableError(f"the number `{text}`")
    if plain[:2] in ("0x", "0o", "0b") or plain.isdecimal():
        whole = int(plain, 0)
        if whole < _SMALL:
            return Code(plain, "nat")
        plain = str(whole)
    value = float(plain)
    if math.isinf(value):
        raise UntranslatableError(f"the number `{text}`")
    if plain.startswith("."):
        plain = f"0{plain}"
    same = plain[-1].isdecimal() and ("." in plain or "e" in plain) and ".e" not in plain
    return Code(plain if same else repr(value), "num")


def as_float(code: Code) -> Code:
    """A number as a float."""
    if code.type == "num":
        return code
    if code.text.isdecimal():
        return Code(f"{code.text}.0", "num")
    if code.text.startswith("-") and code.text[1:].isdecimal():
        return Code(f"{code.text}.0", "num", SIGN)
    return Code(f"float({code.text})", "num")


def arithmetic(operator: str, a: Code, b: Code) -> Code:
    """`+`, `-`, `*` and `/` of numbers."""
    precedence = SUM if operator in "+-" else PRODUCT
    whole, natural = "num" not in (a.type, b.type), a.type == b.type == "nat"
    type: Type = "num"
    if natural and operator in "+*":
        type = "nat"
    elif whole and operator in "+-":
        type = "int"
    elif whole and operator == "*":  # a zero may be negative
        a = as_float(a)
    return Code(f"{a.within(precedence)} {operator} {b.within(precedence + 1)}", type, precedence)


def text_literal(text: str) -> Code:
    """A text of JavaScript."""
    return Code(json.dumps(text, ensure_ascii=False), "str")


def join_texts(parts: Sequence[Code]) -> Code:
    """Values put together to one text, as in `` `x = ${x}` ``."""
    texts = [_written(part) for part in parts]
    if len(texts) < 2:
        return texts[0] if texts else Code('""', "str")
    return Code(" + ".join(text.within(SUM) for text in texts), "str", SUM)


def _written(code: Code) -> Code:
    """A value as JavaScript writes it into a text."""
    match code.type:
        case "str":
            return code
        case "bool":
            return Code(f'"true" if {code.within(OR)} else "false"', "str", CONDITIONAL)
        case "nat" | "int":
            return Code(f"str({code.text})", "str")
        case "num":
            return Code(f"numeral({code.text})", "str")
        case _:
            raise UntranslatableError(f"{code.named} in a text")
