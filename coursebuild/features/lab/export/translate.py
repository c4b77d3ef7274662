"""Translates lab code from JavaScript to Python.

Entry points: `translate_statements`, `translate_expression`; `context_fields`, the fields of `ctx`.

Each construct becomes the plainest Python that does the same with the numbers of a simulation.
As JavaScript has no types, only a run shows whether a script does what the lab does; one that fails
or differs is not offered. Code without a counterpart is refused. Expressions are put together with
all parentheses; `ast.unparse` removes those that are not needed.
"""

from __future__ import annotations

import ast
import keyword
import textwrap
from collections.abc import Collection, Iterable, Iterator

from tree_sitter import Node

from coursebuild.features.lab.export.expressions import (
    ROOTS,
    Expressions,
    engine_field,
    operator_of,
    python_name,
)
from coursebuild.features.lab.javascript import (
    UntranslatableError,
    arguments,
    array_items,
    children,
    counting_loop,
    dotted_name,
    field,
    parse_expression,
    parse_statements,
    refusal,
    text_of,
    walk,
)

_AUGMENTED = ("+=", "-=", "*=", "/=", "**=", "&=", "|=", "^=")


def translate_statements(
    code: str, fields: Collection[str], value: str | None = None, *, button: bool = False
) -> list[str]:
    """Translate statements into lines; `value` is the expression that `value` stands for.

    In the code of a `button`, calls that only concern the page's clock are left out.

    Raises:
        UntranslatableError: they cannot be translated.
    """
    lines = _Statements(fields, value, button).block(parse_statements(code))
    return ast.unparse(ast.parse("\n".join(lines))).splitlines()


def translate_expression(code: str, fields: Collection[str]) -> str:
    """Translate an expression.

    Raises:
        UntranslatableError: it cannot be translated.
    """
    text = _Statements(fields, None, button=False).expression(parse_expression(code))
    return ast.unparse(ast.parse(text))


def context_fields(pieces: Iterable[str]) -> dict[str, str]:
    """Return the fields of `ctx` to which code assigns, with their initial values."""
    fields: dict[str, str] = {}
    statements = (statement for code in pieces for statement in parse_statements(code))
    for node in (node for statement in statements for node in walk(statement)):
        if node.type == "assignment_expression":
            match dotted_name(field(node, "left")):
                case ("ctx", name):
                    is_truth = field(node, "right").type in ("true", "false")
                    fields.setdefault(name, "False" if is_truth else "math.nan")
                case _:
                    pass
    for name in fields:
        if keyword.iskeyword(name) or name.startswith("__") or not name.isidentifier():
            raise UntranslatableError(f"the name `ctx.{name}`")
    return dict(sorted(fields.items()))


