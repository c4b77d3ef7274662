"""What lab code keeps in `ctx`: the fields and their types.

Entry point: `field_types(parameters, code)`.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Iterator, Mapping
from typing import assert_never

from coursebuild.labs.engine_names import ARRAYS
from coursebuild.labs.javascript_tree import (
    Array,
    Assign,
    Binary,
    Block,
    Boolean,
    Call,
    Conditional,
    Declare,
    Evaluate,
    Expression,
    For,
    If,
    Jump,
    Member,
    Name,
    Statement,
    String,
    Template,
    Unary,
    While,
)
from coursebuild.labs.python_values import NUMBERS, Type, refuse


def field_types(
    parameters: Mapping[str, Type], code: Iterable[tuple[tuple[Statement, ...], Type | None]]
) -> dict[str, Type]:
    """The fields of `ctx`: those of parameters, and those that statements assign to.

    `code` is all statements of a lab, each piece with the type of `value` in it. Where a type can
    only be guessed, translating the assignment tells whether the guess was right.
    """
    types = dict(parameters)
    for name in types:
        _check_field(name)
    for body, value in code:
        for name, assigned in _assigned(body):
            _check_field(name)
            found = "num" if assigned is None else _guess(assigned, value, types)
            if name not in types or (types[name] in NUMBERS and found in NUMBERS):
                types[name] = found if found not in NUMBERS else "num"
            if name not in parameters and types[name] == "str":
                raise refuse(f"the text `ctx.{name}`, which is not there from the start")
    return types


def _check_field(name: str) -> None:
    if keyword.iskeyword(name) or "$" in name or name.startswith("__"):
        raise refuse(f"the name `ctx.{name}`")


def _assigned(body: Iterable[Statement]) -> Iterator[tuple[str, Expression | None]]:
    """Fields with what is assigned to them; `None` where they count on."""
    for statement in body:
        match statement:
            case Assign(targets, operator, value):
                for target in targets:
                    if isinstance(target, Member) and target.whole == Name("ctx"):
                        yield target.name, value if operator == "" else None
            case If(_, then, otherwise):
                yield from _assigned((*then, *otherwise))
            case While(_, inner) | Block(inner) | For(_, _, _, _, _, inner):
                yield from _assigned(inner)
            case Declare() | Evaluate() | Jump():
                pass
            case _:
                assert_never(statement)


def _guess(value: Expression, given: Type | None, types: Mapping[str, Type]) -> Type:
    """The type of a value, as far as it can be told without knowing variables."""
    match value:
        case Boolean() | Unary("!", _):
            return "bool"
        case Binary("==" | "!=" | "===" | "!==" | "<" | ">" | "<=" | ">=" | "&&" | "||", _, _):
            return "bool"
        case String() | Template():
            return "str"
        case Array() | Call(Member(_, "slice" | "subarray"), _):
            return "vector"
        case Call(Member(Name("lib"), "momentum" | "angmom" | "sitePos" | "bodyPos"), _):
            return "vector"
        case Conditional(_, then, _):
            return _guess(then, given, types)
        case Member(Name("ctx"), name) if name in types:
            return types[name]
        case Member(Name(owner), name) if (owner, name) in ARRAYS:
            return "vector"
        case Name("value") if given is not None:
            return given
        case _:
            return "num"
