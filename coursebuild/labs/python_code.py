"""Pieces of lab code as Python.

Entry points: `statements(code, …)`, `setter(target, …)`, `expression(code, …)`.

A piece becomes the lines of a function's body. Whether it may stand among other lines is told with
it: one that has variables of its own needs a function of its own.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Iterator
from typing import assert_never

from msgspec import Struct

from coursebuild.labs.engine_names import ARRAYS, CALLS, SCALARS, SIZES
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
    Statement,
    While,
)
from coursebuild.labs.python_calls import ENGINE, Calls
from coursebuild.labs.python_values import (
    NAMED,
    NUMBERS,
    Code,
    Names,
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
        model_path struct print max min len Iterable NamedTuple dataclass
        numeral fixed precise exponential str format Context Decimal DIGITS ROUND_HALF_UP
    """.split()
) | frozenset((*keyword.kwlist, *keyword.softkwlist))
"""Names that nothing else in a script may have."""


class Piece(Struct, frozen=True):
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
        # The constants of a script are in capitals.
        while own in RESERVED or own in self.taken or own.startswith("__") or _capitals(own):
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
        places = [self.place(target) for target in targets]
        takes = _common({place.takes for place in places})
        if operator == "":
            return " = ".join([*(place.text for place in places), self.stored(value, takes)])
        if operator in _COMPOUND and places[0].direct:
            return f"{places[0].text} {operator}= {self.number(value).text}"
        return f"{places[0].text} = {self.stored(Binary(operator, targets[0], value), takes)}"

    def stored(self, value: Expression, takes: str) -> str:
        """A value for a place."""
        if takes == "float":
            return floating(self.number(value)).text
        code = self.value(value, single=takes != "vector")
        if takes == "whole" and code.type != "bool":
            return self.integer(value)
        if takes == "whole":
            return code.text
        if takes == "number" and code.type in (*NUMBERS, "bool"):
            return code.text
        if code.type != takes or (takes == "vector" and code.element != "f64"):
            raise refuse(f"{NAMED[code.type]} where {_TAKES.get(takes, takes)} should be")
        return code.text

    def place(self, target: Expression) -> _Place:
        """What can be assigned to."""
        match target:
            case Name(name):
                variable = self.variable(name)
                if variable is None or variable.constant:
                    raise refuse(f"an assignment to `{name}`")
                return _place(variable.code)
            case Index(whole, index):
                array = self.array(whole)
                if "(" in array.text:
                    raise refuse("an assignment to an element of a copy")
                flat = ".flat" if array.type == "rows" else ""
                text = f"{array.text}{flat}[{self.index(index)}]"
                if array.element == "int":
                    return _Place(text, "whole", False)
                return _Place(text, "number", array.element == "f64")
            case Member():
                way = self.way(target)
                if way == ("sim", "time") or way[:1] not in (("data",), ("model",), ("ctx",)):
                    raise refuse(f"an assignment to `{'.'.join(way) or target.name}`")
                if SCALARS.get(way) == "float":
                    return _Place(".".join(way), "number", True)
                if SCALARS.get(way) == "int":
                    return _Place(".".join(way), "whole", False)
                if way[0] == "ctx":
                    return _place(self.value(target))
            case _:
                pass
        raise refuse("an assignment to this")

    def variable(self, name: str) -> Variable | None:
        """The variable of this name that is in scope."""
        return next((scope[name] for scope in reversed(self.scopes) if name in scope), None)

    # --- calls

    def evaluation(self, evaluated: Expression) -> Iterator[str]:
        """An expression for what it does."""
        if not isinstance(evaluated, Call):
            raise refuse("an expression that does nothing")
        way = self.way(evaluated.function)
        arguments = self.plain(evaluated)
        match way:
            case ("sim", "play" | "pause") if self.button and not arguments:
                return
            case ("sim", "reset") if self.button and not arguments:
                self.used.resets = True
                yield f"reset({', '.join([ENGINE, *(['ctx'] if self.names.context else [])])})"
                return
            case ("mj", name) if name in CALLS:
                yield self.value(evaluated).text
                return
            case _:
                pass
        function = evaluated.function
        if not isinstance(function, Member) or function.name not in ("fill", "set"):
            raise refuse(f"a call of `{'.'.join(way)}`" if way else "a call")
        array = self.array(function.whole)
        if "(" in array.text:
            raise refuse(f"`.{function.name}()` on a copy")
        if function.name == "fill":
            yield self.fill(array, arguments)
        else:
            yield self.set(array, arguments)

    def fill(self, array: Code, arguments: tuple[Expression, ...]) -> str:
        """`array.fill(number)`, or from and to an index."""
        if len(arguments) not in (1, 3):
            raise refuse("`.fill()` other than with one number or three")
        number = self.item(array, arguments[0])
        if len(arguments) == 1:
            return f"{array.text}.fill({number})"
        return f"{self.part(array, 'subarray', arguments[1:]).text} = {number}"

    def item(self, array: Code, number: Expression) -> str:
        """A number for an array; what is no whole one is cut off as JavaScript does it."""
        return self.integer(number) if array.element == "int" else self.number(number).text

    def set(self, array: Code, arguments: tuple[Expression, ...]) -> str:
        """`array.set(numbers, offset)`."""
        if len(arguments) not in (1, 2):
            raise refuse("`.set()` other than of numbers and an offset")
        numbers = arguments[0]
        if isinstance(numbers, Array):
            items = ", ".join(self.item(array, number) for number in numbers.items)
            count, text = str(len(numbers.items)), f"[{items}]"
        else:
            source = self.array(numbers)
            if "(" in source.text:
                raise refuse("`.set()` of an array that was just made")
            count = f"{source.text}.size"
            text = source.text + (".flat" if source.type == "rows" else "")
        offset = self.index(arguments[1]) if len(arguments) == 2 else "0"
        flat = array.text + (".reshape(-1)" if array.type == "rows" else "")
        if offset.isdecimal() and count.isdecimal():
            end = str(int(offset) + int(count))
        else:
            end = count if offset == "0" else f"{offset} + {count}"
        return f"{flat}[{'' if offset == '0' else offset}:{end}] = {text}"

    # --- loops

    def loop(self, loop: For) -> Iterator[str]:
        """A loop that counts; its limit must stay what it is."""
        start, limit = self.number(loop.start), self.number(loop.limit)
        if "num" in (start.type, limit.type) or not self.steady(loop.limit):
            raise refuse("a `for` loop whose limit may change or need not be a whole number")
        end = limit.text
        if loop.operator in ("<=", ">="):
            by = 1 if loop.operator == "<=" else -1
            end = f"{end} {'+' if by > 0 else '-'} 1"
            if limit.text.isdecimal():
                end = str(int(limit.text) + by)
        ends = [start.text, end, str(loop.step)]
        if loop.step == 1:
            ends = ends[:2] if start.text != "0" else ends[1:2]
        positive = (start if loop.step > 0 else limit).type == "nat"
        self.scopes.append({})
        name = self.declare(loop.name, Code("", "nat" if positive else "int"), constant=True)
        yield f"for {name} in range({', '.join(ends)}):"
        yield from self.indented(loop.body)
        self.scopes.pop()

    def steady(self, limit: Expression) -> bool:
        """Whether the value of an expression cannot change while a loop runs."""
        match limit:
            case Number():
                return True
            case Name(name):
                variable = self.variable(name)
                return variable is None or variable.constant
            case Member(whole, "length"):
                return self.way(whole) in ARRAYS
            case Member():
                way = self.way(limit)
                return way[0:1] == ("ctx",) or (way[0:1] == ("model",) and way[-1] in SIZES)
            case Binary(_, left, right):
                return self.steady(left) and self.steady(right)
            case _:
                return False


class _Place(Struct, frozen=True):
    """What can be assigned to."""

    text: str
    takes: str
    """`number` of any type, `float`, `whole`, or another type of value."""
    direct: bool
    """Whether `+=` does there what it does in JavaScript."""


def _place(code: Code) -> _Place:
    if code.type in NUMBERS:
        return _Place(code.text, "float", True)
    return _Place(code.text, code.type, False)


def _capitals(name: str) -> bool:
    return name.isupper() and not name.endswith("_")


def _common(takes: set[str]) -> str:
    """What all of several places take."""
    if takes == {"number", "float"}:
        return "float"
    if len(takes) > 1:
        raise refuse("an assignment to places of several types")
    return takes.pop()


_COMPOUND = ("+", "-", "*", "/")
_TAKES = {"number": "a number", "bool": "a truth value", "str": "a text", "vector": "an array"}
_ENGINE_NAMES = frozenset("model data mj sim ctx lib Math value arguments eval".split())
