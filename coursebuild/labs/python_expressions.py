"""JavaScript expressions of lab code as Python.

Entry point: `Expressions.value(expression)`. Calls are translated by a subclass, see
`python_calls`.

A Python expression made here has the same value as the one in JavaScript, as long as no error is
raised. Where the two languages differ for numbers a helper takes over (see `python_library`), and
where they differ otherwise the expression is refused.
"""

from __future__ import annotations

import json
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import assert_never

from coursebuild.labs.engine_names import ARRAYS, SCALARS, SIZES
from coursebuild.labs.javascript_tree import (
    Array,
    Binary,
    Boolean,
    Call,
    Conditional,
    Expression,
    Index,
    Member,
    Name,
    Number,
    String,
    Template,
    Unary,
)
from coursebuild.labs.python_texts import joined
from coursebuild.labs.python_values import (
    AND,
    ATOM,
    BITS,
    COMPARISON,
    CONDITIONAL,
    NAMED,
    NOT,
    NUMBERS,
    OR,
    POWER,
    PRODUCT,
    SIGN,
    SMALL,
    Code,
    Names,
    Type,
    Used,
    Variable,
    arithmetic,
    floating,
    literal,
    refuse,
)

_CONSTANTS = {
    "PI": "math.pi",
    "E": "math.e",
    "SQRT2": repr(math.sqrt(2)),
    "SQRT1_2": repr(math.sqrt(0.5)),
    "LN2": repr(math.log(2)),
    "LN10": repr(math.log(10)),
    "LOG2E": repr(1 / math.log(2)),
    "LOG10E": repr(1 / math.log(10)),
}
_COMPARISONS = {"===": "==", "!==": "!=", "==": "==", "!=": "!=", "<": "<", ">": ">", "<=": "<="}
_COMPARISONS[">="] = ">="
_ROOTS = frozenset("model data mj sim ctx lib Math value".split())


