"""Expressions of labs without an engine: text → a program that Python and the page both run.

An expression is written as in Python, so that it can go from a script into a lab and back. Python's
own parser reads it; what it may hold is decided here, and nothing is ever evaluated as code. A
program is in postfix order, as JSON has it: a number is pushed; `[slot]` pushes a value of the
environment; a text names an operation, which takes its arguments from the stack.
"""

from __future__ import annotations

import ast
import math
import unicodedata
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias, TypeVar

from coursebuild.api import Diagnostic, Excerpt, Fix, Parsed, diagnose, did_you_mean

Program: TypeAlias = list[float | str | list[int]]
T = TypeVar("T")

LONGEST = 1000
"""Characters of an expression."""
_UNARY = (
    "sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp log log2 log10 sqrt cbrt abs"
    " sign floor ceil"
).split()
ARITIES = dict.fromkeys(_UNARY, 1) | dict.fromkeys(("atan2", "hypot", "min", "max"), 2)
CONSTANTS: dict[str, float | str] = {"pi": math.pi, "nan": "nan"}
_OPERATORS: dict[type[ast.AST], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**", ast.Mod: "%",
    ast.USub: "neg", ast.Not: "not", ast.And: "and", ast.Or: "or",
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
_DIRECTIONS = {"<": -1, "<=": -1, ">": 1, ">=": 1, "==": 0}
_HELP: dict[type[ast.AST], str] = {
    ast.BitXor: Fix("a power is `a**b`", "**", "^", safe=True),
    ast.FloorDiv: "write `floor(a/b)`",
    ast.Attribute: "write the function by its own name: `sin(x)`",
}


class _MistakeError(Exception):
    def __init__(self, node: ast.expr, message: str, help: str = "", rule: str = "lab-code"):
        super().__init__(message)
        self.node, self.message, self.help, self.rule = node, message, help, rule


def compile_formula(text: Excerpt, names: Mapping[str, int]) -> Parsed[Program | None]:
    """Compile an expression over names, each with its slot in the environment. Never raises."""

    def compile_tree(tree: ast.expr) -> Program:
        program: Program = []
        _emit(tree, names, program)
        return program

    return _compile(text, compile_tree)


def compile_condition(
    text: Excerpt, names: Mapping[str, int]
) -> Parsed[tuple[Program, int] | None]:
    """Compile a comparison: the difference of its sides, and the direction in which it passes 0."""

    def compile_tree(tree: ast.expr) -> tuple[Program, int]:
        match tree:
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                sign = _OPERATORS.get(type(op), "")
                if sign in _DIRECTIONS:
                    program: Program = []
                    for side in (left, right):
                        _emit(side, names, program)
                    return [*program, "-"], _DIRECTIONS[sign]
            case _:
                pass
        raise _MistakeError(tree, "an event is one comparison", "write it as in `height < 0`")

    return _compile(text, compile_tree)


def _compile(text: Excerpt, compile_tree: Callable[[ast.expr], T]) -> Parsed[T | None]:
    tree = _parse(text)
    if isinstance(tree, Diagnostic):
        return Parsed(None, (tree,))
    try:
        return Parsed(compile_tree(tree))
    except _MistakeError as mistake:
        # The place of its node is in bytes of the stripped line.
        line, node = text.text.replace("\n", " ").replace("\r", " "), mistake.node
        start = len(line) - len(line.lstrip())
        data = line[start:].encode("utf-8", "replace")
        ends = (node.col_offset, node.end_col_offset or node.col_offset)
        first, last = (start + len(data[:at].decode("utf-8", "replace")) for at in ends)
        place = text.span(first, last)
        return Parsed(None, (diagnose(mistake.rule, place, mistake.message, help=mistake.help),))
    except RecursionError:
        return Parsed(None, (diagnose("lab-code", text.span(), "the expression nests too deep"),))


def _parse(text: Excerpt) -> ast.expr | Diagnostic:
    if len(text.text) > LONGEST:
        message = f"the expression has {len(text.text)} characters, {LONGEST} at most can be read"
        return diagnose("lab-code", text.span(), message, help="name parts of it in `where`")
    line = text.text.replace("\n", " ").replace("\r", " ").replace("#", "\x00")
    start = len(line) - len(line.lstrip())
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(line[start:].rstrip(), mode="eval").body
    except SyntaxError as error:
        at = min(start + max((error.offset or 1) - 1, 0), max(len(text.text) - 1, 0))
        reason = (error.msg or "").partition(". ")[0].removeprefix("invalid syntax")
        reason = reason[:1].lower() + reason[1:]
        message = f"the expression cannot be read{': ' if reason else ' here'}{reason}"
        help = "an expression is written as in Python: `2*sin(x)**2`, `a if x > 0 else b`"
        return diagnose("lab-code", text.span(at, at + 1), message, help=help)
    except (ValueError, RecursionError, MemoryError):
        return diagnose("lab-code", text.span(), "the expression cannot be read")


def _emit(node: ast.expr, names: Mapping[str, int], program: Program) -> None:
    parts: Sequence[ast.expr]
    match node:
        case ast.Constant(value=bool() as truth):
            raise _MistakeError(node, f"`{truth}` is no number", "write `1` or `0`")
        case ast.Constant(value=int() | float() as number):
            try:
                value = float(number)
            except OverflowError:
                value = math.inf
            if math.isinf(value):
                raise _MistakeError(node, "the number is too large")
            program.append(value)
            return
        case ast.Name(id=name) if name in names:
            program.append([names[name]])
            return
        case ast.Name(id=name) if name in CONSTANTS:
            program.append(CONSTANTS[name])
            return
        case ast.Name(id=name):
            if name in ARITIES:
                raise _MistakeError(node, f"`{name}` is a function", f"write `{name}(…)`")
            message = f"there is no `{name}` in this lab"
            help = did_you_mean(name, [*names, *CONSTANTS])
            raise _MistakeError(node, message, help, "lab-name")
        case ast.UnaryOp(op=ast.UAdd(), operand=inner):
            _emit(inner, names, program)
            return
        case ast.UnaryOp(op=op, operand=inner) if type(op) in _OPERATORS:
            parts, operations = (inner,), [_OPERATORS[type(op)]]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            parts, operations = (left, right), [_OPERATORS[type(op)]]
        case ast.BinOp(op=op):
            raise _MistakeError(node, "the sign has no meaning here", _HELP.get(type(op), ""))
        case ast.BoolOp(op=op, values=parts):
            operations = [_OPERATORS[type(op)]] * (len(parts) - 1)
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _OPERATORS:
            parts, operations = (left, right), [_OPERATORS[type(op)]]
        case ast.Compare():
            help = "join comparisons of two sides by `and`"
            raise _MistakeError(node, "the comparison has no meaning here", help)
        case ast.IfExp(test=test, body=body, orelse=alternative):
            parts, operations = (test, body, alternative), ["if"]
        case ast.Call(func=ast.Name(id=name), args=parts, keywords=[]):
            operations = _call(node, name, len(parts))
        case _:
            kind = type(node.func) if isinstance(node, ast.Call) else type(node)
            raise _MistakeError(node, "this has no meaning in an expression", _HELP.get(kind, ""))
    for part in parts:
        _emit(part, names, program)
    program.extend(operations)


def _call(node: ast.Call, name: str, count: int) -> list[str]:
    """Return the operations of a call, by which its arguments become one value."""
    if name not in ARITIES:
        help = did_you_mean(name, ARITIES)
        raise _MistakeError(node.func, f"there is no function `{name}`", help, "lab-name")
    if name in ("min", "max") and count >= 2:
        return [name] * (count - 1)
    if count != ARITIES[name]:
        message = f"`{name}` takes {ARITIES[name]} values, and has {count}"
        raise _MistakeError(node, message.replace("1 values", "1 value"))
    return [name]


def normalise_name(name: str) -> str:
    """A name as Python's parser gives it."""
    return unicodedata.normalize("NFKC", name)
