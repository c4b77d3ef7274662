"""Real numbers that know how far they are known.

A `Real` is exact where it is a rational number times the root of a whole number and a power of π,
as are 3/4, 2√3 and π/6. Any other is a ball of FLINT: a number with a proven bound of its error,
some 300 digits small. What is computed with them is true of every number in the ball, so `sign` is
certain where it says anything. In integrands a ball is complex, as FLINT integrates analytic
functions.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from math import gcd
from typing import Any

from flint import acb, arb, ctx, fmpq, fmpz
from msgspec import Struct

ctx.prec = 1024  # a sine takes 16 µs; a lower precision to begin with would save too little
_MAX_BITS = 10_000
"""The limit for numerators and denominators, and for the exponents of balls."""
_MAX_RADICAND_BITS = 128
_NAMES = {"ln": "log", "arcsin": "asin", "arccos": "acos", "arctan": "atan"}
"""Names of functions in FLINT, where they differ from those in TeX."""
_RECIPROCALS = {"cot": "tan", "sec": "cos", "csc": "sin"}
_HALF = Fraction(1, 2)
_SQUARED_SINES = {
    Fraction(0): Fraction(0),
    Fraction(1, 6): Fraction(1, 4),
    Fraction(1, 4): _HALF,
    Fraction(1, 3): Fraction(3, 4),
    _HALF: Fraction(1),
}
"""The squared sines of multiples of π."""


class _Form(Struct, frozen=True):
    """A rational number times the root of a whole number without square factors, times π^power."""

    factor: Fraction
    radicand: int = 1
    power: int = 0


class Real:
    """A real number, exact or a ball."""

    __slots__ = ("_ball", "form")

    def __init__(self, form: _Form | None = None, ball: Any = None) -> None:
        """Either is given."""
        if form is not None and max(map(_bits, form.factor.as_integer_ratio())) > _MAX_BITS:
            raise OverflowError
        self.form = _Form(Fraction(0)) if form is not None and form.factor == 0 else form
        self._ball = ball

    @classmethod
    def of(cls, number: Fraction | int | str) -> Real:
        """A rational number."""
        return cls(_Form(Fraction(number)))

    @property
    def ball(self) -> Any:
        """The ball that encloses it."""
        if self.form is None:
            return self._ball
        ball = arb(fmpq(*self.form.factor.as_integer_ratio()))
        if self.form.radicand != 1:
            ball *= arb(self.form.radicand).sqrt()
        return ball * arb.pi() ** self.form.power if self.form.power else ball

    @property
    def rational(self) -> Fraction | None:
        """Its exact value, if it is known to be a rational number."""
        is_rational = self.form is not None and self.form.radicand == 1 and self.form.power == 0
        return self.form.factor if self.form is not None and is_rational else None

    @property
    def whole(self) -> int | None:
        """Its exact value, if it is known to be a whole number."""
        rational = self.rational
        return int(rational) if rational is not None and rational.denominator == 1 else None

    @property
    def has_end(self) -> bool:
        """Whether it is known that its decimals end."""
        divisor = 0 if self.rational is None else self.rational.denominator
        return divisor != 0 and pow(10, divisor.bit_length(), divisor) == 0

    @property
    def is_finite(self) -> bool:
        """Whether it is certainly a number."""
        return self.form is not None or bool(self.ball.is_finite())

    def sign(self) -> int | None:
        """1, 0 or -1; `None` if the ball does not tell."""
        if self.form is not None:
            return (self.form.factor > 0) - (self.form.factor < 0)
        if isinstance(self.ball, acb):
            return None
        if self.ball > 0:
            return 1
        return -1 if self.ball < 0 else None

    def widen(self, width: Real) -> Real:
        """Return the ball of all numbers within half of this width."""
        return Real(ball=self.ball + arb(0, abs(width.ball).upper() / 2))

    def is_negligible(self, *sizes: Real) -> bool:
        """Whether it is certainly nothing beside these, or beside all that is computed with."""
        size = sum((abs(size.ball) for size in sizes), arb(0))
        return bool(abs(self.ball) <= size * arb(2) ** -60 or abs(self.ball) <= arb(2) ** -300)

    def __hash__(self) -> int:
        return hash(self.form or str(self.ball))

    def __eq__(self, right: object) -> bool:
        """Whether it is known in the same way, as a key of caches asks."""
        if not isinstance(right, Real):
            return NotImplemented
        return (self.form or str(self.ball)) == (right.form or str(right.ball))

    def __float__(self) -> float:
        return float(self.ball)

    def __format__(self, spec: str) -> str:
        rational = self.rational
        if rational is not None:
            return format(Decimal(rational.numerator) / Decimal(rational.denominator), spec)
        return format(Decimal(self.ball.str(60, radius=False)), spec)

    def __add__(self, right: Real) -> Real:
        first, second = self.form, right.form
        if first is not None and second is not None:
            if first.factor == 0 or second.factor == 0:
                return self if second.factor == 0 else right
            if (first.radicand, first.power) == (second.radicand, second.power):
                return Real(_Form(first.factor + second.factor, first.radicand, first.power))
        return Real(ball=self.ball + right.ball)

    def __neg__(self) -> Real:
        return self * Real.of(-1)

    def __sub__(self, right: Real) -> Real:
        return self + -right

    def __mul__(self, right: Real) -> Real:
        first, second = self.form, right.form
        if first is None or second is None:
            return Real(ball=self.ball * right.ball)
        common = gcd(first.radicand, second.radicand)
        radicand = first.radicand * second.radicand // common**2
        factor = first.factor * second.factor * common
        return Real(_Form(factor, radicand, first.power + second.power))

    def __truediv__(self, right: Real) -> Real:
        form = right.form
        if form is None:
            return Real(ball=self.ball / right.ball)
        return self * Real(_Form(1 / (form.factor * form.radicand), form.radicand, -form.power))

    def abs(self, analytic: bool = False) -> Real:
        """Its size; where it must be analytic, no number around zero."""
        if self.form is not None:
            return Real(_Form(abs(self.form.factor), self.form.radicand, self.form.power))
        is_complex = isinstance(self.ball, acb)
        return Real(ball=self.ball.real_abs(analytic=analytic) if is_complex else abs(self.ball))

    def raise_to(self, exponent: Real, analytic: bool = False) -> Real:
        """This number to the power of another.

        Raises:
            ValueError: it is no real number, as the root of -1, or contested, as 0^0.
            OverflowError: it is too large to be computed.
        """
        rational = exponent.rational
        if self.form is not None and self.form.factor <= 0:
            if rational is None or (self.form.factor == 0 and rational == 0):
                raise ValueError
            if self.form.factor < 0 and rational.denominator != 1:
                raise ValueError
        if self.form is not None and rational is not None:
            root = _find_root(self.form, rational.denominator)
            if root is not None:
                return _raise(root, rational.numerator)
        base, power = self.ball, exponent.ball
        if abs(power) > 2**64:
            raise OverflowError
        if rational == 0 and isinstance(base, arb):
            return ONE if self.sign() else Real(ball=arb.nan())
        if rational is not None and rational.denominator == 1:
            return Real(ball=base ** int(rational))
        if isinstance(base, acb) or isinstance(power, acb):
            return Real(ball=acb(base).pow(acb(power), analytic=analytic))
        return Real(ball=base.sqrt() if rational == _HALF else base**power)


def _bits(number: int) -> int:
    return abs(number).bit_length()


PI = Real(_Form(Fraction(1), power=1))
ONE = Real.of(1)
E = Real(ball=arb.const_e())


def _find_root(form: _Form, degree: int) -> Real | None:
    """The root of a number that is not negative, if it is exact."""
    if degree == 1:
        return Real(form)
    if form.radicand != 1 or form.power % degree:
        return None
    numerator, denominator = form.factor.as_integer_ratio()
    radicand = 1
    if degree == 2 and _bits(product := numerator * denominator) <= _MAX_RADICAND_BITS and product:
        # √(n/d) = √(nd)/d
        for prime, exponent in fmpz(product).factor():
            radicand *= int(prime) ** (exponent % 2)
        numerator, denominator = product // radicand, denominator**2
    roots = [int(fmpz(part).root(degree)) for part in (numerator, denominator)]
    if [root**degree for root in roots] != [numerator, denominator]:
        return None
    return Real(_Form(Fraction(*roots), radicand, form.power // degree))


def _raise(base: Real, exponent: int) -> Real:
    form = base.form
    assert form is not None
    size = max(map(_bits, form.factor.as_integer_ratio())) + _bits(form.radicand)
    if size * abs(exponent) > 2 * _MAX_BITS:
        raise OverflowError
    if exponent < 0:
        return _raise(ONE / base, -exponent)
    factor = form.factor**exponent * form.radicand ** (exponent // 2)
    return Real(_Form(factor, form.radicand ** (exponent % 2), form.power * exponent))


def apply(name: str, argument: Real, analytic: bool = False) -> Real:
    """Return the value of a function, by its name in TeX.

    Raises:
        ValueError: it is certainly no real number.
    """
    if name in _RECIPROCALS:
        return ONE / apply(_RECIPROCALS[name], argument, analytic)
    exact = _apply_exactly(name, argument) if argument.form is not None else None
    if name == "ln" and argument == E:
        exact = ONE
    if exact is not None:
        return exact
    ball = argument.ball
    if isinstance(ball, arb) and (
        (name == "ln" and ball <= 0) or (name in ("arcsin", "arccos") and abs(ball) > 1)
    ):
        raise ValueError
    if not isinstance(ball, acb):
        return Real(ball=getattr(ball, _NAMES.get(name, name))())
    if name == "ln":
        return Real(ball=ball.log(analytic=analytic))
    if name == "arctan":  # FLINT does not say whether these are analytic
        logs = [(1 + sign * ball * acb(0, 1)).log(analytic=analytic) for sign in (1, -1)]
        return Real(ball=(logs[1] - logs[0]) * acb(0, 1) / 2)
    if name in ("arcsin", "arccos"):
        root = (1 - ball * ball).sqrt(analytic=analytic)
        arcsine = -acb(0, 1) * (ball * acb(0, 1) + root).log(analytic=analytic)
        return Real(ball=arcsine if name == "arcsin" else acb.pi() / 2 - arcsine)
    return Real(ball=getattr(ball, name)())


def _apply_exactly(name: str, argument: Real) -> Real | None:
    """Return the exact value of a function, if it is known."""
    assert argument.form is not None
    is_angle = argument.form.radicand == 1 and argument.form.power == 1
    turn = argument.form.factor if is_angle or argument.form.factor == 0 else None
    match name:
        case "sin" if turn is not None:
            return _sine(turn)
        case "cos" if turn is not None:
            return _sine(turn + _HALF)
        case "tan" if turn is not None:
            sine, cosine = _sine(turn), _sine(turn + _HALF)
            return sine / cosine if sine is not None and cosine is not None else None
        case "arcsin" | "arccos" | "arctan":
            function = "tan" if name == "arctan" else "sin"
            for turn in _SQUARED_SINES:
                has_pole = function == "tan" and turn == _HALF
                if not has_pole and _apply_exactly(function, PI * Real.of(turn)) == argument.abs():
                    angle = PI * Real.of(turn * (argument.sign() or 0))
                    return PI * Real.of(_HALF) - angle if name == "arccos" else angle
            return None
        case "ln" if argument == ONE:
            return Real.of(0)
        case "exp" | "cosh":
            return ONE if argument.form.factor == 0 else None
        case _:
            return argument if argument.form.factor == 0 and name != "ln" else None


def _sine(turn: Fraction) -> Real | None:
    """Return the sine of a multiple of π, if it is known exactly."""
    sign, turn = (1 if turn % 2 <= 1 else -1), turn % 1
    square = _SQUARED_SINES.get(min(turn, 1 - turn))
    return Real.of(square).raise_to(Real.of(_HALF)) * Real.of(sign) if square is not None else None


def integrate(function: Callable[[Real, bool], Real], start: Real, end: Real) -> Real:
    """Return a ball around an integral, which is wide if it is not known to twenty digits.

    The function is told whether it must be analytic.
    """
    errors: list[Exception] = []

    def integrand(place: Any, analytic: bool) -> Any:
        try:
            return acb(function(Real(ball=place), analytic).ball)
        except Exception as error:  # which FLINT does not pass on
            errors.append(error)
            return acb(arb.nan())

    limits, tolerance = (start.ball, end.ball), arb(2) ** -72
    with ctx.workprec(128):
        value = acb.integral(
            integrand, *limits, rel_tol=tolerance, abs_tol=tolerance, eval_limit=2000
        )
    if errors and not value.is_finite():
        raise errors[0]
    return Real(ball=value.real if value.imag.contains(0) else arb.nan())
