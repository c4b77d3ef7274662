r"""Parses the part of mathematics in TeX whose meaning is certain.

Entry point: `read_expression(tex, start, end)`, an `Expression`, by recursive descent.

1. Numbers, symbols and groups side by side are a product. A number is `12`, `1\,000`, `1{,}000` or
   `0.5`; `\mathrm{kg}` after it is its unit.
2. What can be read in two ways is not understood: `a/bc`, `1/2x`, `f(x)`, `2\tfrac12`, `\sin x^2`,
   `\sin 2\pi/3`, `\sin x\cdot y`, `9.81(2)`, `\prod_{k=1}^3 k\cdot2`, `5\,\mathrm h(2)`.
3. Round or square brackets right after a function hold all that it is of: `\cos(x)^2` is the square
   of the cosine. Without brackets it is of the factors that follow, up to the next function.
4. Digits with a zero before them (`0010`) may be of another base: they have no value.
"""

from __future__ import annotations

import re

from coursebuild.api import regex
from coursebuild.core.checks.formulas import SYMBOLS
from coursebuild.core.text.quantities import plain_unit
from coursebuild.core.text.units import QUANTITY, write_quantities
from coursebuild.features.arithmetic.expressions import (
    OF_QUOTIENT,
    SIDE_BY_SIDE,
    Expression,
    NotUnderstood,
    is_mixed,
    join_units,
)

_MAX_FACTORS = 100  # of one expression, which also limits how deep it nests
TOKEN = regex(r"\\[A-Za-z]+\*?|\\[\s\S]|[\s\S]")
SPACE = regex(
    r"(?:\s|&|~|\\[,;:! ]|\\(?:left|right|[bB]igg?[lrm]?|displaystyle|textstyle|nolimits|limits"
    r"|nonumber|thinspace)(?![A-Za-z])\.?|\{\}|\\\\)+"
)
_NUMBER = regex(
    r"(?:[0-9]{1,3}(?:(?:\{,\}|\\[,;: ]|~)[0-9]{3})+(?![0-9])|[0-9]+)(?:\.[0-9]+)?|\.[0-9]+"
)
_E_NOTATION = regex(r"(?:[eE]|\\mathrm\s*(?:[eE]|\{[eE]\}))(?:\{[-+−]?[0-9]+\}|[-+−][0-9])")
_LETTER = regex(r"[A-Za-z]|\\[A-Za-z]+")
_DIFFERENTIAL = regex(r"\\mathrm\s*(?:\{\s*d\s*\}|d)|\\partial(?![A-Za-z])")
_UPRIGHT = regex(r"\\(?:mathrm|text|textrm|operatorname|mathit)(?![A-Za-z])\s*")
_SCALE = regex(r"(?:\\mathrm|\\text)\s*(?:\{\s*([CF])\s*\}|([CF]))(?![\^_])")
_UPRIGHT_UNIT = r"\{\s*(\\(?:mathrm|text)\s*(?:\{[^{}]+\}|[A-Za-z])(?:\^(?:\d|\{-?\d\}))?)\s*\}"
_UNIT_FRACTION = regex(rf"(?!\{{\s*\\mathrm\s*\{{?d\b)\s*{_UPRIGHT_UNIT}\s*{_UPRIGHT_UNIT}")
_DEGREES = regex(r"\\circ|\{\s*\\circ\s*\}")
_FUNCTIONS = "sin cos tan cot sec csc sinh cosh tanh arcsin arccos arctan exp ln log".split()
_ACCENTS = frozenset("dot ddot hat bar tilde".split())
_BRACKET = regex(r"[(\[]|\{\s*(?:\\left\s*)?\([^()]*\)\s*\}")
"""What holds all that a function is of: brackets, perhaps in braces, as other programs write."""
_BRACKETS = {"(": ")", "[": "]", "{": "}", "|": "|", r"\lvert": r"\rvert"}
_QUOTIENT_SIGNS = ("/", r"\div")
_PRODUCT_SIGNS = (r"\cdot", r"\times", "*", "⋅", "×", *_QUOTIENT_SIGNS)
_NO_FACTOR = frozenset(")]}|+-−=<>,;:.!'_^") | {r"\rvert", *_PRODUCT_SIGNS}
_NUMBER_ONE, _NUMBER_TWO = (Expression("number", 0, 0, text=digit) for digit in "12")
_REASONS = {
    ",": "a comma between digits may part two numbers",
    **{sign: f"`{sign}` has two values" for sign in (r"\pm", r"\mp")},
    **dict.fromkeys((r"\mathbf", r"\boldsymbol", r"\vec"), "it is a vector"),
    r"\lVert": "it is a norm",
    r"\begin": "it is an array",
    r"\log": "`\\log` has no one base: write `\\ln`, or `\\log_{10}`",
    r"\bmod": "it is a remainder",
    **dict.fromkeys(r"\dots \ldots \cdots \dotsc \dotsb".split(), "something is left out"),
}


