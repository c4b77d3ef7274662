"""Statements of lab code, from JavaScript to Python.

Each construct becomes the plainest Python that does the same with the numbers of a simulation.
As JavaScript has no types, only a run shows whether a script does what the lab does. Expressions
are put together with all parentheses; `ast.unparse` removes those that are not needed.
"""

from __future__ import annotations

import ast
import keyword
import textwrap
from collections.abc import Collection, Iterable, Iterator

from tree_sitter import Node

from coursebuild.features.lab import javascript as js
from coursebuild.features.lab.engines.native import EngineDescription
from coursebuild.features.lab.export import expressions

_AUGMENTED = ("+=", "-=", "*=", "/=", "**=", "&=", "|=", "^=")


def translate_statements(
    engine: EngineDescription,
    code: str,
    fields: Collection[str],
    value: str | None = None,
    *,
    button: bool = False,
) -> list[str]:
    """Translate statements into lines; `value` is the expression that `value` stands for.

    In the code of a `button`, calls that only concern the page's clock are left out.
    """
    lines = _Statements(engine, fields, value, button).block(js.parse_statements(code))
    return ast.unparse(ast.parse("\n".join(lines), "")).splitlines()


def translate_expression(
    engine: EngineDescription, code: str, fields: Collection[str], variables: Iterable[str] = ()
) -> str:
    """Translate an expression, in which there may be `variables`."""
    translator = _Statements(engine, fields, None, button=False)
    translator.scopes.append(set(map(expressions.python_name, variables)))
    return ast.unparse(ast.parse(translator.expression(js.parse_expression(code)), ""))


def context_fields(pieces: Iterable[str]) -> dict[str, str]:
    """Return the fields of `ctx` to which code assigns, with their initial values."""
    fields: dict[str, str] = {}
    statements = (statement for code in pieces for statement in js.parse_statements(code))
    for node in (node for statement in statements for node in js.walk(statement)):
        is_augmented = node.type == "augmented_assignment_expression"
        is_default = is_augmented and expressions.operator_of(node) == "??="
        if node.type == "assignment_expression" or is_default:
            match js.dotted_name(js.field(node, "left")):
                case ("ctx", name):
                    is_truth = js.field(node, "right").type in ("true", "false")
                    fields.setdefault(name, "False" if is_truth else "math.nan")
                case _:
                    pass
    for name in fields:
        if keyword.iskeyword(name) or name.startswith("__") or not name.isidentifier():
            raise js.UntranslatableError(f"the name `ctx.{name}`")
    return dict(sorted(fields.items()))


