"""The part of JavaScript that lab code is mostly written in, as a syntax tree.

Entry points: the unions `Expression` and `Statement`. `javascript` makes them.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

from coursebuild.values import dataclass


@dataclass(frozen=True, slots=True)
class Number:
    """A number as it is written."""

    text: str


@dataclass(frozen=True, slots=True)
class String:
    """A text."""

    value: str


@dataclass(frozen=True, slots=True)
class Template:
    """Texts and expressions that become one text."""

    parts: tuple[str | Expression, ...]


@dataclass(frozen=True, slots=True)
class Boolean:
    """`true` or `false`."""

    value: bool


@dataclass(frozen=True, slots=True)
class Name:
    """A variable."""

    name: str


@dataclass(frozen=True, slots=True)
class Member:
    """`whole.name`."""

    whole: Expression
    name: str


@dataclass(frozen=True, slots=True)
class Index:
    """`whole[index]`."""

    whole: Expression
    index: Expression


@dataclass(frozen=True, slots=True)
class Spread:
    """`...value`, as an argument."""

    value: Expression


@dataclass(frozen=True, slots=True)
class Call:
    """`function(arguments)`."""

    function: Expression
    arguments: tuple[Expression | Spread, ...]


@dataclass(frozen=True, slots=True)
class Array:
    """`[items]`."""

    items: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Unary:
    """`-`, `+`, `!` or `~` before an operand."""

    operator: str
    operand: Expression


@dataclass(frozen=True, slots=True)
class Binary:
    """Two operands with an operator between them, `&&` and `||` included."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Conditional:
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


@dataclass(frozen=True, slots=True)
class Assign:
    """`a = b = value` (several targets only with `=`), `a += value`, `a++`."""

    targets: tuple[Expression, ...]
    operator: str
    """Without its `=`: empty, `+`, `**`, …"""
    value: Expression


@dataclass(frozen=True, slots=True)
class Declare:
    """`const name = value` or `let name = value`."""

    name: str
    value: Expression
    constant: bool


@dataclass(frozen=True, slots=True)
class Evaluate:
    """An expression for what it does."""

    expression: Expression


@dataclass(frozen=True, slots=True)
class If:
    """`if (test) then else otherwise`."""

    test: Expression
    then: tuple[Statement, ...]
    otherwise: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class While:
    """`while (test) body`."""

    test: Expression
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class For:
    """`for (let name = start; name < limit; name += step) body`."""

    name: str
    start: Expression
    operator: str
    limit: Expression
    step: int
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Block:
    """`{ body }`, a scope of its own."""

    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Jump:
    """A statement of one word."""

    word: Literal["break", "continue", "return"]


Statement: TypeAlias = Assign | Declare | Evaluate | If | While | For | Block | Jump
