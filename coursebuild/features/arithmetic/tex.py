r"""TeX → expressions: the part of its mathematics whose meaning is certain.

Entry point: `read_expression(tex, start, end)`, by recursive descent. A number, a symbol or a group
beside another is a product; what can be read in two ways (`a/bc`, `f(x)`, `2\tfrac12`) is not
understood. A number is `12`, `1\,000`, `1{,}000` or `0.5`; `\mathrm{kg}` behind it is its unit.
"""

from __future__ import annotations

import re

from coursebuild.features.arithmetic.expressions import Expression, NotUnderstood

_MOST = 100
"""Factors of an expression, so that nothing nests deeper."""
TOKEN = re.compile(r"\\[A-Za-z]+\*?|\\[\s\S]|[\s\S]")
SPACE = re.compile(
    r"(?:\s|&|~|\\[,;:! ]|\\(?:left|right|[bB]igg?[lrm]?|displaystyle|textstyle|nolimits|limits"
    r"|nonumber|thinspace)(?![A-Za-z])\.?|\{\}|\\\\)+"
)
_NUMBER = re.compile(
    r"(?:[0-9]{1,3}(?:(?:\{,\}|\\[,;: ]|~)[0-9]{3})+(?![0-9])|[0-9]+)(?:\.[0-9]+)?|\.[0-9]+"
)
_LETTER = re.compile(r"[A-Za-z]|\\[A-Za-z]+")
_DIFFERENTIAL = re.compile(r"\\mathrm\s*(?:\{\s*d\s*\}|d)|\\partial(?![A-Za-z])")
_UPRIGHT = re.compile(r"\\(?:mathrm|text|textrm|operatorname|mathit)(?![A-Za-z])\s*")
_DEGREES = re.compile(r"\\circ|\{\s*\\circ\s*\}")
_FUNCTIONS = frozenset("sin cos tan cot sec csc sinh cosh tanh arcsin arccos arctan exp ln".split())
GREEK = frozenset(
    "alpha beta gamma delta epsilon varepsilon zeta eta theta vartheta iota kappa lambda mu nu xi"
    " rho varrho sigma tau upsilon phi varphi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma"
    " Upsilon Phi Psi Omega ell hbar infty pi".split()
)
_ACCENTS = frozenset("dot ddot hat bar tilde".split())
_FRACTIONS = frozenset((r"\frac", r"\tfrac", r"\dfrac"))
_BRACKETS = {"(": ")", "[": "]", "{": "}", "|": "|", r"\lvert": r"\rvert"}
_AFTER = frozenset(")]}|+-−=<>,;:.!'_^/*") | {r"\rvert", r"\cdot", r"\times", r"\div", "⋅", "×"}
_ONE, _TWO = (Expression("number", 0, 0, text=digit) for digit in "12")
_ODD = {
    ",": "a comma between digits may part two numbers",
    r"\pm": "`\\pm` has two values",
    r"\mp": "`\\mp` has two values",
    r"\mathbf": "it is a vector",
    r"\boldsymbol": "it is a vector",
    r"\vec": "it is a vector",
    r"\lVert": "it is a norm",
    r"\begin": "it is an array",
    r"\log": "the base of `\\log` is not said",
}
_ODD |= {rf"\{name}": "something is left out" for name in "dots ldots cdots dotsc dotsb".split()}


def read_expression(tex: str, start: int, end: int) -> Expression:
    """What stands between two offsets, but for a full stop at its end.

    Raises:
        NotUnderstood: it has another meaning, several, or none.
    """
    reader = _Reader(tex, start, end)
    found = reader.sum()
    reader.takes(".")
    if reader.peek():
        raise reader.odd()
    return found


