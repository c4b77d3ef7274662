"""Expressions of lab code, from JavaScript to Python; see `translate`."""

from __future__ import annotations

import ast
import contextlib
import keyword
from collections.abc import Collection, Iterable, Iterator

from tree_sitter import Node

from coursebuild.features.lab import javascript as js
from coursebuild.features.lab.engines.native import EngineDescription

ROOTS = frozenset("model data mj sim ctx lib Math".split())
RESERVED = ROOTS.union(
    """
        abs copy ctx float format int len max math min mujoco np range str SimpleNamespace
        energy linear_momentum angular_momentum normal_force qpos SECONDS DIVERGED XML
        load start reset step simulate readouts report main set_up control model_path
        functools missing answer run check
    """.split()
)
"""Names that every script may use, and that nothing else in it may have."""
_NUMPY = "sin cos tan sinh cosh tanh exp expm1 log log1p log2 log10 cbrt sqrt floor ceil trunc sign"
_ARC = "sin cos tan sinh cosh tanh"
_FUNCTIONS = {
    **{f"Math.{name}": f"np.{name}(...)" for name in _NUMPY.split()},
    **{f"Math.a{name}": f"np.arc{name}(...)" for name in _ARC.split()},
    "Math.abs": "abs(...)",
    "Math.fround": "float(np.float32(...))",
    "Math.atan2": "np.arctan2(...)",
    "Math.hypot": "math.hypot(...)",
    "Math.max": "max(...)",
    "Math.min": "min(...)",
    "Math.pow": "math.pow(...)",
    "Math.round": "np.floor(0.5 + ...)",
    "lib.angmom": "angular_momentum(model, data)",
    "lib.bodyId": "model.body(...).id",
    "lib.bodyPos": "data.body(...).xpos.copy()",
    "lib.deg": "np.degrees(...)",
    "lib.energy": "energy(model, data)",
    "lib.jointId": "model.joint(...).id",
    "lib.momentum": "linear_momentum(model, data)",
    "lib.norm": "np.linalg.norm(...)",
    "lib.normalForce": "normal_force(model, data, ...)",
    "lib.qpos": "qpos(data, ...)",
    "lib.rad": "np.radians(...)",
    "lib.sitePos": "data.site(...).xpos.copy()",
}
"""Functions in Python, with `...` for the arguments."""
_EXTREMES = (("Math", "max"), ("Math", "min"))
_CONSTANTS = {
    "PI": "math.pi",
    "E": "math.e",
    "SQRT2": "math.sqrt(2)",
    "SQRT1_2": "math.sqrt(0.5)",
    "LN2": "math.log(2)",
    "LN10": "math.log(10)",
}
_UNARY = {"-": "-", "+": "+", "~": "~", "!": "not "}
_BINARY = {
    **{sign: sign for sign in "+ - * / ** & | ^ < > <= >= == !=".split()},
    **{"===": "==", "!==": "!=", "&&": "and", "||": "or"},
}
_UNBOUNDED = {"NaN": "math.nan", "Infinity": "math.inf"}
_EQUALITY = {"==": "", "===": "", "!=": "not ", "!==": "not "}
_REPEATABLE = ("identifier", "member_expression", "subscript_expression")
"""What may be evaluated twice."""
_FLAT = ".reshape(-1)"


