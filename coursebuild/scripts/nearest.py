"""Which printed numbers the author of a binding that does not hold most probably meant.

Entry points: `meant` (the likeliest of some), `of_window` (these and no others).

1. The same numbers with another sign, to the digits shown, come first.
2. Else the numbers that are relatively nearest, since a slip or an older run changes the last
   digits of a number: 0.5 is nearer to 0.1 than 0.0001 is. Another sign counts for one digit.
3. The same digits with another power of ten (a percentage for a fraction, a slip in an exponent)
   count as well, for as much as there are digits that could have differed by chance.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from decimal import Context, Decimal

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.scripts.numbers import Number, difference, unit, within_half_unit
from coursebuild.scripts.shown import Shown, Window, shows

_SLIP = 10
"""How many times as far away a number counts that needs a second mistake, beside its digits."""
_QUOTIENT = Context(prec=34)
_EXACT = Context(prec=40_000)


class Likeness(enum.Enum):
    """In what printed numbers are not those of a binding."""

    SIGN = "sign"
    POWER = "power"
    """Of ten."""
    DIGITS = "digits"


class Meant(Struct, frozen=True):
    """Printed numbers that a binding most probably means."""

    window: Window
    likeness: Likeness

    @property
    def label(self) -> str:
        """In words."""
        several = len(self.window.numbers) > 1
        text = self.window.text
        match self.likeness:
            case Likeness.SIGN if several:
                return f"the same numbers are printed with other signs: {text}"
            case Likeness.SIGN:
                return f"the same number is printed with the other sign: {text}"
            case Likeness.POWER:
                return f"the same digits are printed with another power of ten: {text}"
            case Likeness.DIGITS:
                return f"the nearest printed value{'s are' if several else ' is'} {text}"

    def rewritten(self, shown: Shown, text: str) -> str:
        """The binding's text with these numbers in it; empty where digits would be lost."""
        better = shown.rewritten(text, self.window) or ""
        new = Shown.of(better).numbers if better else ()
        if any(p.value and not n.value for n, p in zip(new, self.window.numbers, strict=False)):
            return ""
        if self.likeness is Likeness.POWER and better:
            pairs = zip(Shown.of(better).numbers, shown.numbers, strict=True)
            if any(_digits(new) < _digits(old) for new, old in pairs):
                return ""
        return better


def meant(shown: Shown, windows: Sequence[Window]) -> Meant:
    """The likeliest of some printed numbers, at least one; the first of those alike."""
    return of_window(shown, min(windows, key=lambda window: _unlikeness(shown, window)))


def of_window(shown: Shown, window: Window) -> Meant:
    """Some printed numbers as what a binding means."""
    pairs = list(zip(shown.numbers, window.numbers, strict=True))
    if all(_same_size(one, other) for one, other in pairs):
        return Meant(window, Likeness.SIGN)
    if all(_same_size(one, other) or _same_digits(one, other) for one, other in pairs):
        return Meant(window, Likeness.POWER)
    return Meant(window, Likeness.DIGITS)


def _unlikeness(shown: Shown, window: Window) -> tuple[bool, Decimal, Decimal]:
    pairs = list(zip(shown.numbers, window.numbers, strict=True))
    exact = all(_same_size(one, other) for one, other in pairs)
    return not exact, sum((_far(*p) for p in pairs), Decimal()), sum(map(_gap, pairs), Decimal())


def _far(shown: Number, printed: Number) -> Decimal:
    """How unlikely a printed number is meant: 0 if it is shown, about 1 if it is another."""
    if shows(shown, printed):
        return Decimal(0)
    if not (shown.finite and printed.finite):
        return Decimal("Infinity")
    one, other = shown.value.copy_abs(), printed.value.copy_abs()
    far = _QUOTIENT.divide(difference(one, other), max(one, other))
    if _same_digits(shown, printed):
        by_chance = _QUOTIENT.divide(unit(shown.place), _EXACT.add(one, one))
        far = min(far, _SLIP * by_chance)
    turned = shown.value.is_signed() != printed.value.is_signed() and one and other
    return far * _SLIP if turned else far


def _gap(pair: tuple[Number, Number]) -> Decimal:
    shown, printed = pair
    finite = shown.finite and printed.finite
    return difference(shown.value, printed.value) if finite else Decimal(0)


def _same_size(shown: Number, printed: Number) -> bool:
    """Whether they are the same but for the sign."""
    return shows(_unsigned(shown), _unsigned(printed))


def _same_digits(shown: Number, printed: Number) -> bool:
    """Whether they are the same but for a power of ten, and the sign."""
    if not (shown.finite and printed.finite and shown.value and printed.value):
        return False
    shift = shown.value.adjusted() - printed.value.adjusted()
    scaled = printed.value.copy_abs().scaleb(shift, _EXACT)
    return within_half_unit(_unsigned(shown), scaled)


def _unsigned(number: Number) -> Number:
    return replace(number, value=number.value.copy_abs())


def _digits(number: Number) -> int:
    """Significant digits as written."""
    return number.value.adjusted() - number.place + 1 if number.value else 0
