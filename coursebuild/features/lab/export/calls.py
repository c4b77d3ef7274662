"""Calls in lab code as Python: of the engine, of `Math`, of `lib`, and of methods of arrays.

Entry points: `Calls`, which translates expressions with all that is in them; `INEXACT`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, TypeAlias

from msgspec import Struct
from msgspec.structs import replace
from tree_sitter import Node

from coursebuild.features.lab.export.engine_names import CALLS, RESULTS
from coursebuild.features.lab.export.expressions import Expressions
from coursebuild.features.lab.export.values import Code, Type, as_float
from coursebuild.features.lab.javascript import (
    UntranslatableError,
    arguments,
    array_items,
    field,
    is_name,
    text_of,
)

Kind: TypeAlias = Literal["model", "data", "int", "size", "str", "float", "number", "which", "norm"]
"""What an argument is: `float` is a Python float, `number` any number, `size` an index, `which` a
name or an id, `norm` numbers to be added up."""


class Function(Struct, frozen=True):
    """How a call is written in Python."""

    arguments: tuple[Kind, ...]
    python: str
    """With `{}` for each argument that is shown."""
    result: Type


_NUMPY = "sin cos tan sinh cosh tanh exp expm1 log log1p log2 log10 cbrt sqrt floor ceil trunc"
_ARC = "sin cos tan sinh cosh tanh"
_ENGINE_TYPES: dict[str, Type] = {"int": "int", "float": "num"}


def _functions() -> dict[tuple[str, int], Function]:
    one: tuple[Kind, ...] = ("float",)
    found: dict[str, list[Function]] = {
        **{f"Math.{name}": [Function(one, f"np.{name}({{}})", "num")] for name in _NUMPY.split()},
        **{f"Math.a{name}": [Function(one, f"np.arc{name}({{}})", "num")] for name in _ARC.split()},
        "Math.abs": [Function(one, "abs({})", "num")],
        "Math.round": [Function(one, "rounded({})", "num")],
        "Math.sign": [Function(one, "sign({})", "num")],
        "Math.atan2": [Function(("float", "float"), "np.arctan2({}, {})", "num")],
        "Math.pow": [Function(("number", "number"), "power({}, {})", "num")],
        "lib.energy": [Function((), "energy(model, data)", "energy")],
        "lib.momentum": [Function((), "momentum(model, data)", "vector")],
        "lib.angmom": [Function((), "angular_momentum(model, data)", "vector")],
        "lib.sitePos": [Function(("which",), "data.site({}).xpos.copy()", "vector")],
        "lib.bodyPos": [Function(("which",), "data.body({}).xpos.copy()", "vector")],
        "lib.bodyId": [Function(("which",), "model.body({}).id", "nat")],
        "lib.jointId": [Function(("which",), "model.joint({}).id", "nat")],
        "lib.qpos": [Function(("which",), "data.joint({}).qpos", "vector")],
        "lib.normalForce": [
            Function((), "normal_force(model, data)", "num"),
            Function(("which",), "normal_force(model, data, {})", "num"),
        ],
        "lib.norm": [Function(("norm",), "norm({})", "num")],
        "lib.deg": [Function(one, "deg({})", "num")],
        "lib.rad": [Function(one, "rad({})", "num")],
        "lib.random": [Function((), "random()", "num")],
    }
    for name, kinds in CALLS.items():
        places = ", ".join("{}" for _ in kinds)
        result = _ENGINE_TYPES[RESULTS[name]] if name in RESULTS else "nothing"
        found[f"mj.{name}"] = [Function(kinds, f"mujoco.{name}({places})", result)]
    return {(name, len(one.arguments)): one for name, ones in found.items() for one in ones}


FUNCTIONS = _functions()
"""By name and number of arguments."""

METHODS = {
    "toFixed": ("fixed", 0, 100),
    "toPrecision": ("precise", 1, 100),
    "toExponential": ("exponential", 0, 100),
}
"""Of numbers: the helper that does the same, and how many digits may be wanted."""

INEXACT = {
    *(name for name in _NUMPY.split() if name not in ("sqrt", "floor", "ceil", "trunc")),
    *(f"arc{name}" for name in _ARC.split()),
    *("arctan2", "hypot", "power"),
}
"""Functions of NumPy and of a script whose last bit may differ from one library to another."""


class Calls(Expressions):
    """Translates expressions, calls included."""

    def call(self, node: Node, *, single: bool) -> Code:
        """A call; `single`: where it may give one number, it does."""
        function, given = field(node, "function"), arguments(node)
        path = self.path(function)
        name = ".".join(path)
        if name in ("Math.min", "Math.max", "Math.hypot"):
            return self._of_many(name, given)
        check_single(given)
        if name == "lib.qpos" and len(given) == 1:
            ending = ".item()" if single else ".copy()"
            return self._function(name, given, ending, "num" if single else "vector")
        if (name, len(given)) in FUNCTIONS:
            return self._function(name, given)
        if path and (path[0] in ("Math", "lib") or path[-1] in CALLS):
            raise UntranslatableError(f"`{name}` with {len(given)} arguments")
        if function.type == "member_expression":
            method = text_of(field(function, "property"))
            if method in ("slice", "subarray"):
                return self.part(self.array(field(function, "object")), method, given)
            if method in METHODS:
                return self._format(method, self.number(field(function, "object")), given)
        raise refused_call(path)

    def _function(
        self, name: str, given: list[Node], ending: str = "", result: Type | None = None
    ) -> Code:
        function = FUNCTIONS[name, len(given)]
        texts = [
            self._argument(name, kind, node)
            for kind, node in zip(function.arguments, given, strict=True)
        ]
        return Code(function.python.format(*texts) + ending, result or function.result)

    def _argument(self, function: str, kind: Kind, node: Node) -> str:
        match kind:
            case "model" | "data":
                if not is_name(node, kind):
                    raise UntranslatableError(f"`{function}` of something else than `{kind}`")
                return kind
            case "int":
                return self.integer(node)
            case "size":
                return self.index(node)
            case "number":
                return self.number(node).text
            case "float":
                return as_float(self.number(node)).text
            case "str":
                code = self.value(node)
                if code.type != "str":
                    raise UntranslatableError(f"{code.named} where a text should be")
                return code.text
            case "which":
                code = self.value(node)
                return code.text if code.type == "str" else self.index(node)
            case "norm":
                if node.type == "array":
                    return f"[{self.numbers(array_items(node))}]"
                return self.array(node).flat

    def _of_many(self, name: str, given: list[Node]) -> Code:
        """A function of any number of numbers."""
        texts = []
        for node in given:
            if node.type == "spread_element":
                array = self.array(node.named_children[-1])
                if array.element != "f64":
                    raise UntranslatableError("`...` with numbers that are no doubles")
                texts.append(f"*{array.flat}")
            else:
                texts.append(as_float(self.number(node)).text)
        if not texts:
            raise UntranslatableError(f"`{name}` of nothing")
        function = {"Math.min": "minimum", "Math.max": "maximum", "Math.hypot": "math.hypot"}[name]
        return Code(f"{function}({', '.join(texts)})", "num")

    def _format(self, method: str, number: Code, given: list[Node]) -> Code:
        """`number.toFixed(digits)` and its like; without digits there are none behind the point."""
        helper, least, most = METHODS[method]
        counts = [self.number(node).text for node in given[:1]]
        count = counts[0] if counts else "0" if method == "toFixed" else ""
        if not count.isdecimal() or not least <= int(count) <= most:
            what = f"`.{method}()` other than with a number of digits from {least} to {most}"
            raise UntranslatableError(what)
        return Code(f"{helper}({as_float(number).text}, {count})", "str")

    def part(self, array: Code, method: str, given: list[Node]) -> Code:
        """Part of an array, as a copy (`slice`) or as a view."""
        ends = [self.number(node) for node in given]
        if len(ends) > 2 or any(end.type != "nat" for end in ends):
            raise UntranslatableError(f"`.{method}` other than from and to an index")
        text = array.flat_view
        if ends:
            text += f"[{':'.join([*(end.text for end in ends), ''][:2])}]"
        return replace(array, text=text + ".copy()" * (method == "slice"), type="vector")


def check_single(given: Iterable[Node]) -> None:
    """Refuse arguments that are spread."""
    if any(node.type == "spread_element" for node in given):
        raise UntranslatableError("`...` where single arguments are expected")


def refused_call(path: tuple[str, ...]) -> UntranslatableError:
    """A call of something that has no counterpart."""
    return UntranslatableError(f"a call of `{'.'.join(path)}`" if path else "a call")