class Expressions(ABC):
    """Translates expressions, given the variables that are in scope."""

    def __init__(self, names: Names, used: Used) -> None:
        self.names = names
        self.used = used
        self.scopes: list[dict[str, Variable]] = [{}]

    # --- what is needed

    def number(self, expression: Expression) -> Code:
        """An expression whose value is a number."""
        return _numeric(self.value(expression, single=True))

    def test(self, expression: Expression) -> Code:
        """An expression that is only asked whether it is true."""
        if isinstance(expression, Unary) and expression.operator == "!":
            return Code(f"not {self.test(expression.operand).within(NOT)}", "bool", NOT)
        if isinstance(expression, Binary) and expression.operator in _LOGICAL:
            word, strength = _LOGICAL[expression.operator]
            left, right = self.test(expression.left), self.test(expression.right)
            text = f"{left.within(strength)} {word} {right.within(strength + 1)}"
            return Code(text, "bool", strength)
        code = self.value(expression, single=True)
        if code.type in NUMBERS:  # NaN is false
            return Code(f"abs({code.text}) > 0", "bool", COMPARISON)
        if code.type != "bool":
            raise refuse(f"{NAMED[code.type]} as a condition")
        return code

    def index(self, expression: Expression) -> str:
        """An expression as an index; a negative one means something else in Python."""
        code = self.number(expression)
        if code.type == "nat":
            return code.text
        self.used.helpers.add("index")
        return f"index({code.text})"

    def integer(self, expression: Expression) -> str:
        """An expression as a whole number, cut off where it is none."""
        code = self.number(expression)
        return f"int({code.text})" if code.type == "num" else code.text

    def text(self, expression: Expression) -> str:
        """An expression whose value is a text."""
        code = self.value(expression)
        if code.type != "str":
            raise refuse(f"{NAMED[code.type]} where a text should be")
        return code.text

    def array(self, expression: Expression) -> Code:
        """An expression whose value is an array."""
        code = self.value(expression)
        if code.type not in ("vector", "rows"):
            raise refuse(f"{NAMED[code.type]} where an array should be")
        return code

    # --- expressions

    def value(self, expression: Expression, *, single: bool = False) -> Code:
        """Any expression; `single`: where one number will do, it is one."""
        match expression:
            case Number(text):
                return literal(text)
            case String(text):
                return _text(text)
            case Template(parts):
                values = [_text(p) if isinstance(p, str) else self.value(p) for p in parts]
                return joined(values, self.used)
            case Boolean(value):
                return Code(str(value), "bool")
            case Name(name):
                return self._name(name)
            case Member():
                return self._member(expression)
            case Index(whole, index):
                return self._element(self.array(whole), self.index(index))
            case Call():
                return self.call(expression, single)
            case Array(items):
                self.used.modules.add("import numpy as np")
                return Code(f"np.array([{self.items(items)}], dtype=float)", "vector")
            case Unary(operator, operand):
                return self._unary(operator, operand)
            case Binary(operator, left, right):
                return self._binary(operator, left, right)
            case Conditional(test, then, otherwise):
                return self._conditional(test, then, otherwise)
            case _:
                assert_never(expression)

    def items(self, items: Iterable[Expression]) -> str:
        """Numbers, with commas between them."""
        return ", ".join(self.number(item).text for item in items)

    def _name(self, name: str) -> Code:
        for scope in reversed(self.scopes):
            if name in scope:
                return scope[name].code
        if name == "value" and self.names.value is not None:
            return self.names.value
        raise refuse(f"`{name}`")

    def way(self, expression: Expression) -> tuple[str, ...]:
        """The way to something that is known by its name: `("model", "opt", "timestep")`."""
        match expression:
            case Name(name) if name in _ROOTS:
                return (name,)
            case Member(whole, name):
                way = self.way(whole)
                return (*way, name) if way else ()
            case _:
                return ()

    def _member(self, member: Member) -> Code:
        way = self.way(member)
        text = ".".join(way)
        match way:
            case ("sim", "time"):
                return Code("data.time", "num")
            case ("model", name) if name in SIZES:
                return Code(text, "nat")
            case ("ctx", name) if name in self.names.context:
                return Code(text, self.names.context[name])
            case ("Math", name) if name in _CONSTANTS:
                if name in ("PI", "E"):
                    self.used.modules.add("import math")
                return Code(_CONSTANTS[name], "num")
            case ("mj", enumeration, name, "value") if enumeration.startswith("mjt"):
                return Code(f"mujoco.{enumeration}.{name}.value", "int")
        if member.name == "length":
            return Code(f"{self.array(member.whole).text}.size", "nat")
        if way in SCALARS:
            types: dict[str, Type] = {"float": "num", "int": "int", "size": "nat"}
            return Code(text, types[SCALARS[way]])
        if way in ARRAYS:
            field = ARRAYS[way]
            return Code(text, "rows" if field.rows else "vector", element=field.element)
        if way:
            raise refuse(f"`{text}`")
        whole = self.value(member.whole)
        if whole.type == "energy" and member.name in ("kinetic", "potential", "total"):
            return Code(f"{whole.text}.{member.name}", "num")
        raise refuse(f"`.{member.name}`")

    def _element(self, array: Code, index: str) -> Code:
        text = f"{array.text}{'.flat' if array.type == 'rows' else ''}[{index}]"
        match array.element:
            case "f64":
                return Code(text, "num")
            case "f32":
                return Code(f"float({text})", "num")
            case "int":
                sure = array.text.startswith("model.") and array.text[6:] in _NEVER_NEGATIVE
                return Code(f"int({text})", "nat" if sure else "int")

    # --- operators

    def _unary(self, operator: str, operand: Expression) -> Code:
        if operator == "!":
            return self.test(Unary(operator, operand))
        code = self.number(operand)
        if operator == "+":
            return code
        if operator == "~":
            _check_bits(operator, code)
            return Code(f"~{code.within(SIGN)}", "int", SIGN)
        if isinstance(operand, Number) and code.type == "nat" and code.bound > 0:
            return Code(f"-{code.text}", "int", SIGN, code.bound)
        return Code(f"-{floating(code).within(SIGN)}", "num", SIGN)

    def _binary(self, operator: str, left: Expression, right: Expression) -> Code:
        if operator in _LOGICAL:
            sides = self.value(left), self.value(right)
            if any(side.type != "bool" for side in sides):
                raise refuse(f"`{operator}` for its value")
            return self.test(Binary(operator, left, right))
        if operator in _COMPARISONS:
            return self._comparison(operator, left, right)
        a, b = self.value(left, single=True), self.value(right, single=True)
        if operator == "+" and "str" in (a.type, b.type):
            return joined((a, b), self.used)
        a, b = _numeric(a), _numeric(b)
        if operator in _BITS:
            _check_bits(operator, a, b)
            return Code(f"{a.within(ATOM)} {operator} {b.within(ATOM)}", "int", BITS)
        if operator == "**":
            return self._power(left, a, right, b)
        if operator == "%":
            return self._remainder(a, right, b)
        return arithmetic(operator, a, b)

    def _comparison(self, operator: str, left: Expression, right: Expression) -> Code:
        a, b = self.value(left, single=True), self.value(right, single=True)
        numbers = a.type in NUMBERS and b.type in NUMBERS
        texts = a.type == b.type == "str" and operator[0] in "=!"
        if a.type == b.type == "bool" and operator[0] in "=!":
            return _same_truth(operator, (left, a), (right, b))
        if not numbers and not texts:
            raise refuse(f"`{operator}` between {NAMED[a.type]} and {NAMED[b.type]}")
        text = f"{a.within(BITS)} {_COMPARISONS[operator]} {b.within(BITS)}"
        return Code(text, "bool", COMPARISON)

    def _power(self, left: Expression, a: Code, right: Expression, b: Code) -> Code:
        self.used.exact = False
        if isinstance(right, Number) and b.type == "nat" and b.bound <= 16:
            return Code(f"{floating(a).within(ATOM)}**{b.text}", "num", POWER)
        return self.call(Call(Member(Name("Math"), "pow"), (left, right)), single=True)

    def _remainder(self, a: Code, divisor: Expression, b: Code) -> Code:
        if a.type == "nat" and isinstance(divisor, Number) and b.type == "nat" and b.bound > 0:
            return Code(f"{a.within(PRODUCT)} % {b.text}", "nat", PRODUCT, b.bound)
        self.used.modules.add("import numpy as np")
        return Code(f"np.fmod({floating(a).text}, {floating(b).text})", "num")

    def _conditional(self, test: Expression, then: Expression, otherwise: Expression) -> Code:
        a, b = self.value(then, single=True), self.value(otherwise, single=True)
        kind: Type = a.type
        if a.type != b.type:
            if a.type not in NUMBERS or b.type not in NUMBERS:
                raise refuse(f"{NAMED[a.type]} or {NAMED[b.type]}")
            kind = "int" if "num" not in (a.type, b.type) else "num"
            if kind == "num":
                a, b = floating(a), floating(b)
        if kind in ("vector", "rows", "energy", "nothing"):
            raise refuse(f"{NAMED[kind]} that depends on a condition")
        condition = self.test(test).within(OR)
        text = f"{a.within(OR)} if {condition} else {b.text}"
        return Code(text, kind, CONDITIONAL, max(a.bound, b.bound))

    @abstractmethod
    def call(self, call: Call, single: bool) -> Code:
        """A call."""


