"""Where the parts of a plot with logarithmic axes go, and the element that holds it.

Entry points: `Frame`, from values to places; `grid(frame, …)`, ticks and titles; `key(entries, …)`;
`svg(body, …)`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from msgspec import Struct

from coursebuild.core.drawing.marks import markup_text, shortened, text_width
from coursebuild.core.drawing.scales import log_ticks
from coursebuild.numerics.reports.strokes import FINE, key_mark, label

SIZE = 12.0
"""Of letters, in the units of the drawing."""
TICK_SIZE = 11.0
WIDE, NARROW = 620.0, 350.0
ROW = 18.0
"""From one line of a key to the next."""
_FONT = "var(--sans, system-ui, sans-serif)"
_LARGEST = 290.0
"""Powers of ten beyond this are drawn there."""


def log(value: float) -> float:
    """The power of ten, within what can be drawn."""
    if not value > 0:
        return -_LARGEST
    return min(max(math.log10(value), -_LARGEST), _LARGEST)


def key(
    entries: Sequence[tuple[str, int | None, str]], left: float, top: float, width: float
) -> tuple[str, float]:
    """Marks and what they mean, in rows; and where the rows end.

    An entry is the kind of its mark, the number of its line if it has one, and a text.
    """
    found: list[str] = []
    x, y = left, top
    for kind, number, text in entries:
        text = shortened(text, width - left - 40, TICK_SIZE)
        wide = 30 + text_width(text, TICK_SIZE) + 10
        if x > left and x + wide > width:
            x, y = left, y + ROW
        found += key_mark(kind, number, x + 14, y - 4)
        found.append(label(x + 30, y, text, FINE))
        x += wide
    return "".join(found), y + 6


def svg(body: str, size: tuple[float, float], name: str, said: tuple[str, str], style: str) -> str:
    """A drawing as an element; `said` is its title and its text for who cannot see it.

    With a `style` it is for a file of its own.
    """
    key, (title, text) = markup_text(name), map(markup_text, said)
    head = ' xmlns="http://www.w3.org/2000/svg"' if style else ""
    return (
        f'<svg{head} class="work-precision" viewBox="0 0 {size[0]:g} {size[1]:g}" '
        f'role="img" aria-labelledby="{key}-title {key}-text" fill="currentColor" '
        f'font-size="{SIZE:g}" font-family="{_FONT}"><title id="{key}-title">{title}'
        f'</title><desc id="{key}-text">{text}</desc>'
        + (f"<style>{style}</style>{body}</svg>\n" if style else f"{body}</svg>")
    )


# -------------------------------------------------------------------------- two logarithmic axes


class Frame(Struct, frozen=True):
    """A rectangle on the drawing, and the powers of ten at its edges."""

    left: float
    right: float
    top: float
    bottom: float
    low_x: float
    high_x: float
    low_y: float
    high_y: float

    def x(self, value: float) -> float:
        """The place of a positive value, at the edge where it is beyond."""
        part = (math.log10(value) - self.low_x) / (self.high_x - self.low_x)
        return self.left + min(max(part, 0.0), 1.0) * (self.right - self.left)

    def y(self, value: float) -> float:
        """See `x`."""
        part = (math.log10(value) - self.low_y) / (self.high_y - self.low_y)
        return self.bottom - min(max(part, 0.0), 1.0) * (self.bottom - self.top)


def ticks_y(low: float, high: float, height: float) -> list[tuple[float, str]]:
    """Ticks of an axis of so many units' height."""
    return log_ticks(low, high, max(2, int(height / 30)))


def grid(frame: Frame, titles: tuple[str, str]) -> tuple[list[str], list[str]]:
    """Lines of the grid, and the texts of the axes; titles of the axis below and at the left."""
    lines: list[str] = []
    texts: list[str] = []
    for exponent in _decades(frame.low_y, frame.high_y):
        lines.append(f"M{frame.left:.1f} {frame.y(10.0**exponent):.1f}H{frame.right:.1f}")
    for exponent, text in ticks_y(frame.low_y, frame.high_y, frame.bottom - frame.top):
        y = frame.y(10.0**exponent)
        texts.append(label(frame.left - 7, y + 4, text, f'text-anchor="end" {FINE}'))
        lines.append(f"M{frame.left:.1f} {y:.1f}h-4")
    shown = _fitting(frame)
    for exponent in _decades(frame.low_x, frame.high_x) or [e for e, _ in shown]:
        lines.append(f"M{frame.x(10.0**exponent):.1f} {frame.top:.1f}V{frame.bottom:.1f}")
    for exponent, text in shown:
        x = frame.x(10.0**exponent)
        lines.append(f"M{x:.1f} {frame.bottom:.1f}v5")
        texts.append(label(x, frame.bottom + 18, text, f'text-anchor="middle" {FINE}'))
    middle, centre = (frame.top + frame.bottom) / 2, (frame.left + frame.right) / 2
    texts.append(
        f'<text transform="translate({14:.1f} {middle:.1f}) rotate(-90)" '
        f'text-anchor="middle">{markup_text(titles[1])}</text>'
    )
    texts.append(label(centre, frame.bottom + 37, titles[0], 'text-anchor="middle"'))
    return lines, texts


def _decades(low: float, high: float) -> list[float]:
    """Every power of ten between, unless they are too many to be told apart."""
    first, last = math.ceil(low - 1e-9), math.floor(high + 1e-9)
    return [float(n) for n in range(first, last + 1)] if last - first <= 24 else []


def _fitting(frame: Frame) -> list[tuple[float, str]]:
    """Ticks of the axis below, so many that their texts do not touch."""
    for most in (9, 7, 5, 4, 3, 2):
        found = log_ticks(frame.low_x, frame.high_x, most)
        places = [(frame.x(10.0**e), text_width(text, TICK_SIZE)) for e, text in found]
        if all(b - a >= (w + v) / 2 + 8 for (a, w), (b, v) in pairwise(places)):
            return found
    return found[:1]
