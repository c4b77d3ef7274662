"""Pieces of lab code as Python.

Entry points: `translate_statements`, `translate_expression`; `field_types`, what `ctx` holds.

A piece becomes the lines of a function's body. Whether it may stand among other lines is said with
it: one that has variables of its own needs a function of its own.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Iterator, Mapping

from msgspec import Struct
from tree_sitter import Node

from coursebuild.features.lab.export.calls import Calls, check_single, refused_call
from coursebuild.features.lab.export.engine_names import CALLS, ArrayField, engine_field
from coursebuild.features.lab.export.expressions import Variable
from coursebuild.features.lab.export.library import RESERVED
from coursebuild.features.lab.export.values import NUMBERS, Code, Type, as_float
from coursebuild.features.lab.javascript import (
    UntranslatableError,
    arguments,
    array_items,
    children,
    counting_loop,
    field,
    parse_expression,
    parse_statements,
    text_of,
)

_INDENT = "    "
_NAME = re.compile(r"[A-Za-z_$][A-Za-z0-9_$]*")
_JAVASCRIPT_NAMES = frozenset("model data mj sim ctx lib Math value arguments eval".split())
_COMPOUND = ("+", "-", "*", "/")


class Translation(Struct, frozen=True):
    """A piece of code in Python."""

    lines: tuple[str, ...]
    has_variables: bool = False
    """Whether it needs a function of its own."""
    returns: bool = False
    """Whether it may end before its last line."""


def translate_statements(
    code: str, context: Mapping[str, Type], value: Code | None = None, *, button: bool = False
) -> Translation:
    """Statements; `value`: what `value` stands for in them.

    In the code of a `button` what only concerns the page's clock is left out.

    Raises:
        UntranslatableError: they cannot be translated.
    """
    writer = _Statements(context, value, button)
    lines = tuple(writer.block(parse_statements(code)))
    return Translation(lines, bool(writer.taken), writer.returns)


def translate_expression(code: str, context: Mapping[str, Type]) -> Code:
    """An expression that gives a number or a text.

    Raises:
        UntranslatableError: it cannot be translated, or gives something else.
    """
    found = _Statements(context, None, button=False).shown(parse_expression(code))
    if found.type not in (*NUMBERS, "str"):
        raise UntranslatableError(f"{found.named} where a number or a text should be")
    return found


def field_types(
    parameters: Mapping[str, Type], pieces: Iterable[tuple[str, Code | None]]
) -> dict[str, Type]:
    """The fields of `ctx`: those of parameters, and those that statements assign to.

    `pieces` are all statements of a lab, each with what `value` stands for. They are translated
    until nothing more is learned from it: what a field holds may depend on another.
    """
    types, before, pieces = dict(parameters), None, tuple(pieces)
    while types != before:
        before = dict(types)
        for code, value in pieces:
            learner = _Statements(types, value, button=True, learned=types)
            tuple(learner.block(parse_statements(code)))
    for name, type in types.items():
        if keyword.iskeyword(name) or name.startswith("__") or not name.isidentifier():
            raise UntranslatableError(f"the name `ctx.{name}`")
        if type == "str" and name not in parameters:
            raise UntranslatableError(f"the text `ctx.{name}`, which is not there at the start")
    return types


class _Place(Struct, frozen=True):
    """What can be assigned to."""

    text: str
    takes: str
    """`number` of any type, `float`, `whole`, or another type of value."""
    direct: bool = False
    """Whether `+=` does there what it does in JavaScript."""


class _Statements(Calls):
    """Translates statements; into `learned` it notes types of fields, and passes over mistakes."""

    def __init__(
        self,
        context: Mapping[str, Type],
        value: Code | None,
        button: bool,
        learned: dict[str, Type] | None = None,
    ) -> None:
        super().__init__(context, value)
        self.button = button
        self.learned = learned
        self.taken: set[str] = set()
        self.returns = False

    def shown(self, node: Node) -> Code:
        """What a readout shows; `null`, where there is nothing to be shown, is no number."""
        if node.type == "null":
            return Code("math.nan", "num")
        if node.type != "ternary_expression":
            return self.value(node, single=True)
        branches = (field(node, name) for name in ("consequence", "alternative"))
        return self.conditional(field(node, "condition"), *map(self.shown, branches))

    def block(self, body: Iterable[Node]) -> Iterator[str]:
        """Statements in a scope of their own."""
        self.scopes.append({})
        for statement in body:
            try:
                yield from self.statement(statement)
            except UntranslatableError:
                if self.learned is None:
                    raise
        self.scopes.pop()

    def learn(self, target: Node, value: Node | None) -> None:
        """Note what is assigned to a field of `ctx`; without a value it is a number."""
        path = self.path(target)
        if self.learned is None or len(path) != 2 or path[0] != "ctx":
            return
        found = "num" if value is None else self.value(value, single=True).type
        old = self.learned.get(path[1], found)
        self.learned[path[1]] = "num" if {old, found} <= {*NUMBERS} else old

    def indented(self, body: Node) -> list[str]:
        """The body of an `if` or a loop."""
        inner = children(body) if body.type == "statement_block" else [body]
        return [_INDENT + line for line in self.block(inner)] or [_INDENT + "pass"]

    def statement(self, node: Node) -> Iterator[str]:
        """The lines of a statement."""
        match node.type:
            case "empty_statement":
                pass
            case "expression_statement":
                for expression in _in_sequence(children(node)[0]):
                    yield from self.effect(expression)
            case "lexical_declaration":
                constant = text_of(field(node, "kind")) == "const"
                for declarator in children(node):
                    yield self.declaration(declarator, constant)
            case "statement_block":
                yield from self.block(children(node))
            case "if_statement":
                yield from self.condition(node)
            case "while_statement":
                yield f"while {self.test(field(node, 'condition')).text}:"
                yield from self.indented(field(node, "body"))
            case "for_statement":
                yield from self.loop(node)
            case "break_statement" | "continue_statement" | "return_statement" if not children(
                node
            ):
                word = node.type.removesuffix("_statement")
                self.returns = self.returns or word == "return"
                yield word
            case _:
                raise UntranslatableError(f"`{text_of(node).splitlines()[0]}`")

    def condition(self, node: Node) -> Iterator[str]:
        """An `if` with its `else`."""
        yield f"if {self.test(field(node, 'condition')).text}:"
        yield from self.indented(field(node, "consequence"))
        clause = node.child_by_field_name("alternative")
        if clause is None:
            return
        (otherwise,) = children(clause)
        if otherwise.type == "if_statement":
            first, *rest = self.statement(otherwise)
            yield f"el{first}"
            yield from rest
        else:
            yield "else:"
            yield from self.indented(otherwise)

    # --- variables

    def declare(self, name: str, code: Code, constant: bool) -> str:
        """A variable of the innermost scope; its name in Python, where scopes are not nested."""
        if name in _JAVASCRIPT_NAMES or name in self.scopes[-1] or not _NAME.fullmatch(name):
            raise UntranslatableError(f"a variable `{name}`")
        own = name.strip("$").replace("$", "_") or "x"
        # The constants of a script are in capitals.
        while own in RESERVED or own in self.taken or own.startswith("__") or _is_capitals(own):
            own = f"{own.lstrip('_')}_"
        self.taken.add(own)
        self.scopes[-1][name] = Variable(Code(own, code.type, element=code.element), constant)
        return own

    def declaration(self, node: Node, constant: bool) -> str:
        """`name = value` of a `const` or `let`."""
        name, given = field(node, "name"), node.child_by_field_name("value")
        if name.type != "identifier" or given is None:
            raise UntranslatableError(f"`{text_of(node)}` without a value")
        code = self.value(field(node, "value"), single=True)
        if code.type in ("nothing", "rows"):
            raise UntranslatableError(f"{code.named} in a variable")
        if not constant and code.type in NUMBERS:
            code = as_float(code)
        return f"{self.declare(text_of(name), code, constant)} = {code.text}"

    # --- assignments

    def effect(self, node: Node) -> Iterator[str]:
        """An expression for what it does."""
        match node.type:
            case "assignment_expression":
                yield self.assignment(node)
            case "augmented_assignment_expression":
                operator = text_of(field(node, "operator")).removesuffix("=")
                yield self.compound(field(node, "left"), operator, field(node, "right"))
            case "update_expression":
                operator = text_of(field(node, "operator"))[0]
                yield self.compound(field(node, "argument"), operator, None)
            case "call_expression":
                yield from self.call_statement(node)
            case _:
                raise UntranslatableError("an expression that does nothing")

    def assignment(self, node: Node) -> str:
        """`a = b = value`."""
        targets = []
        while node.type == "assignment_expression":
            targets.append(field(node, "left"))
            node = field(node, "right")
        for target in targets:
            self.learn(target, node)
        places = [self.place(target) for target in targets]
        takes = {place.takes for place in places}
        if takes == {"number", "float"}:
            takes = {"float"}
        if len(takes) > 1:
            raise UntranslatableError("an assignment to places of several types")
        value = self.value(node, single=takes != {"vector"})
        return " = ".join([*(place.text for place in places), self.stored(value, takes.pop())])

    def compound(self, target: Node, operator: str, value: Node | None) -> str:
        """`target += value` and its like; without a value it is 1."""
        self.learn(target, None)
        place = self.place(target)
        if operator in _COMPOUND and place.direct:
            return f"{place.text} {operator}= {self.number(value).text if value else '1'}"
        if value is None:
            result = self.binary(operator, target, parse_expression("1"))
        else:
            result = self.binary(operator, target, value)
        return f"{place.text} = {self.stored(result, place.takes)}"

    def stored(self, code: Code, takes: str) -> str:
        """A value for a place."""
        number = code.type in NUMBERS
        if takes == "float" and number:
            return as_float(code).text
        if takes == "whole" and code.type == "num":
            return f"int({code.text})"
        if takes in ("whole", "number") and (number or code.type == "bool"):
            return code.text
        if code.type != takes or (takes == "vector" and code.element != "f64"):
            raise UntranslatableError(f"{code.named} where {_TAKES.get(takes, takes)} should be")
        return code.text

    def place(self, target: Node) -> _Place:
        """What can be assigned to."""
        match target.type:
            case "identifier":
                name = text_of(target)
                variable = self.variable(name)
                if variable is None or variable.constant:
                    raise UntranslatableError(f"an assignment to `{name}`")
                return _place(variable.code)
            case "subscript_expression":
                array = self.array(field(target, "object"))
                if array.is_copy:
                    raise UntranslatableError("an assignment to an element of a copy")
                text = f"{array.flat}[{self.index(field(target, 'index'))}]"
                if array.element == "int":
                    return _Place(text, "whole")
                return _Place(text, "number", array.element == "f64")
            case "member_expression":
                path = self.path(target)
                if path[:1] == ("ctx",):
                    return _place(self.value(target))
                match engine_field(path):
                    case "float":
                        return _Place(".".join(path), "number", True)
                    case "int":
                        return _Place(".".join(path), "whole")
                    case _:
                        pass
                name = ".".join(path) or text_of(field(target, "property"))
                raise UntranslatableError(f"an assignment to `{name}`")
            case _:
                raise UntranslatableError("an assignment to this")

    # --- calls

    def call_statement(self, node: Node) -> Iterator[str]:
        """A call for what it does."""
        function, given = field(node, "function"), arguments(node)
        check_single(given)
        match path := self.path(function):
            case ("sim", "play" | "pause") if self.button and not given:
                return
            case ("sim", "reset") if self.button and not given:
                yield f"reset(model, data{', ctx' if self.context else ''})"
                return
            case ("mj", name) if name in CALLS:
                yield self.value(node).text
                return
        method = text_of(field(function, "property")) if "member" in function.type else ""
        if method not in ("fill", "set"):
            raise refused_call(path)
        array = self.array(field(function, "object"))
        if array.is_copy:
            raise UntranslatableError(f"`.{method}()` on a copy")
        yield self.fill(array, given) if method == "fill" else self.set(array, given)

    def fill(self, array: Code, given: list[Node]) -> str:
        """`array.fill(number)`, or from and to an index."""
        if len(given) not in (1, 3):
            raise UntranslatableError("`.fill()` other than with one number or three")
        number = self.item(array, given[0])
        if len(given) == 1:
            return f"{array.text}.fill({number})"
        return f"{self.part(array, 'subarray', given[1:]).text} = {number}"

    def item(self, array: Code, number: Node) -> str:
        """A number for an array; what is no whole one is cut off as JavaScript does it."""
        return self.integer(number) if array.element == "int" else self.number(number).text

    def set(self, array: Code, given: list[Node]) -> str:
        """`array.set(numbers, offset)`."""
        if len(given) not in (1, 2):
            raise UntranslatableError("`.set()` other than of numbers and an offset")
        if given[0].type == "array":
            items = [self.item(array, number) for number in array_items(given[0])]
            count, text = str(len(items)), f"[{', '.join(items)}]"
        else:
            source = self.array(given[0])
            if source.is_copy:
                raise UntranslatableError("`.set()` of an array that was just made")
            count, text = f"{source.text}.size", source.flat
        offset = self.index(given[1]) if len(given) == 2 else "0"
        if offset.isdecimal() and count.isdecimal():
            end = str(int(offset) + int(count))
        else:
            end = count if offset == "0" else f"{offset} + {count}"
        return f"{array.flat_view}[{'' if offset == '0' else offset}:{end}] = {text}"

    # --- loops

    def loop(self, node: Node) -> Iterator[str]:
        """A loop that counts; its limit must stay what it is."""
        loop = counting_loop(node)
        start, limit = self.number(loop.start), self.number(loop.limit)
        if "num" in (start.type, limit.type) or not self.is_steady(loop.limit):
            raise UntranslatableError(
                "a `for` loop whose limit may change or need not be a whole number"
            )
        up, end = loop.step > 0, limit.text
        if loop.inclusive and end.isdecimal():
            end = str(int(end) + (1 if up else -1))
        elif loop.inclusive:
            end = f"{end} {'+' if up else '-'} 1"
        ends = [start.text, end, str(loop.step)]
        if loop.step == 1:
            ends = ends[:2] if start.text != "0" else ends[1:2]
        natural = (start if up else limit).type == "nat"
        self.scopes.append({})
        own = self.declare(loop.name, Code("", "nat" if natural else "int"), constant=True)
        yield f"for {own} in range({', '.join(ends)}):"
        yield from self.indented(field(node, "body"))
        self.scopes.pop()

    def is_steady(self, limit: Node) -> bool:
        """Whether the value of an expression cannot change while a loop runs."""
        match limit.type:
            case "number":
                return True
            case "identifier":
                variable = self.variable(text_of(limit))
                return variable is None or variable.constant
            case "member_expression":
                path = self.path(limit)
                if path[-1:] == ("length",):
                    return isinstance(engine_field(path[:-1]), ArrayField)
                return path[:1] == ("ctx",) or (path[0] == "model" and engine_field(path) == "size")
            case "binary_expression":
                return self.is_steady(field(limit, "left")) and self.is_steady(
                    field(limit, "right")
                )
            case _:
                return False


def _in_sequence(node: Node) -> Iterator[Node]:
    """The expressions of `a, b, c`."""
    if node.type == "sequence_expression":
        for child in children(node):
            yield from _in_sequence(child)
    else:
        yield node


def _place(code: Code) -> _Place:
    if code.type in NUMBERS:
        return _Place(code.text, "float", True)
    return _Place(code.text, code.type)


def _is_capitals(name: str) -> bool:
    return name.isupper() and not name.endswith("_")


_TAKES = {
    **{"number": "a number", "float": "a number", "whole": "a number"},
    **{"bool": "a truth value", "str": "a text", "vector": "an array"},
}