def _same_truth(
    operator: str, left: tuple[Expression, Code], right: tuple[Expression, Code]
) -> Code:
    """Whether two truth values are the same, or not."""
    for (_, code), (other, _) in ((left, right), (right, left)):
        if isinstance(other, Boolean):
            if other.value == (operator[0] == "="):
                return code
            return Code(f"not {code.within(NOT)}", "bool", NOT)
    text = f"{left[1].within(BITS)} {_COMPARISONS[operator]} {right[1].within(BITS)}"
    return Code(text, "bool", COMPARISON)


def _numeric(code: Code) -> Code:
    if code.type not in NUMBERS:
        raise refuse(f"{NAMED[code.type]} where a number should be")
    return code


def _text(text: str) -> Code:
    return Code(json.dumps(text, ensure_ascii=False), "str")


def _check_bits(operator: str, *operands: Code) -> None:
    """Bits are those of 32-bit integers in JavaScript."""
    if any(code.type == "num" or code.bound > SMALL for code in operands):
        raise refuse(f"`{operator}` on a number that need not be a whole one of 32 bits")


_LOGICAL = {"&&": ("and", AND), "||": ("or", OR)}
_BITS = ("&", "|", "^")
_NEVER_NEGATIVE = frozenset(
    """
        jnt_qposadr jnt_dofadr jnt_bodyid dof_bodyid dof_jntid geom_bodyid site_bodyid cam_bodyid
        body_parentid body_rootid body_weldid sensor_adr sensor_dim tendon_adr tendon_num
        actuator_actnum body_jntnum body_dofnum body_geomnum
    """.split()
)