class _Reader:
    """Reads the TeX between two offsets."""

    def __init__(self, tex: str, start: int, end: int) -> None:
        self.tex, self.at, self.end = tex, start, end
        self.count = 0
        self.seen: tuple[int, str] = (-1, "")
        """Where the last token that was looked at stands, and the token."""

    # --- tokens

    def peek(self) -> str:
        """The next token, past spaces; empty at the end."""
        if self.seen[0] == self.at:  # each rule asks again
            return self.seen[1]
        space = SPACE.match(self.tex, self.at, self.end)
        if space is not None:
            self.at = space.end()
        found = TOKEN.match(self.tex, self.at, self.end)
        self.seen = self.at, found[0] if found is not None else ""
        return self.seen[1]

    def takes(self, *signs: str) -> str:
        """The next token, passed over, where it is one of these."""
        sign = self.peek()
        if not sign or sign not in signs:
            return ""
        self.at += len(sign)
        return sign

    def match(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        """What of a pattern stands next, past spaces."""
        self.peek()
        return pattern.match(self.tex, self.at, self.end)

    def odd(self, reason: str = "") -> NotUnderstood:
        """That what stands next is not understood."""
        sign = self.peek()
        if not reason:
            reason = _ODD.get(sign, f"`{sign}` is not known" if sign else "something is missing")
        return NotUnderstood(reason, self.at, min(self.end, self.at + max(1, len(sign))))

    def group(self) -> Expression:
        """An argument: a group in braces, or what a single token is."""
        if self.takes("{"):
            return self.bracket("}")
        digit = self.peek()
        if digit.isascii() and digit.isdigit():
            self.at += 1
            return Expression("number", self.at - 1, self.at, text=digit)
        return self.base()

    def raw(self) -> str:
        """The text of an argument."""
        if not self.takes("{"):
            sign = self.peek()
            self.at += len(sign)
            return sign
        start, depth = self.at, 1
        while depth and self.at < self.end:
            sign = TOKEN.match(self.tex, self.at)[0]  # type: ignore[index]  # it matches any text
            depth += (sign == "{") - (sign == "}")
            self.at += len(sign)
        return re.sub(r"\s+", "", self.tex[start : self.at - 1])

    # --- grammar

    def sum(self) -> Expression:
        """Terms with signs between."""
        self.peek()
        start = self.at
        sign = self.takes("+", "-", "−")
        found = self.product()
        if sign in ("-", "−"):
            found = Expression("-", start, self.at, (found,))
        while sign := self.takes("+", "-", "−"):
            term = self.product()
            found = Expression("+" if sign == "+" else "-", start, self.at, (found, term))
        return found

    def product(self) -> Expression:
        """Factors, with signs between or side by side."""
        found = self.power()
        divided = False
        while True:
            sign = self.takes(r"\cdot", r"\times", "*", "/", r"\div", "⋅", "×")
            if not sign and not self.begins():
                return found
            if divided:
                raise self.odd("what `/` divides by can be read in two ways")
            start = self.at
            factor = self.unit() if not sign else None
            if factor is None:
                minus = self.takes("-") if sign else ""
                factor = self.power()
                if minus:
                    factor = Expression("-", start, self.at, (factor,))
                if not sign and (_begins_with_digit(factor) or _is_mixed(found, factor)):
                    raise factor.not_understood("two numbers stand side by side")
                if not sign and found.kind == "symbol" and self.tex[start] in "([":
                    _refuse_application(factor)
            divided = sign in ("/", r"\div")
            unit = self.unit() if divided else None
            if unit is not None and found.has("unit"):  # `10 m/2 s`, and else `1/2 m`
                factor, unit = Expression("*", start, self.at, (factor, unit)), None
            found = Expression("/" if divided else "*", found.start, self.at, (found, factor))
            if unit is not None:
                found = Expression("*", found.start, self.at, (found, unit))

    def begins(self) -> bool:
        """Whether a factor begins here, side by side with the one before."""
        sign = self.peek()
        if not sign or self.match(_DIFFERENTIAL):
            return False
        return sign not in _AFTER and (sign != "." or self.match(_NUMBER) is not None)

    def unit(self) -> Expression | None:
        """The unit that stands here: an upright group that is no differential and no constant."""
        self.peek()
        start = self.at
        if self.takes(r"\%"):
            return Expression("unit", start, self.at, text="%")
        found = self.match(_UPRIGHT)
        if found is None:
            return None
        self.at = found.end()
        text = self.raw()
        if text in ("d", "e"):
            self.at = start
            return None
        power = ""
        if self.takes("^"):
            power = "^" + self.raw()
        return Expression("unit", start, self.at, text=unit_text(text) + power)

    def power(self) -> Expression:
        """A base with what is raised behind it."""
        found = self.base()
        while self.takes("^"):
            if self.match(_DEGREES):
                self.raw()
                return self.degrees(found)
            if self.peek() in ("*", "'", r"\prime", r"\top") or found.kind == "^":
                raise self.odd()
            exponent = self.group()
            found = Expression("^", found.start, self.at, (found, exponent))
        if self.takes("°"):
            return self.degrees(found)
        if self.peek() in ("!", "'", "_"):
            raise self.odd()
        return found

    def degrees(self, number: Expression) -> Expression:
        """A number of degrees, of which the sign was passed."""
        unit = Expression("unit", number.end, self.at, text="deg")
        return Expression("*", number.start, self.at, (number, unit))

    def base(self) -> Expression:
        """A number, a symbol, a group, a fraction, a root or a function."""
        sign = self.peek()
        start = self.at
        self.count += 1
        if self.count > _MOST:
            raise self.odd("it is too long")
        if number := self.match(_NUMBER):
            self.at = number.end()
            digits = re.sub(r"[^0-9.]", "", number[0])
            return Expression("number", start, self.at, text=digits)
        if sign in _BRACKETS:
            self.at += len(sign)
            found = self.bracket(_BRACKETS[sign])
            bars = sign in ("|", r"\lvert")
            parts = (found,) if bars else found.parts
            return Expression("abs" if bars else found.kind, start, self.at, parts, found.text)
        self.at += len(sign)
        if sign in _FRACTIONS:
            return self.fraction(start)
        if sign == r"\sqrt":
            index = self.bracket("]") if self.takes("[") else _TWO
            root = Expression("/", start, start, (_ONE, index))
            return Expression("^", start, self.at, (self.group(), root))
        if sign in (r"\underbrace", r"\overbrace"):
            found = self.group()
            if self.takes("_", "^"):
                self.raw()
            return found
        if sign == r"\int":
            return self.integral(start)
        if sign.lstrip("\\") in _FUNCTIONS and sign != sign.lstrip("\\"):
            return self.function(sign[1:], start)
        self.at = start
        if (upright := self.match(_UPRIGHT)) and self.tex[upright.end() :].startswith(("e", "{e}")):
            self.at = upright.end()
            self.raw()
            return Expression("symbol", start, self.at, text=r"\mathrm{e}")
        return self.symbol(start)

    def bracket(self, end: str) -> Expression:
        """What stands before the end of a bracket."""
        found = self.sum()
        if not self.takes(end):
            raise self.odd()
        return found

    def symbol(self, start: int) -> Expression:
        """A letter with its accent and its subscript."""
        sign = self.peek()
        name = sign.lstrip("\\")
        self.at += len(sign)
        if name in _ACCENTS and sign != name:
            inner = self.raw()
            if not _LETTER.fullmatch(inner):
                raise NotUnderstood("an accent stands over more than a letter", start, self.at)
            text = f"\\{name}{{{inner}}}"
        elif re.fullmatch("[A-Za-z]", sign) or name in GREEK:
            text = sign
        else:
            self.at = start
            raise self.odd()
        if self.takes("_"):
            text += f"_{{{self.raw()}}}"
        while self.takes("'"):
            text += "'"
        if text == "e" and self.peek() == "^":
            text = r"\mathrm{e}"
        return Expression("symbol", start, self.at, text=text)

    def fraction(self, start: int) -> Expression:
        """A fraction, or a derivative."""
        mark = self.at
        top_braced = self.takes("{")
        if self.match(_DIFFERENTIAL):
            if not top_braced:
                raise self.odd()
            return self.derivative(start)
        self.at = mark
        return Expression("/", start, self.at, (self.group(), self.group()))

    def derivative(self, start: int) -> Expression:
        """A derivative whose fraction was begun: of what its numerator has, or what follows."""
        self.at = self.match(_DIFFERENTIAL).end()  # type: ignore[union-attr]  # it was seen
        what = None if self.peek() == "}" else self.sum()
        if not (self.takes("}") and self.takes("{") and (by := self.match(_DIFFERENTIAL))):
            raise self.odd("only first derivatives are understood")
        self.at = by.end()
        self.peek()
        symbol = self.symbol(self.at)
        if not self.takes("}"):
            raise self.odd("only first derivatives are understood")
        parts = (self.product() if what is None else what, symbol)
        return Expression("derivative", start, self.at, parts)

    def integral(self, start: int) -> Expression:
        """An integral up to its differential."""
        limits: dict[str, Expression] = {}
        while sign := self.takes("_", "^"):
            limits[sign] = self.group()
        if self.match(_DIFFERENTIAL):
            raise self.odd("the differential stands before what is integrated")
        what = self.sum()
        by = self.match(_DIFFERENTIAL)
        if by is None or len(limits) == 1:
            raise self.odd("the integral has no differential, or no limits")
        self.at = by.end()
        self.peek()
        symbol = self.symbol(self.at)
        ends = (limits["_"], limits["^"]) if limits else ()
        return Expression("integral", start, self.at, (what, symbol, *ends))

    def function(self, name: str, start: int) -> Expression:
        """A function of a bracket, or of the factors that follow."""
        exponent = None
        if self.takes("^"):
            exponent = self.group()
            if exponent.kind != "number":
                raise exponent.not_understood("an inverse or a power can be meant")
        alone = self.peek() in _BRACKETS
        what = self.power()
        while not alone and self.begins() and self.peek()[1:] not in _FUNCTIONS:
            if self.peek() in _BRACKETS:
                raise self.odd("it may be a factor of the function, or of what it is of")
            factor = self.power()
            what = Expression("*", what.start, self.at, (what, factor))
        found = Expression(name, start, self.at, (what,))
        return Expression("^", start, self.at, (found, exponent)) if exponent else found


def _begins_with_digit(factor: Expression) -> bool:
    while factor.kind in ("^", "*") and factor.parts:
        factor = factor.parts[0]
    return factor.kind == "number"


def _is_mixed(left: Expression, right: Expression) -> bool:
    """Whether a whole number stands before a fraction of numbers."""
    plain = right.kind == "/" and all(part.kind == "number" for part in right.parts)
    while left.kind in ("*", "-") and left.parts:
        left = left.parts[-1]
    return plain and left.kind == "number"


def _refuse_application(factor: Expression) -> None:
    """A symbol before a bracket may be a function of what is in it."""
    if factor.kind in ("symbol", "number", "/", "*"):
        raise factor.not_understood("it may be a product or a function of this")


def unit_text(tex: str) -> str:
    r"""A unit as text: `kg*m^2` for `kg\,m^2`."""
    text = re.sub(r"\\[,;: ]|\\cdot|~|·", "*", tex)
    text = text.replace(r"\mu", "µ").replace(r"\Omega", "Ω").replace(r"\%", "%")
    return re.sub(r"\^\{(-?\d+)\}", r"^\1", text).strip("*")
