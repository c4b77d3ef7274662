"""Calls in lab code as Python: of the engine, of `Math`, of `lib`, and of the methods of arrays.

Entry point: `Calls`, which translates expressions with all that is in them.
"""

from __future__ import annotations

from msgspec.structs import replace

from coursebuild.labs.engine_names import CALLS, RESULTS
from coursebuild.labs.javascript_tree import Array, Call, Expression, Member, Name, Spread
from coursebuild.labs.python_expressions import Expressions
from coursebuild.labs.python_texts import METHODS, formatted
from coursebuild.labs.python_values import Code, Type, floating, refuse

_EXACT_FUNCTIONS = {
    "abs": "abs",
    "sqrt": "np.sqrt",
    "floor": "np.floor",
    "ceil": "np.ceil",
    "trunc": "np.trunc",
    "round": "rounded",
    "sign": "sign",
}
_FUNCTIONS = {
    **{name: f"np.{name}" for name in "sin cos tan sinh cosh tanh exp expm1 log log1p".split()},
    **{name: f"np.{name}" for name in "log2 log10 cbrt".split()},
    **{f"a{name}": f"np.arc{name}" for name in "sin cos tan sinh cosh tanh".split()},
}
ENGINE = "model, data"


class Calls(Expressions):
    """Translates expressions, given the variables that are in scope."""

    def call(self, call: Call, single: bool) -> Code:
        """A call; `single`: where it may give one number, it does."""
        way = self.way(call.function)
        match way:
            case ("Math", name):
                return self._math(name, call)
            case ("lib", name):
                return self._library(name, self.plain(call), single)
            case ("mj", name) if name in CALLS:
                return self._engine(name, self.plain(call))
        function = call.function
        if isinstance(function, Member) and function.name in ("slice", "subarray"):
            return self.part(self.array(function.whole), function.name, self.plain(call))
        if isinstance(function, Member) and function.name in METHODS:
            number = self.number(function.whole)
            digits = [self.number(argument) for argument in self.plain(call)]
            return formatted(function.name, number, digits[0] if digits else None, self.used)
        raise refuse(f"a call of `{'.'.join(way)}`" if way else "a call")

    def plain(self, call: Call) -> tuple[Expression, ...]:
        """The arguments of a call that spreads none."""
        return tuple(_unspread(argument) for argument in call.arguments)

    def _helper(self, name: str, arguments: str, type: Type = "num") -> Code:
        self.used.helpers.add(name)
        return Code(f"{name}({arguments})", type)

    def _math(self, name: str, call: Call) -> Code:
        self.used.modules.add("import numpy as np")
        if name in ("min", "max", "hypot"):
            return self._of_many(name, call)
        arguments = [self.number(argument) for argument in self.plain(call)]
        match name, arguments:
            case ("atan2", [y, x]):
                self.used.exact = False
                return Code(f"np.arctan2({floating(y).text}, {floating(x).text})", "num")
            case ("pow", [base, exponent]):
                self.used.exact = False
                return self._helper("power", f"{base.text}, {exponent.text}")
            case (_, [x]) if name in _EXACT_FUNCTIONS:
                function = _EXACT_FUNCTIONS[name]
                if "." not in function and function != "abs":
                    self.used.helpers.add(function)
                return Code(f"{function}({floating(x).text})", "num")
            case (_, [x]) if name in _FUNCTIONS:
                self.used.exact = False
                return Code(f"{_FUNCTIONS[name]}({floating(x).text})", "num")
        raise refuse(f"`Math.{name}` with {len(arguments)} arguments")

    def _of_many(self, name: str, call: Call) -> Code:
        """A function of any number of numbers."""
        texts = []
        for argument in call.arguments:
            if isinstance(argument, Spread):
                array = self.array(argument.value)
                if array.element != "f64":
                    raise refuse("`...` with numbers that are no doubles")
                texts.append(f"*{array.text}{'.flat' if array.type == 'rows' else ''}")
            else:
                texts.append(floating(self.number(argument)).text)
        if not texts:
            raise refuse(f"`Math.{name}` of nothing")
        if name == "hypot":
            self.used.exact = False
            self.used.modules.add("import math")
            return Code(f"math.hypot({', '.join(texts)})", "num")
        return self._helper(f"{name}imum", ", ".join(texts))

    def _library(self, name: str, arguments: tuple[Expression, ...], single: bool) -> Code:
        match name, arguments:
            case ("energy", ()):
                return self._helper("energy", ENGINE, "energy")
            case ("momentum", ()):
                return self._helper("momentum", ENGINE, "vector")
            case ("angmom", ()):
                return self._helper("angular_momentum", ENGINE, "vector")
            case ("sitePos" | "bodyPos", (which,)):
                kind = name.removesuffix("Pos")
                return Code(f"data.{kind}({self._which(which)}).xpos.copy()", "vector")
            case ("bodyId" | "jointId", (which,)):
                return Code(f"model.{name.removesuffix('Id')}({self._which(which)}).id", "nat")
            case ("qpos", (which,)):
                place = f"data.joint({self._which(which)}).qpos"
                if single:
                    return Code(f"{place}.item()", "num")
                return Code(f"{place}.copy()", "vector")
            case ("normalForce", ()):
                return self._helper("normal_force", ENGINE)
            case ("normalForce", (which,)):
                return self._helper("normal_force", f"{ENGINE}, {self._which(which)}")
            case ("norm", (Array(items),)):
                return self._helper("norm", f"[{self.items(items)}]")
            case ("norm", (vector,)):
                array = self.array(vector)
                return self._helper("norm", array.text + (".flat" if array.type == "rows" else ""))
            case ("deg" | "rad", (angle,)):
                return self._helper(name, floating(self.number(angle)).text)
            case ("random", ()):
                self.used.helpers.add("Random")
                return Code("random()", "num")
            case _:
                pass
        raise refuse(f"`lib.{name}` with {len(arguments)} arguments")

    def _which(self, which: Expression) -> str:
        """A name or an id."""
        code = self.value(which)
        return code.text if code.type == "str" else self.index(which)

    def _engine(self, name: str, arguments: tuple[Expression, ...]) -> Code:
        wanted = CALLS[name]
        if len(arguments) != len(wanted):
            raise refuse(f"`mj.{name}` with {len(arguments)} arguments")
        texts: list[str] = []
        for argument, kind in zip(arguments, wanted, strict=True):
            match kind:
                case "model" | "data":
                    if argument != Name(kind):
                        raise refuse(f"`mj.{name}` of something else than `{kind}`")
                    texts.append(kind)
                case "str":
                    texts.append(self.text(argument))
                case "float":
                    texts.append(self.number(argument).text)
                case _:
                    texts.append(self.index(argument) if kind == "size" else self.integer(argument))
        types: dict[str, Type] = {"int": "int", "float": "num"}
        type = types[RESULTS[name]] if name in RESULTS else "nothing"
        return Code(f"mujoco.{name}({', '.join(texts)})", type)

    def part(self, array: Code, name: str, arguments: tuple[Expression, ...]) -> Code:
        """Part of an array, as a copy (`slice`) or as a view."""
        ends = [self.number(argument) for argument in arguments]
        if len(ends) > 2 or any(end.type != "nat" for end in ends):
            raise refuse(f"`.{name}` other than from and to an index")
        texts = [end.text for end in ends]
        flat = array.text + (".reshape(-1)" if array.type == "rows" else "")
        part = f"{flat}[{':'.join([*texts, ''][:2])}]" if texts else flat
        text = f"{part}.copy()" if name == "slice" else part
        return replace(array, text=text, type="vector")


def _unspread(argument: Expression | Spread) -> Expression:
    if isinstance(argument, Spread):
        raise refuse("`...` where single arguments are expected")
    return argument
