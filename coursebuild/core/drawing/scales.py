"""The scales of axes: the places of ticks, and their texts; text in drawings."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from html import escape
from itertools import pairwise

from msgspec import Struct

_LARGEST = 290.0
"""Greater powers of ten are drawn as this one."""


class Scale(Struct, frozen=True):
    """A map from values to places on a drawing; values beyond an end are drawn at that end."""

    start: float
    end: float
    """Places on the drawing; the end may be before the start."""
    low: float
    high: float
    """The values at start and end; exponents of ten on a logarithmic scale."""
    logarithmic: bool = True
    decimal: str = "."
    """The sign before decimals."""

    def __call__(self, value: float) -> float:
        """The place of a value."""
        at = log(value) if self.logarithmic else value
        part = (at - self.low) / (self.high - self.low)
        return self.start + min(max(part, 0.0), 1.0) * (self.end - self.start)

    def ticks(self, count: int) -> list[tuple[float, str]]:
        """Places and texts of about `count` ticks, at most so many on a logarithmic scale."""
        if self.logarithmic:
            pairs = [(10.0**n, text) for n, text in log_ticks(self.low, self.high, count)]
        else:
            values = ticks(self.low, self.high, count)
            pairs = list(zip(values, tick_texts(values), strict=True))
        return [(self(value), text.replace(".", self.decimal)) for value, text in pairs]


def log(value: float) -> float:
    """The decimal logarithm of a value, within what can be drawn."""
    if not value > 0:
        return -_LARGEST
    return min(max(math.log10(value), -_LARGEST), _LARGEST)


def ticks(low: float, high: float, count: int = 5) -> list[float]:
    """About `count` round numbers from `low` to `high`."""
    span = high - low
    if not (span > 0 and math.isfinite(span)):
        return [low]
    raw = span / count
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(power * m for m in (1, 2, 2.5, 5, 10) if power * m >= raw * 0.999)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    # Rounded, as the product has the rounding error of the step.
    return [float(f"{i * step:.15g}") for i in range(first, last + 1)] or [low]


def tick_texts(values: Sequence[float]) -> list[str]:
    """Ticks as text, with as many digits as they need to differ, and a real minus."""
    step = min((b - a for a, b in pairwise(values)), default=0.0)
    largest = max(abs(value) for value in values)
    if largest == 0:
        return ["0" for _ in values]
    tolerance = 1e-6 * (step or largest)
    plain = _digits(values, "f", tolerance) if largest < 1e15 else None
    if plain is not None and 1e-4 <= largest < 1e6:
        return plain
    powers = _digits(values, "e", tolerance) or [typeset_number(f"{v:.3e}") for v in values]
    longest = max(map(len, powers))
    return powers if plain is None or max(map(len, plain)) > longest else plain


def _digits(values: Sequence[float], form: str, tolerance: float) -> list[str] | None:
    """The values as text with the fewest digits within a tolerance; `None` if 17 are too few."""
    for digits in range(18):
        texts = [f"{value:.{digits}{form}}" for value in values]
        if all(abs(float(t) - v) <= tolerance for t, v in zip(texts, values, strict=True)):
            return [typeset_number(text) for text in texts]
    return None


_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def typeset_number(text: str, decimal: str = ".") -> str:
    """A formatted number as people write it: `−1.5·10⁻³` for `-1.5e-03`; zero has no sign."""
    mantissa, _, exponent = text.partition("e")
    mantissa = mantissa.replace("-", "\u2212").replace(".", decimal)
    if float(text) == 0:
        return "0" if exponent else mantissa.lstrip("\u2212")
    return f"{mantissa}·10{str(int(exponent)).translate(_SUPERSCRIPTS)}" if exponent else mantissa


def log_ticks(low: float, high: float, most: int) -> list[tuple[float, str]]:
    """Ticks of a logarithmic axis between two exponents: the exponent of each, and its text.

    They are powers of ten; with twos and fives between them if those are few; round numbers if even
    these are few.
    """
    first, last = math.ceil(low - 1e-9), math.floor(high + 1e-9)
    step = 1  # between the exponents that are shown: the least that `most` allows
    while last // step - -(-first // step) + 1 > max(most, 1):
        power: int = 10 ** (len(str(step)) - 1)
        step = next(power * m for m in (2, 3, 5, 10) if power * m > step)
    decades = [*range(-(-first // step) * step, last + 1, step)] or [first]
    decade_ticks = [(float(n), _scaled(1, n)) for n in decades] if first <= last else []
    if last - first < 2:
        finer = [
            (n + math.log10(m), _scaled(m, n))
            for n in range(math.floor(low), last + 1)
            for m in (1, 2, 5)
            if low - 1e-9 <= n + math.log10(m) <= high + 1e-9
        ]
        if len(decade_ticks) < len(finer) <= max(most, 3):
            decade_ticks = finer
    if len(decade_ticks) >= 2 or high - low > 1:
        return decade_ticks
    values = ticks(10.0**low, 10.0**high, min(most, 5))
    texts = tick_texts(values)
    return [(math.log10(v), text) for v, text in zip(values, texts, strict=True) if v > 0]


def number_text(value: float) -> str:
    """A number with few digits, written as a tick."""
    return tick_texts([float(f"{value:.2g}")])[0].removeprefix("1·")


def _scaled(mantissa: int, exponent: int) -> str:
    """A small whole number times a power of ten, as text; without the power if that is short."""
    if -3 <= exponent <= 3:
        return f"{mantissa * 10**exponent if exponent >= 0 else mantissa / 10**-exponent:g}"
    power = "10" + str(exponent).translate(_SUPERSCRIPTS)
    return power if mantissa == 1 else f"{mantissa}·{power}"


_NO_MARKUP = re.compile("[\x00-\x1f\x7f\ud800-\udfff\ufffe\uffff]")
"""Includes lone surrogates, which stand for bytes that are not text."""
_NARROW = frozenset("ijl.,:;'|!()[] ·ft")
_BROAD = frozenset("mwMW—%@")


def markup_text(text: str) -> str:
    """Text escaped for markup, without characters that markup cannot hold."""
    return escape(_NO_MARKUP.sub("", text))


def text_width(text: str, size: float) -> float:
    """About how wide a text is in a sans-serif face of this size, rather too wide."""
    letters = 0.0
    for char in text:
        if char in _NARROW:
            letters += 0.36
        elif char in _BROAD:
            letters += 0.92
        elif char > "\u2e80":
            letters += 1.05
        else:
            letters += 0.68 if char.isupper() else 0.58
    return letters * size


def shorten_to_width(text: str, room: float, size: float) -> str:
    """A text shortened to a width, with an ellipsis if something is left out."""
    if text_width(text, size) <= room:
        return text
    while text and text_width(f"{text}…", size) > room:
        text = text[:-1]
    return f"{text}…"


def separate_labels(desired: Sequence[float], gap: float, top: float, bottom: float) -> list[float]:
    """Places for labels in order, at least `gap` apart, as near as possible to the desired ones.

    If there is too little room, the first go above `top`.
    """
    places: list[float] = []
    for y in desired:
        places.append(max(y, places[-1] + gap) if places else max(y, top))
    most = bottom
    for i in reversed(range(len(places))):  # those pushed past the bottom go up again
        most = places[i] = min(places[i], most)
        most -= gap
    return places