class _Statements(expressions.Expressions):
    depths: tuple[int, ...] = ()
    """How many scopes lie around each function that is being translated."""
    outer: frozenset[str] = frozenset()
    """The variables of other functions to which the innermost one assigns."""

    def block(self, body: Iterable[Node]) -> Iterator[str]:
        self.scopes.append(set())
        for statement in body:
            yield from self.statement(statement)
        self.scopes.pop()

    def indented(self, body: Node) -> str:
        inner = js.children(body) if body.type == "statement_block" else [body]
        return textwrap.indent("\n".join(self.block(inner)) or "pass", "    ")

    def statement(self, node: Node) -> Iterator[str]:
        match node.type:
            case "empty_statement":
                pass
            case "expression_statement":
                for expression in _in_sequence(js.children(node)[0]):
                    yield from self.effect(expression)
            case "lexical_declaration":
                for declarator in js.children(node):
                    yield from self.declaration(declarator)
            case "statement_block":
                yield from self.block(js.children(node))
            case "if_statement":
                yield f"if {self.part(node, 'condition')}:"
                yield self.indented(js.field(node, "consequence"))
                if (clause := node.child_by_field_name("alternative")) is not None:
                    yield "else:"
                    yield self.indented(js.children(clause)[0])
            case "while_statement":
                yield f"while {self.part(node, 'condition')}:"
                yield self.indented(js.field(node, "body"))
            case "for_statement":
                yield from self.loop(node)
            case "break_statement" | "continue_statement" if not js.children(node):
                yield node.type.removesuffix("_statement")
            case "return_statement" if self.depths and js.children(node):
                yield f"return {self.expression(js.children(node)[0])}"
            case "return_statement" if not (js.children(node) or self.value):
                yield "return"
            case _:
                raise js.refusal(node)

    def declaration(self, node: Node) -> Iterator[str]:
        name, value = js.field(node, "name"), node.child_by_field_name("value")
        if value is None or name.type not in ("identifier", "array_pattern"):
            raise js.UntranslatableError(f"`{js.text_of(node)}` without a value")
        if name.type == "identifier" and value.type == "arrow_function":
            yield from self.definition(self.declare(js.text_of(name)), value)
            return
        text = self.part(node, "value")  # before its name is in scope
        if name.type == "identifier":
            yield f"{self.declare(js.text_of(name))} = {text}"
            return
        names = js.pattern_items(name)
        targets = [name if name == "_" else self.declare(name) for name in names]
        yield f"{', '.join(targets)}, = {text}[:{len(names)}]"

    def definition(self, name: str, node: Node) -> Iterator[str]:
        """Translate an arrow function that gets a name."""
        depths, outer, body = self.depths, self.outer, js.field(node, "body")
        self.depths, self.outer = (*depths, len(self.scopes)), frozenset()
        with self.function(node) as parameters:
            if body.type == "statement_block":
                lines = self.indented(body)
            else:
                lines = f"    return {self.expression(body)}"
        yield f"def {name}({', '.join(parameters)}):"
        if self.outer:
            yield f"    nonlocal {', '.join(sorted(self.outer))}"
        yield lines
        self.depths, self.outer = depths, outer

    def declare(self, name: str) -> str:
        """Declare a variable, and return its name in Python, where blocks are no scopes."""
        variable = expressions.python_name(name)
        is_in_use = name in expressions.ROOTS or any(
            variable in scope for scope in self.scopes[sum(self.depths[-1:]) :]
        )
        if not variable.isidentifier() or is_in_use:
            raise js.UntranslatableError(f"a variable `{name}`")
        self.scopes[-1].add(variable)
        return variable

    def loop(self, node: Node) -> Iterator[str]:
        loop = js.counting_loop(node)
        limit = self.expression(loop.limit)
        if not self.is_whole(loop.limit):
            limit = f"math.{'ceil' if (loop.step > 0) != loop.inclusive else 'floor'}({limit})"
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
        yield self.indented(js.field(node, "body"))
        self.scopes.pop()

    # --- effects

    def effect(self, node: Node) -> Iterator[str]:
        match node.type:
            case "assignment_expression" if js.field(node, "right").type == "arrow_function":
                path = js.dotted_name(js.field(node, "left"))
                if not self.is_field(path):
                    raise js.refusal(node)
                is_taken = self.is_variable(path[1])
                function = self.declare(f"{path[1]}_" if is_taken else path[1])
                yield from self.definition(function, js.field(node, "right"))
                yield f"ctx.{path[1]} = {function}"
            case "assignment_expression":
                targets = []
                while node.type == "assignment_expression":
                    targets.append(self.target(js.field(node, "left")))
                    node = js.field(node, "right")
                yield " = ".join([*targets, self.expression(node)])
            case "augmented_assignment_expression":
                target, value = self.target(js.field(node, "left")), self.part(node, "right")
                operator = expressions.operator_of(node)
                if operator == "??=":
                    yield f"if missing({target}):\n    {target} = {value}"
                elif operator == "%=":
                    yield f"{target} = np.fmod({target}, {value})"
                elif operator in _AUGMENTED:
                    yield f"{target} {operator} {value}"
                else:
                    raise js.UntranslatableError(f"`{operator}`")
            case "update_expression":
                target = self.target(js.field(node, "argument"))
                sign = expressions.operator_of(node)[0]
                yield f"{target} {sign}= 1"
            case "call_expression":
                yield from self.call_statement(node)
            case _:
                raise js.refusal(node)

    def target(self, node: Node) -> str:
        match node.type:
            case "identifier" if self.is_variable(js.text_of(node)):
                name = expressions.python_name(js.text_of(node))
                if self.depths and not any(name in s for s in self.scopes[self.depths[-1] :]):
                    self.outer |= {name}
                return name
            case "subscript_expression":
                return self.element(node)
            case "member_expression":
                path = js.dotted_name(node)
                if path[:1] == ("ctx",) or self.kind(path) == "number":
                    return self.member(node)
            case _:
                pass
        raise js.refusal(node, "an assignment to ")

    def call_statement(self, node: Node) -> Iterator[str]:
        function, values = js.field(node, "function"), js.arguments(node)
        match js.dotted_name(function):
            case ("sim", "play" | "pause") if self.button:
                return
            case ("sim", "reset") if self.button:
                yield "reset(model, data, ctx)" if self.fields else "reset(model, data)"
                return
            case ("mj", _):
                yield self.call(node)
                return
            case path if self.is_function(path):
                yield self.call(node)
                return
            case _:
                pass
        match js.text_of(js.field(function, "property")) if "member" in function.type else "":
            case "fill" if len(values) in (1, 3):
                array, value = self.part(function, "object"), self.expression(values[0])
                yield f"{array}[{self.bounds(values[1:]) or ':'}] = {value}"
            case "forEach" if len(values) == 1 and values[0].type == "arrow_function":
                yield from self.item_loop(self.part(function, "object"), values[0])
            case "set" if len(values) in (1, 2):
                yield self.set(self.part(function, "object"), *values)
            case _:
                raise js.refusal(function, "a call of ")

    def item_loop(self, items: str, node: Node) -> Iterator[str]:
        """Translate what is done with each item of an array."""
        body = js.field(node, "body")
        if any(inner.type == "return_statement" for inner in js.walk(body)):
            raise js.refusal(node)
        parameters = js.parameters(node)
        self.scopes.append(set())
        names = [self.declare(name) for name in parameters]
        self.counters |= set(names[1:])
        yield f"{self.loop_over(names, items)}:"
        if body.type == "statement_block":
            yield self.indented(body)
        else:
            yield textwrap.indent("\n".join(self.effect(body)), "    ")
        self.scopes.pop()

    def set(self, array: str, values: Node, offset: Node | None = None) -> str:
        items = js.array_items(values) if values.type == "array" else []
        if items and all(item.type != "spread_element" for item in items):
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
    if node.type == "sequence_expression":
        for child in js.children(node):
            yield from _in_sequence(child)
    else:
        yield node
