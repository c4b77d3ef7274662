"""JavaScript expressions of lab code as Python.

Entry point: `Expressions.value(node)`. Calls are translated by a subclass, see `calls`.

A Python expression made here has the same value as the one in JavaScript, as long as no error is
raised. Where the two languages differ for numbers a helper takes over (see `helpers`), and
where they differ otherwise the expression is refused.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping

from msgspec import Struct
from tree_sitter import Node

from coursebuild.features.lab.export.engine_names import ArrayField, Scalar, engine_field
from coursebuild.features.lab.export.values import (
    AND,
    ARRAYS,
    ATOM,
    BITS,
    COMPARISON,
    CONDITIONAL,
    NOT,
    NUMBERS,
    OR,
    POWER,
    PRODUCT,
    SIGN,
    Code,
    Type,
    arithmetic,
    as_float,
    join_texts,
    literal,
    text_literal,
)
from coursebuild.features.lab.javascript import (
    UntranslatableError,
    array_items,
    dotted_name,
    field,
    string_value,
    template_parts,
    text_of,
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
_UNBOUNDED = {"NaN": "math.nan", "Infinity": "math.inf"}
_ROOTS = frozenset("model data mj sim ctx lib Math value".split())
_SCALAR_TYPES: dict[Scalar, Type] = {"float": "num", "int": "int", "size": "nat"}
_COMPARISONS = {
    **{"===": "==", "!==": "!=", "==": "==", "!=": "!="},
    **{"<": "<", ">": ">", "<=": "<=", ">=": ">="},
}
_LOGICAL = {"&&": ("and", AND), "||": ("or", OR)}
_NEVER_NEGATIVE = frozenset(
    """
        jnt_qposadr jnt_dofadr jnt_bodyid dof_bodyid dof_jntid geom_bodyid site_bodyid cam_bodyid
        body_parentid body_rootid body_weldid sensor_adr sensor_dim tendon_adr tendon_num
        actuator_actnum body_jntnum body_dofnum body_geomnum
    """.split()
)


class Variable(Struct, frozen=True):
    """A variable of the code: what it is called in Python, and its type."""

    code: Code
    constant: bool = True


class Expressions(ABC):
    """Translates expressions, given what is in scope."""

    def __init__(self, context: Mapping[str, Type], value: Code | None) -> None:
        """`context`: the fields of `ctx`; `value`: what `value` stands for."""
        self.context = context
        self.given = value
        self.scopes: list[dict[str, Variable]] = [{}]

    # --- what is needed

    def number(self, node: Node) -> Code:
        """An expression whose value is a number."""
        return _number(self.value(node, single=True))

    def test(self, node: Node) -> Code:
        """An expression that is only asked whether it is true."""
        if node.type == "unary_expression" and _operator(node) == "!":
            return Code(f"not {self.test(field(node, 'argument')).within(NOT)}", "bool", NOT)
        if node.type == "binary_expression" and _operator(node) in _LOGICAL:
            word, precedence = _LOGICAL[_operator(node)]
            left, right = self.test(field(node, "left")), self.test(field(node, "right"))
            text = f"{left.within(precedence)} {word} {right.within(precedence + 1)}"
            return Code(text, "bool", precedence)
        code = self.value(node, single=True)
        if code.type in NUMBERS:  # NaN is false
            return Code(f"abs({code.text}) > 0", "bool", COMPARISON)
        if code.type != "bool":
            raise UntranslatableError(f"{code.named} as a condition")
        return code

    def index(self, node: Node) -> str:
        """An expression as an index; a negative one means something else in Python."""
        code = self.number(node)
        return code.text if code.type == "nat" else f"index({code.text})"

    def integer(self, node: Node) -> str:
        """An expression as a whole number, cut off where it is none."""
        code = self.number(node)
        return f"int({code.text})" if code.type == "num" else code.text

    def array(self, node: Node) -> Code:
        """An expression whose value is an array."""
        code = self.value(node)
        if code.type not in ARRAYS:
            raise UntranslatableError(f"{code.named} where an array should be")
        return code

    def numbers(self, nodes: Iterable[Node]) -> str:
        """Numbers, with commas between them."""
        return ", ".join(self.number(node).text for node in nodes)

    # --- expressions

    def value(self, node: Node, *, single: bool = False) -> Code:
        """Any expression; `single`: where one number will do, it is one."""
        match node.type:
            case "number":
                return literal(text_of(node))
            case "string":
                return text_literal(string_value(node))
            case "template_string":
                parts = template_parts(node)
                return join_texts(
                    [text_literal(p) if isinstance(p, str) else self.value(p) for p in parts]
                )
            case "true" | "false":
                return Code(node.type.capitalize(), "bool")
            case "identifier":
                return self._name(text_of(node))
            case "member_expression":
                return self._member(node)
            case "subscript_expression":
                return self._element(self.array(field(node, "object")), field(node, "index"))
            case "call_expression":
                return self.call(node, single=single)
            case "array":
                return Code(f"np.array([{self.numbers(array_items(node))}], dtype=float)", "vector")
            case "unary_expression":
                return self._unary(node)
            case "binary_expression" if _operator(node) in _LOGICAL:
                if any(self.value(field(node, side)).type != "bool" for side in ("left", "right")):
                    raise UntranslatableError(f"`{_operator(node)}` for its value")
                return self.test(node)
            case "binary_expression":
                return self.binary(_operator(node), field(node, "left"), field(node, "right"))
            case "ternary_expression":
                branches = (field(node, name) for name in ("consequence", "alternative"))
                values = (self.value(branch, single=True) for branch in branches)
                return self.conditional(field(node, "condition"), *values)
            case _:
                raise UntranslatableError(f"`{text_of(node)}`")

    def variable(self, name: str) -> Variable | None:
        """The variable of this name that is in scope."""
        return next((scope[name] for scope in reversed(self.scopes) if name in scope), None)

    def _name(self, name: str) -> Code:
        variable = self.variable(name)
        if variable is not None:
            return variable.code
        if name in _UNBOUNDED:
            return Code(_UNBOUNDED[name], "num")
        if name == "value" and self.given is not None:
            return self.given
        raise UntranslatableError(f"`{name}`")

    def path(self, node: Node) -> tuple[str, ...]:
        """The path of something that is known by its name: `("model", "opt", "timestep")`."""
        names = dotted_name(node)
        return names if names[:1] and names[0] in _ROOTS else ()

    def _member(self, node: Node) -> Code:
        path, name = self.path(node), text_of(field(node, "property"))
        text = ".".join(path)
        match path:
            case ("sim", "time"):
                return Code("data.time", "num")
            case ("ctx", own) if own in self.context:
                return Code(text, self.context[own])
            case ("Math", constant) if constant in _CONSTANTS:
                return Code(_CONSTANTS[constant], "num")
            case ("mj", enumeration, member, "value") if enumeration.startswith("mjt"):
                return Code(f"mujoco.{enumeration}.{member}.value", "int")
            case _:
                pass
        match engine_field(path):
            case ArrayField() as array:
                return Code(text, "rows" if array.rows else "vector", element=array.element)
            case None:
                pass
            case scalar:
                return Code(text, _SCALAR_TYPES[scalar])
        if name == "length":
            return Code(f"{self.array(field(node, 'object')).text}.size", "nat")
        if path:
            raise UntranslatableError(f"`{text}`")
        whole = self.value(field(node, "object"))
        if whole.type == "energy" and name in ("kinetic", "potential", "total"):
            return Code(f"{whole.text}.{name}", "num")
        raise UntranslatableError(f"`.{name}`")

    def _element(self, array: Code, index: Node) -> Code:
        text = f"{array.flat}[{self.index(index)}]"
        match array.element:
            case "f64":
                return Code(text, "num")
            case "f32":
                return Code(f"float({text})", "num")
            case "int":
                owner, _, name = array.text.partition(".")
                sure = owner == "model" and name in _NEVER_NEGATIVE
                return Code(f"int({text})", "nat" if sure else "int")

    # --- operators

    def _unary(self, node: Node) -> Code:
        operator, operand = _operator(node), field(node, "argument")
        if operator == "!":
            return self.test(node)
        if operator not in ("-", "+", "~"):
            raise UntranslatableError(f"`{operator}`")
        code = self.number(operand)
        if operator == "+":
            return code
        if operator == "~":
            _check_bits(operator, code)
            return Code(f"~{code.within(SIGN)}", "int", SIGN)
        if operand.type == "number" and code.whole:
            return Code(f"-{code.text}", "int", SIGN)
        return Code(f"-{as_float(code).within(SIGN)}", "num", SIGN)

    def binary(self, operator: str, left: Node, right: Node) -> Code:
        """Two operands with an operator between them that is not `&&` or `||`."""
        if operator in _COMPARISONS:
            return self._comparison(operator, left, right)
        a, b = self.value(left, single=True), self.value(right, single=True)
        if operator == "+" and "str" in (a.type, b.type):
            return join_texts((a, b))
        a, b = _number(a), _number(b)
        match operator:
            case "+" | "-" | "*" | "/":
                return arithmetic(operator, a, b)
            case "&" | "|" | "^":
                _check_bits(operator, a, b)
                return Code(f"{a.within(ATOM)} {operator} {b.within(ATOM)}", "int", BITS)
            case "**" if right.type == "number" and b.type == "nat" and b.whole <= 16:
                return Code(f"{as_float(a).within(ATOM)}**{b.text}", "num", POWER)
            case "**":
                return Code(f"power({a.text}, {b.text})", "num")
            case "%" if a.type == "nat" and right.type == "number" and b.whole:
                return Code(f"{a.within(PRODUCT)} % {b.text}", "nat", PRODUCT)
            case "%":
                return Code(f"np.fmod({as_float(a).text}, {as_float(b).text})", "num")
            case _:
                raise UntranslatableError(f"`{operator}`")

    def _comparison(self, operator: str, left: Node, right: Node) -> Code:
        a, b = self.value(left, single=True), self.value(right, single=True)
        python, equality = _COMPARISONS[operator], operator[0] in "=!"
        kinds = {"number" if code.type in NUMBERS else code.type for code in (a, b)}
        if kinds == {"bool"} and equality:
            for code, other in ((a, right), (b, left)):
                if other.type in ("true", "false"):
                    if (other.type == "true") == (python == "=="):
                        return code
                    return Code(f"not {code.within(NOT)}", "bool", NOT)
        elif kinds != {"number"} and not (kinds == {"str"} and equality):
            raise UntranslatableError(f"`{operator}` between {a.named} and {b.named}")
        return Code(f"{a.within(BITS)} {python} {b.within(BITS)}", "bool", COMPARISON)

    def conditional(self, test: Node, a: Code, b: Code) -> Code:
        """One value or another."""
        type = a.type
        if a.type != b.type:
            if a.type not in NUMBERS or b.type not in NUMBERS:
                raise UntranslatableError(f"{a.named} or {b.named}")
            type = "int"
            if "num" in (a.type, b.type):
                type, a, b = "num", as_float(a), as_float(b)
        if type not in (*NUMBERS, "bool", "str"):
            raise UntranslatableError(f"{a.named} that depends on a condition")
        condition = self.test(test).within(OR)
        text = f"{a.within(OR)} if {condition} else {b.text}"
        return Code(text, type, CONDITIONAL)

    @abstractmethod
    def call(self, node: Node, *, single: bool) -> Code:
        """A call; `single`: where it may give one number, it does."""


def _operator(node: Node) -> str:
    return text_of(field(node, "operator"))


def _number(code: Code) -> Code:
    if code.type not in NUMBERS:
        raise UntranslatableError(f"{code.named} where a number should be")
    return code


def _check_bits(operator: str, *operands: Code) -> None:
    """Bits are those of 32-bit integers in JavaScript."""
    if any(code.type == "num" for code in operands):
        raise UntranslatableError(
            f"`{operator}` on a number that need not be a whole one of 32 bits"
        )
