"""The part of JavaScript that lab code is mostly written in, as a syntax tree.

Entry points: the unions `Expression` and `Statement`. `javascript` makes them.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

from msgspec import Struct


class Number(Struct, frozen=True):
    """A number as it is written."""

    text: str


class String(Struct, frozen=True):
    """A text."""

    value: str


class Template(Struct, frozen=True):
    """Texts and expressions that become one text."""

    parts: tuple[str | Expression, ...]


class Boolean(Struct, frozen=True):
    """`true` or `false`."""

    value: bool


class Name(Struct, frozen=True):
    """A variable."""

    name: str


class Member(Struct, frozen=True):
    """`whole.name`."""

    whole: Expression
    name: str


class Index(Struct, frozen=True):
    """`whole[index]`."""

    whole: Expression
    index: Expression


class Spread(Struct, frozen=True):
    """`...value`, as an argument."""

    value: Expression


class Call(Struct, frozen=True):
    """`function(arguments)`."""

    function: Expression
    arguments: tuple[Expression | Spread, ...]


class Array(Struct, frozen=True):
    """`[items]`."""

    items: tuple[Expression, ...]


class Unary(Struct, frozen=True):
    """`-`, `+`, `!` or `~` before an operand."""

    operator: str
    operand: Expression


class Binary(Struct, frozen=True):
    """Two operands with an operator between them, `&&` and `||` included."""

    operator: str
    left: Expression
    right: Expression


class Conditional(Struct, frozen=True):
    """`test ? then : otherwise`."""

    test: Expression
    then: Expression
    otherwise: Expression


Expression: TypeAlias = (
    Number
    | String
    | Template
    | Boolean
    | Name
    | Member
    | Index
    | Call
    | Array
    | Unary
    | Binary
    | Conditional
)


class Assign(Struct, frozen=True):
    """`a = b = value` (several targets only with `=`), `a += value`, `a++`."""

    targets: tuple[Expression, ...]
    operator: str
    """Without its `=`: empty, `+`, `**`, …"""
    value: Expression


class Declare(Struct, frozen=True):
    """`const name = value` or `let name = value`."""

    name: str
    value: Expression
    constant: bool


class Evaluate(Struct, frozen=True):
    """An expression for what it does."""

    expression: Expression


class If(Struct, frozen=True):
    """`if (test) then else otherwise`."""

    test: Expression
    then: tuple[Statement, ...]
    otherwise: tuple[Statement, ...]


class While(Struct, frozen=True):
    """`while (test) body`."""

    test: Expression
    body: tuple[Statement, ...]


class For(Struct, frozen=True):
    """`for (let name = start; name < limit; name += step) body`."""

    name: str
    start: Expression
    operator: str
    limit: Expression
    step: int
    body: tuple[Statement, ...]


class Block(Struct, frozen=True):
    """`{ body }`, a scope of its own."""

    body: tuple[Statement, ...]


class Jump(Struct, frozen=True):
    """A statement of one word."""

    word: Literal["break", "continue", "return"]


Statement: TypeAlias = Assign | Declare | Evaluate | If | While | For | Block | Jump