def read_expression(tex: str, start: int, end: int) -> Expression:
    """Parse the TeX between two offsets, except for a full stop at its end.

    Raises:
        NotUnderstood: its meaning is unknown or ambiguous.
    """
    reader = _Reader(tex, start, end)
    expression = reader.sum()
    reader.take(".")
    if reader.peek():
        raise reader.not_understood()
    return expression


class _Reader:
    """Reads the TeX between two offsets."""

    def __init__(self, tex: str, start: int, end: int) -> None:
        self.tex, self.at, self.end = tex, start, end
        self.count = 0
        self.peeked: tuple[int, str] = (-1, "")
        """The offset of the last token that `peek` returned, and the token."""
        self.indices: frozenset[str] = frozenset()
        """The indices of the sums and products of which a term is read."""

    def peek(self) -> str:
        """Return the next token, past spaces; empty at the end."""
        if self.peeked[0] == self.at:  # each rule asks again
            return self.peeked[1]
        space = SPACE.match(self.tex, self.at, self.end)
        if space is not None:
            self.at = space.end()
        token = TOKEN.match(self.tex, self.at, self.end)
        self.peeked = self.at, token[0] if token else ""
        return self.peeked[1]

    def take(self, *signs: str) -> str:
        """Consume and return the next token if it is one of these."""
        sign = self.peek()
        if sign not in signs:
            return ""
        self.at += len(sign)
        return sign

    def match(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        """Match a pattern at the next token."""
        self.peek()
        return pattern.match(self.tex, self.at, self.end)

    def not_understood(self, reason: str = "") -> NotUnderstood:
        """Return the exception that says that the next token is not understood."""
        sign = self.peek()
        unknown = f"`{sign}` is not known" if sign else "something is missing"
        reason = reason or _REASONS.get(sign, unknown)
        return NotUnderstood(reason, self.at, min(self.end, self.at + max(1, len(sign))))

    def group(self) -> Expression:
        """Parse an argument: a group in braces, or a single token."""
        if self.take("{"):
            return self.bracket("}")
        digit = self.peek()
        if digit.isdecimal():
            self.at += 1
            return Expression("number", self.at - 1, self.at, text=digit)
        return self.base()

    def raw(self) -> str:
        """Return the text of an argument."""
        if not self.take("{"):
            sign = self.peek()
            self.at += len(sign)
            return sign
        start, depth = self.at, 1
        while depth and self.at < self.end:
            sign = TOKEN.match(self.tex, self.at)[0]  # type: ignore[index]  # it matches any text
            depth += (sign == "{") - (sign == "}")
            self.at += len(sign)
        return re.sub(r"\s+", "", self.tex[start : self.at - 1])

    def sum(self) -> Expression:
        """Parse terms with signs between them."""
        self.peek()
        start = self.at
        sign = self.take("+", "-", "−")
        total = self.product()
        if sign in ("-", "−"):
            total = Expression("-", start, self.at, (total,))
        while sign := self.take("+", "-", "−"):
            term = self.product()
            total = Expression("+" if sign == "+" else "-", start, self.at, (total, term))
        return total

    def product(self) -> Expression:
        """Parse factors, with signs between them or side by side."""
        product = self.power()
        is_quotient = False
        while True:
            sign = self.take(*_PRODUCT_SIGNS)
            if not sign and not self.begins_factor():
                return product
            if is_quotient:
                raise self.not_understood("what `/` divides by can be read in two ways")
            start = self.at
            unit = None if sign and sign not in ("/", r"\cdot") else self.unit()
            if sign and unit is not None:
                product = join_units(product, sign, unit)
                continue
            factor = unit
            if factor is None:
                minus = self.take("-") if sign else ""
                factor = self.power()
                if minus:
                    factor = Expression("-", start, self.at, (factor,))
                is_run = self.tex[start] in ".0123456789"
                is_run &= SPACE.sub("", self.tex[product.start : start])[-1:] != "!"
                if not sign and (is_run or is_mixed(product, factor)):
                    raise factor.not_understood("two numbers stand side by side")
                is_spaced = self.tex[:start].rstrip().endswith(r"\,")
                is_name = product.kind == "symbol" or product.ends_in_unit()
                if not (sign or is_spaced) and is_name and self.tex[start] in "([":
                    # The name can be a function of what the bracket holds.
                    content = factor.parts[0] if factor.kind in ("^", "factorial") else factor
                    if content.kind in ("symbol", "number", "/", "*"):
                        raise content.not_understood("it may be a product or a function of this")
            is_quotient = sign in _QUOTIENT_SIGNS
            unit = self.unit() if is_quotient else None
            if unit is not None and product.has("unit"):  # `10 m/2 s`, unlike `1/2 m`
                factor, unit = Expression("*", start, self.at, (factor, unit)), None
            kind = "/" if is_quotient else "*"
            product = Expression(kind, product.start, self.at, (product, factor))
            if unit is not None:
                product = Expression("*", product.start, self.at, (product, unit), OF_QUOTIENT)

    def begins_factor(self) -> bool:
        """Whether another factor begins here, with no sign before it."""
        sign = self.peek()
        if not sign or self.match(_DIFFERENTIAL):
            return False
        return sign not in _NO_FACTOR and (sign != "." or self.match(_NUMBER) is not None)

    def unit(self) -> Expression | None:
        """Parse a unit, if there is one: an upright group, but no differential and no constant."""
        self.peek()
        start = self.at
        if self.take(r"\%"):
            return Expression("unit", start, self.at, text="%")
        if (upright := self.match(_UPRIGHT)) is None:
            return None
        self.at = upright.end()
        text = plain_unit(self.raw())
        if text in ("d", "e"):
            self.at = start
            return None
        exponent = "^" + self.raw() if self.take("^") else ""
        return Expression("unit", start, self.at, text=text + exponent)

    def power(self, in_function: bool = False) -> Expression:
        """Parse a base with its factorial and its exponent.

        `in_function`: as a factor of what a function without brackets is of.
        """
        power = self.base()
        if self.take("!"):
            power = Expression("factorial", power.start, self.at, (power,))
        if self.take("^"):
            if self.match(_DEGREES):
                self.raw()
                return self.degrees(power)
            if in_function:
                raise self.not_understood("the power may be of the function, or of what it is of")
            if self.peek() in ("*", "'", r"\prime", r"\top"):
                raise self.not_understood()
            exponent = self.group()
            if exponent.kind == "symbol" and exponent.text == "T":
                raise exponent.not_understood("it may be a transpose")
            power = Expression("^", power.start, self.at, (power, exponent))
        if self.take("°"):
            return self.degrees(power)
        if self.peek() in ("!", "'", "_", "^"):
            raise self.not_understood()
        return power

    def degrees(self, number: Expression) -> Expression:
        """Return a number of degrees, whose sign has been consumed: of an angle or a scale."""
        scale = self.match(_SCALE)
        if scale is not None:
            self.at = scale.end()
        text = f"°{scale[1] or scale[2]}" if scale is not None else "deg"
        unit = Expression("unit", number.end, self.at, text=text)
        return Expression("*", number.start, self.at, (number, unit))

    def base(self) -> Expression:
        """Parse a number, a symbol, a group, a fraction, a root or a function."""
        sign, start = self.peek(), self.at
        self.count += 1
        if self.count > _MAX_FACTORS:
            raise self.not_understood("it is too long")
        if number := self.match(_NUMBER):
            self.at = number.end()
            digits = re.sub(r"[^0-9.]", "", number[0])
            if re.match("0[0-9]", digits):
                raise NotUnderstood("a number with leading zeros may be binary", start, self.at)
            if _E_NOTATION.match(self.tex, self.at, self.end):
                raise NotUnderstood("it may be a power of ten", start, self.at)
            return Expression("number", start, self.at, text=digits)
        if quantity := QUANTITY.match(self.tex, start, self.end):
            self.at = quantity.end()
            text = write_quantities(quantity[0])
            try:
                return read_expression(text, 0, len(text)).move(start, self.at)
            except NotUnderstood as error:
                raise NotUnderstood(error.reason, start, self.at) from None
        self.at += len(sign)
        if sign in _BRACKETS:
            inner = self.bracket(_BRACKETS[sign])
            if sign in ("|", r"\lvert"):
                return Expression("abs", start, self.at, (inner,), inner.text)
            return Expression(inner.kind, start, self.at, inner.parts, inner.text)
        if sign in (r"\frac", r"\tfrac", r"\dfrac"):
            return self.fraction(start)
        if sign == r"\sqrt":
            index = self.bracket("]") if self.take("[") else _NUMBER_TWO
            root = Expression("/", start, start, (_NUMBER_ONE, index))
            return Expression("^", start, self.at, (self.group(), root))
        if sign in (r"\underbrace", r"\overbrace"):
            inner = self.group()
            _ = self.take("_", "^") and self.raw()
            return inner
        if sign in (r"\binom", r"\tbinom", r"\dbinom"):
            return Expression("binom", start, self.at, (self.group(), self.group()))
        if sign in (r"\sum", r"\prod"):
            return self.series(sign[1:], start)
        if sign == r"\int":
            return self.integral(start)
        if sign[1:] in _FUNCTIONS and (sign != r"\log" or self.peek() == "_"):
            return self.function(sign[1:], start)
        self.at = start
        if (upright := self.match(_UPRIGHT)) and self.tex[upright.end() :].startswith(("e", "{e}")):
            self.at = upright.end()
            self.raw()
            return Expression("symbol", start, self.at, text=r"\mathrm{e}")
        return self.symbol()

    def bracket(self, end: str) -> Expression:
        """Parse the rest of a bracket, up to its end."""
        inner = self.sum()
        if not self.take(end):
            raise self.not_understood()
        return inner

    def symbol(self) -> Expression:
        """Parse a letter with its accent and its subscript."""
        sign, start = self.peek(), self.at
        name = sign.lstrip("\\")
        self.at += len(sign)
        if name in _ACCENTS:
            inner = self.raw()
            if not _LETTER.fullmatch(inner):
                raise NotUnderstood("an accent stands over more than a letter", start, self.at)
            text = f"\\{name}{{{inner}}}"
        elif re.fullmatch("[A-Za-z]", sign) or name in SYMBOLS:
            text = sign
        else:
            self.at = start
            raise self.not_understood()
        if self.take("_"):
            upright = self.match(_UPRIGHT)  # `m_\text{eff}`
            self.at = upright.end() if upright else self.at
            index = self.raw()
            text += f"_{{{_UPRIGHT.sub('', index).strip('{}') if upright is None else index}}}"
            if self.indices & {*TOKEN.findall(index)}:
                raise NotUnderstood("it may differ from term to term", start, self.at)
        if text in self.indices:
            return Expression("index", start, self.at, text=text)
        while self.take("'"):
            text += "'"
        if text == "e" and self.peek() == "^":
            text = r"\mathrm{e}"
        return Expression("symbol", start, self.at, text=text)

    def fraction(self, start: int) -> Expression:
        """Parse a fraction or a derivative."""
        if units := self.match(_UNIT_FRACTION):
            self.at = units.end()
            text = "/".join(f"({plain_unit(unit)})" for unit in units.groups())
            return Expression("unit", start, self.at, text=text)
        numerator_start = self.at
        if self.take("{") and self.match(_DIFFERENTIAL):
            return self.derivative(start)
        self.at = numerator_start
        return Expression("/", start, self.at, (self.group(), self.group()))

    def derivative(self, start: int) -> Expression:
        """Parse the rest of a derivative, of a function in its numerator or after it."""
        self.at = self.match(_DIFFERENTIAL).end()  # type: ignore[union-attr]  # it is the next token
        function = None if self.peek() == "}" else self.sum()
        if not (self.take("}") and self.take("{") and (denominator := self.match(_DIFFERENTIAL))):
            raise self.not_understood("only first derivatives are understood")
        self.at = denominator.end()
        symbol = self.symbol()
        if not self.take("}"):
            raise self.not_understood("only first derivatives are understood")
        parts = (self.product() if function is None else function, symbol)
        return Expression("derivative", start, self.at, parts)

    def integral(self, start: int) -> Expression:
        """Parse an integral up to its differential."""
        limits: dict[str, Expression] = {}
        while sign := self.take("_", "^"):
            limits[sign] = self.group()
        if self.match(_DIFFERENTIAL):
            raise self.not_understood("the differential stands before what is integrated")
        integrand = self.sum()
        differential = self.match(_DIFFERENTIAL)
        if differential is None or len(limits) == 1:
            raise self.not_understood("the integral has no differential, or no limits")
        self.at = differential.end()
        symbol = self.symbol()
        ends = (limits["_"], limits["^"]) if limits else ()
        return Expression("integral", start, self.at, (integrand, symbol, *ends))

    def series(self, name: str, start: int) -> Expression:
        """Parse a sum or a product of a product's terms, from one whole number to another."""
        limits: dict[str, Expression] = {}
        index = None
        while sign := self.take("_", "^"):
            if sign == "^" or not self.take("{"):
                limits[sign] = self.group()
                continue
            symbol = self.symbol()
            index = Expression("index", symbol.start, symbol.end, text=symbol.text)
            if not self.take("="):
                raise self.not_understood("it is not over whole numbers in a row")
            limits[sign] = self.bracket("}")
        if index is None or len(limits) < 2:
            raise NotUnderstood(f"`\\{name}` has no limits", start, self.at)
        outer, self.indices = self.indices, self.indices | {index.text}
        term = self.product()
        self.indices = outer
        if name == "prod" and term.kind in ("*", "/"):
            first, last = term.parts
            signs = TOKEN.findall(self.tex, first.end, last.start)
            is_behind = last.kind == "unit" or not {*signs}.isdisjoint(_PRODUCT_SIGNS)
            if is_behind and not any(part.text == index.text for part in last.walk()):
                raise last.not_understood("it may be a factor of the product, or of each term")
        return Expression(name, start, self.at, (term, index, limits["_"], limits["^"]))

    def function(self, name: str, start: int) -> Expression:
        """Parse a function of a bracket, or of the factors that follow."""
        base = self.group() if name == "log" and self.take("_") else None
        exponent = self.group() if self.take("^") else None
        if exponent is not None and exponent.kind != "number":
            raise exponent.not_understood("an inverse or a power can be meant")
        argument = self.base() if self.match(_BRACKET) else self.argument()
        value = Expression(name if base is None else "ln", start, self.at, (argument,))
        if base is not None:
            parts = value, Expression("ln", start, start, (base,))
            value = Expression("/", start, self.at, parts)
        end = self.at
        if self.peek() in ("°", "!") or (self.take("^") and (exponent or self.match(_DEGREES))):
            raise self.not_understood("it may be of the function, or of what it is of")
        self.at = end
        return value if exponent is None else Expression("^", start, end, (value, exponent))

    def argument(self) -> Expression:
        """Parse the factors that a function without brackets is of."""
        argument = self.power(in_function=True)
        while True:
            end = self.at
            sign = self.take(*_PRODUCT_SIGNS)
            is_function = self.peek()[1:] in _FUNCTIONS
            is_spaced = re.search(r"\\[,;: ]", self.tex[end : self.at]) is not None
            is_angle = argument.kind == "*" and argument.parts[1].text == "deg"
            is_outside = is_function or (is_angle and bool(sign))
            if not (sign or self.begins_factor()) or (is_outside and sign not in _QUOTIENT_SIGNS):
                self.at = end
                return argument
            if sign or is_spaced or self.peek() in _BRACKETS:
                raise self.not_understood("it may be a factor of the function, or of what it is of")
            factor = self.power(in_function=True)
            argument = Expression("*", argument.start, self.at, (argument, factor), SIDE_BY_SIDE)