class _Statements(Expressions):
    """Translates a piece of code."""

    def block(self, body: Iterable[Node]) -> Iterator[str]:
        """Translate statements in a scope of their own."""
        self.scopes.append(set())
        for statement in body:
            yield from self.statement(statement)
        self.scopes.pop()

    def indented(self, body: Node) -> str:
        """Translate and indent the body of an `if` or a loop."""
        inner = children(body) if body.type == "statement_block" else [body]
        return textwrap.indent("\n".join(self.block(inner)) or "pass", "    ")

    def statement(self, node: Node) -> Iterator[str]:
        """Translate a statement into lines."""
        match node.type:
            case "empty_statement":
                pass
            case "expression_statement":
                for expression in _in_sequence(children(node)[0]):
                    yield from self.effect(expression)
            case "lexical_declaration":
                for declarator in children(node):
                    yield self.declaration(declarator)
            case "statement_block":
                yield from self.block(children(node))
            case "if_statement":
                yield f"if {self.part(node, 'condition')}:"
                yield self.indented(field(node, "consequence"))
                if (clause := node.child_by_field_name("alternative")) is not None:
                    yield "else:"
                    yield self.indented(children(clause)[0])
            case "while_statement":
                yield f"while {self.part(node, 'condition')}:"
                yield self.indented(field(node, "body"))
            case "for_statement":
                yield from self.loop(node)
            case "break_statement" | "continue_statement" if not children(node):
                yield node.type.removesuffix("_statement")
            case "return_statement" if not (children(node) or self.value):
                yield "return"
            case _:
                raise refusal(node)

    def declaration(self, node: Node) -> str:
        """Translate `name = value` of a `const` or `let`."""
        name, value = field(node, "name"), node.child_by_field_name("value")
        if name.type != "identifier" or value is None:
            raise UntranslatableError(f"`{text_of(node)}` without a value")
        text = self.part(node, "value")  # before its name is in scope
        return f"{self.declare(text_of(name))} = {text}"

    def declare(self, name: str) -> str:
        """Declare a variable, and return its name in Python, where blocks are no scopes."""
        variable = python_name(name)
        is_in_use = name in ROOTS or any(variable in scope for scope in self.scopes)
        if not variable.isidentifier() or is_in_use:
            raise UntranslatableError(f"a variable `{name}`")
        self.scopes[-1].add(variable)
        return variable

    def loop(self, node: Node) -> Iterator[str]:
        """Translate a loop that counts."""
        loop = counting_loop(node)
        limit = self.expression(loop.limit)
        if loop.inclusive:
            by = 1 if loop.step > 0 else -1
            limit = str(int(limit) + by) if limit.isdecimal() else f"{limit} + {by}"
        ends = [self.expression(loop.start), limit, str(loop.step)]
        if loop.step == 1:
            ends = ends[:2] if ends[0] != "0" else ends[1:2]
        self.scopes.append(set())
        name = self.declare(loop.name)
        self.counters.add(name)
        yield f"for {name} in range({', '.join(ends)}):"
        yield self.indented(field(node, "body"))
        self.scopes.pop()

    # --- effects

    def effect(self, node: Node) -> Iterator[str]:
        """Translate an expression that is used for its effect."""
        match node.type:
            case "assignment_expression":
                targets = []
                while node.type == "assignment_expression":
                    targets.append(self.target(field(node, "left")))
                    node = field(node, "right")
                yield " = ".join([*targets, self.expression(node)])
            case "augmented_assignment_expression":
                target, value = self.target(field(node, "left")), self.part(node, "right")
                operator = operator_of(node)
                if operator == "%=":
                    yield f"{target} = np.fmod({target}, {value})"
                elif operator in _AUGMENTED:
                    yield f"{target} {operator} {value}"
                else:
                    raise UntranslatableError(f"`{operator}`")
            case "update_expression":
                yield f"{self.target(field(node, 'argument'))} {operator_of(node)[0]}= 1"
            case "call_expression":
                yield from self.call_statement(node)
            case _:
                raise refusal(node)

    def target(self, node: Node) -> str:
        """Translate the target of an assignment."""
        match node.type:
            case "identifier" if self.is_variable(text_of(node)):
                return python_name(text_of(node))
            case "subscript_expression":
                return self.element(node)
            case "member_expression":
                path = dotted_name(node)
                if path[:1] == ("ctx",) or engine_field(path) == "number":
                    return self.member(node)
            case _:
                pass
        raise refusal(node, "an assignment to ")

    def call_statement(self, node: Node) -> Iterator[str]:
        """Translate a call that is used for its effect."""
        function, values = field(node, "function"), arguments(node)
        match dotted_name(function):
            case ("sim", "play" | "pause") if self.button:
                return
            case ("sim", "reset") if self.button:
                yield "reset(model, data, ctx)" if self.fields else "reset(model, data)"
                return
            case ("mj", _):
                yield self.call(node)
                return
            case _:
                pass
        match text_of(field(function, "property")) if "member" in function.type else "":
            case "fill" if len(values) in (1, 3):
                array, value = self.part(function, "object"), self.expression(values[0])
                yield f"{array}[{self.bounds(values[1:]) or ':'}] = {value}"
            case "set" if len(values) in (1, 2):
                yield self.set(self.part(function, "object"), *values)
            case _:
                raise refusal(function, "a call of ")

    def set(self, array: str, values: Node, offset: Node | None = None) -> str:
        """Translate `array.set(numbers, offset)`."""
        if values.type == "array":
            items = array_items(values)
            text, count = f"[{self.all(items)}]", str(len(items))
        else:
            text = self.expression(values)
            count = f"{text}.size"
        start = "0" if offset is None else self.index(offset)
        if start.isdecimal() and count.isdecimal():
            end = str(int(start) + int(count))
        else:
            end = count if start == "0" else f"{start} + {count}"
        return f"{array}[{'' if start == '0' else start}:{end}] = {text}"


def _in_sequence(node: Node) -> Iterator[Node]:
    """Yield the expressions of `a, b, c`."""
    if node.type == "sequence_expression":
        for child in children(node):
            yield from _in_sequence(child)
    else:
        yield node