class Expressions:
    """Translates the expressions of a piece of code."""

    def __init__(
        self, engine: EngineDescription, fields: Collection[str], value: str | None, button: bool
    ) -> None:
        self.engine = engine
        self.fields, self.value, self.button = fields, value, button
        self.scopes: list[set[str]] = []
        self.counters: set[str] = set()

    def part(self, node: Node, name: str) -> str:
        """Translate an expression that is part of a node."""
        return self.expression(js.field(node, name))

    def all(self, nodes: Iterable[Node]) -> str:
        """Translate expressions, and put commas between them."""
        return ", ".join(map(self.expression, nodes))

    def expression(self, node: Node) -> str:
        """Translate an expression that is used for its value."""
        match node.type:
            case "number":
                text = js.text_of(node)
                if text.endswith("n"):
                    raise js.UntranslatableError(f"the number `{text}`")
                return text
            case "string":
                return repr(js.string_value(node))
            case "template_string":
                parts = js.template_parts(node)
                texts = (repr(p) if isinstance(p, str) else self.text(p) for p in parts)
                return f"({' + '.join(texts) or repr('')})"
            case "true" | "false":
                return node.type.capitalize()
            case "null" | "undefined":
                return "math.nan"  # as a value that is not there, which is no number either
            case "identifier":
                return self.name(js.text_of(node))
            case "member_expression":
                return self.member(node)
            case "subscript_expression":
                text = self.element(node)
                kind = self.kind(js.dotted_name(js.field(node, "object")))
                return f"float({text})" if kind == "single" else text
            case "call_expression":
                return self.call(node)
            case "spread_element":
                return f"*{self.expression(js.children(node)[0])}"
            case "array":
                return f"np.array([{self.all(js.array_items(node))}], dtype=float)"
            case "unary_expression" if operator_of(node) in _UNARY:
                return f"({_UNARY[operator_of(node)]}{self.part(node, 'argument')})"
            case "binary_expression":
                return self.binary(node)
            case "arrow_function" if js.field(node, "body").type != "statement_block":
                with self.function(node) as names:
                    return f"(lambda {', '.join(names)}: {self.part(node, 'body')})"
            case "ternary_expression":
                first, second = map(self.expression, _branches(node))
                return f"({first} if {self.part(node, 'condition')} else {second})"
            case _:
                raise js.refusal(node)

    def binary(self, node: Node) -> str:
        """Translate an operator with two operands."""
        operator, sides = operator_of(node), (js.field(node, "left"), js.field(node, "right"))
        if operator == "%":
            return f"np.fmod({self.all(sides)})"
        if operator == "??" and sides[0].type in _REPEATABLE:
            value, default = map(self.expression, sides)
            return f"({default} if missing({value}) else {value})"
        if operator in _EQUALITY and sides[1].type in ("null", "undefined"):
            return f"({_EQUALITY[operator]}missing({self.expression(sides[0])}))"
        if operator not in _BINARY:
            raise js.UntranslatableError(f"`{operator}`")
        translate = self.text if _is_text(node) else self.expression
        return f"({translate(sides[0])} {_BINARY[operator]} {translate(sides[1])})"

    def text(self, node: Node) -> str:
        """Translate an expression that becomes part of a text."""
        return self.expression(node) if _is_text(node) else f"str({self.expression(node)})"

    def is_variable(self, name: str) -> bool:
        """Whether a variable of this name is in scope."""
        return any(python_name(name) in scope for scope in self.scopes)

    def kind(self, path: Iterable[str]) -> str | None:
        """What stands at a path of the engine's, such as `model.opt.gravity`."""
        return self.engine.fields.get(".".join(path))

    def name(self, name: str) -> str:
        """Translate a name without dots."""
        if self.is_variable(name):
            return python_name(name)
        if name == "value" and self.value is not None:
            return self.value
        if name in ("model", "data"):
            return name
        if name not in _UNBOUNDED:
            raise js.UntranslatableError(f"`{name}`")
        return _UNBOUNDED[name]

    def member(self, node: Node) -> str:
        """Translate a name with dots."""
        path, name = js.dotted_name(node), js.text_of(js.field(node, "property"))
        match path:
            case ("sim", "time"):
                return "data.time"
            case ("ctx", variable) if variable in self.fields:
                return f"ctx.{variable}"
            case ("Math", constant) if constant in _CONSTANTS:
                return _CONSTANTS[constant]
            case ("mj", enumeration, member, "value") if enumeration.startswith("mjt"):
                return f"mujoco.{enumeration}.{member}.value"
            case _:
                pass
        kind = self.kind(path)
        if kind is not None:
            return ".".join(path) + (_FLAT if kind in ("rows", "single") else "")
        if name == "length":
            return f"{self.part(node, 'object')}.size"
        if name in ("kinetic", "potential", "total") and not path:
            return f"{self.part(node, 'object')}.{name}"
        raise js.refusal(node)

    def element(self, node: Node) -> str:
        """Translate an element of an array; one with rows is flat, as in JavaScript."""
        array = self.part(node, "object")
        if array.endswith(_FLAT):
            array = f"{array.removesuffix(_FLAT)}.flat"
        return f"{array}[{self.index(js.field(node, 'index'))}]"

    def index(self, node: Node) -> str:
        """Translate an index, which in Python must be an `int`."""
        text = ast.unparse(ast.parse(self.expression(node), ""))
        return text if self.is_whole(node) else f"int({text})"

    def is_whole(self, node: Node) -> bool:
        """Whether an expression is surely a whole number."""
        match node.type:
            case "number":
                return js.text_of(node).isdecimal()
            case "identifier":
                return js.text_of(node) in self.counters
            case "binary_expression":
                sides = (js.field(node, "left"), js.field(node, "right"))
                return operator_of(node) in "+-*" and all(map(self.is_whole, sides))
            case "call_expression":
                return js.dotted_name(js.field(node, "function"))[-1:] in (
                    ("bodyId",),
                    ("jointId",),
                )
            case "member_expression":
                name = js.text_of(js.field(node, "property"))
                is_size = name.startswith("n") and js.dotted_name(node) == ("model", name)
                return name == "length" or (is_size and self.kind(("model", name)) == "number")
            case _:
                return False

    def bounds(self, nodes: Iterable[Node]) -> str:
        """Translate the bounds of a slice, the second of which may be missing."""
        texts = [self.index(node) for node in nodes]
        return ":".join([*texts, ""][:2]) if texts else ""

    def call(self, node: Node) -> str:
        """Translate a call that is used for its value."""
        function, values = js.field(node, "function"), js.arguments(node)
        path = js.dotted_name(function)
        if path in _EXTREMES and [value.type for value in values] == ["spread_element"]:
            return f"{path[1]}({self.all(js.children(values[0]))})"  # it may have a single item
        if ".".join(path) in _FUNCTIONS:
            return _FUNCTIONS[".".join(path)].replace("...", self.all(values))
        if path[:1] == ("mj",) and len(path) == 2 and path[1] in self.engine.functions:
            return f"mujoco.{path[1]}({self.all(values)})"
        if self.is_function(path):
            return f"{self.expression(function)}({self.all(values)})"
        if path == ("Array", "from") and values:
            return self.mapped(values[0], values[1] if len(values) > 1 else None)
        match js.text_of(js.field(function, "property")) if "member" in function.type else "":
            case "map" if len(values) == 1:
                return self.mapped(js.field(function, "object"), values[0])
            case "reduce" if len(values) == 2 and len(js.parameters(values[0])) == 2:
                step, begin = map(self.expression, values)
                return f"functools.reduce({step}, {self.part(function, 'object')}, {begin})"
            case "slice" | "subarray" as method if len(values) < 3:
                part = f"{self.part(function, 'object')}[{self.bounds(values) or ':'}]"
                return part + ".copy()" * (method == "slice")
            case "toFixed" if all(digits.type == "number" for digits in values):
                digits = self.all(values) or "0"
                return f"format({self.part(function, 'object')}, '.{digits}f')"
            case _:
                raise js.refusal(function, "a call of ")

    def is_function(self, path: tuple[str, ...]) -> bool:
        """Whether a path may be that of a function of the lab's code."""
        return self.is_field(path) or (len(path) == 1 and self.is_variable(path[0]))

    def is_field(self, path: tuple[str, ...]) -> bool:
        """Whether a path is that of what the lab's code keeps."""
        return len(path) == 2 and path[0] == "ctx" and path[1] in self.fields

    def mapped(self, array: Node, function: Node | None) -> str:
        """Translate an array that is made of another, or of `{length: n}`, item by item."""
        length = js.length_of(array)
        items = self.expression(array) if length is None else f"range({self.index(length)})"
        if function is None:
            return f"np.array({items}, dtype=float)"
        if function.type != "arrow_function":
            name = _FUNCTIONS.get(".".join(js.dotted_name(function)))
            call = f"{self.expression(function)}(...)" if name is None else name
            return f"np.array([{call.replace('...', 'x')} for x in {items}], dtype=float)"
        with self.function(function) as names:
            self.counters |= set(names[1:])
            loop = self.loop_over(names, items, is_range=length is not None)
            return f"np.array([{self.part(function, 'body')} {loop}], dtype=float)"

    def loop_over(self, names: list[str], items: str, *, is_range: bool = False) -> str:
        """The head of a loop with an item, and its index if there is a second name."""
        if is_range:  # its items are nothing, and the loop goes over the indices
            return f"for {names[1] if len(names) > 1 else '_'} in {items}"
        if len(names) < 2:
            return f"for {names[0] if names else '_'} in {items}"
        return f"for {names[1]}, {names[0]} in enumerate({items})"

    @contextlib.contextmanager
    def function(self, node: Node) -> Iterator[list[str]]:
        """The parameters of an arrow function, in scope."""
        parameters = js.parameters(node)
        if len(set(parameters)) < len(parameters) or ROOTS.intersection(parameters):
            raise js.refusal(node)
        names = [python_name(name) for name in parameters]
        self.counters -= set(names)
        self.scopes.append(set(names))
        yield names
        self.scopes.pop()


def python_name(name: str) -> str:
    """Return a variable's name in Python, where names in capitals are the script's constants."""
    is_in_use = name in RESERVED or keyword.iskeyword(name) or name.isupper()
    return f"{name}_" if is_in_use else name


def operator_of(node: Node) -> str:
    """Return the operator of an expression."""
    return js.text_of(js.field(node, "operator"))


def _branches(node: Node) -> tuple[Node, Node]:
    return js.field(node, "consequence"), js.field(node, "alternative")


def _is_text(node: Node) -> bool:
    """Whether an expression is surely a text."""
    match node.type:
        case "string" | "template_string":
            return True
        case "binary_expression" if operator_of(node) == "+":
            return _is_text(js.field(node, "left")) or _is_text(js.field(node, "right"))
        case "ternary_expression":
            return any(map(_is_text, _branches(node)))
        case "call_expression":
            function = js.field(node, "function")
            return (
                "member" in function.type
                and js.text_of(js.field(function, "property")) == "toFixed"
            )
        case _:
            return False
