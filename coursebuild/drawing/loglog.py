"""The frame of a plot with two logarithmic axes: from values to places, grid, ticks and titles.

Entry points: `Frame`, `grid(frame, …)`.
"""

from __future__ import annotations

import math
from itertools import pairwise

from msgspec import Struct

from coursebuild.drawing.marks import markup_text, text_width
from coursebuild.drawing.scales import log_ticks

SIZE = 12.0
"""Of letters, in the units of the drawing."""
TICK_SIZE = 11.0


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


def grid(
    frame: Frame, top: float, titles: tuple[str, str], *, edge: float
) -> tuple[list[str], list[str]]:
    """Lines of the grid, which reach up to `top`, and the texts of the axes.

    Args:
        frame: where the plot is.
        top: the upper end of the grid's upright lines; above the frame where something stands on
            it.
        titles: of the axis below and of the one at the left.
        edge: where the title at the left stands.
    """
    lines: list[str] = []
    texts: list[str] = []
    shown_y = ticks_y(frame.low_y, frame.high_y, frame.bottom - frame.top)
    for exponent in _decades(frame.low_y, frame.high_y):
        y = frame.y(10.0**exponent)
        lines.append(f"M{frame.left:.1f} {y:.1f}H{frame.right:.1f}")
    for exponent, text in shown_y:
        y = frame.y(10.0**exponent)
        texts.append(_tick(frame.left - 7, y + 4, "end", text))
        lines.append(f"M{frame.left:.1f} {y:.1f}h-4")
    shown_x = _fitting(frame)
    for exponent in _decades(frame.low_x, frame.high_x) or [e for e, _ in shown_x]:
        x = frame.x(10.0**exponent)
        lines.append(f"M{x:.1f} {top:.1f}V{frame.bottom:.1f}")
    for exponent, text in shown_x:
        x = frame.x(10.0**exponent)
        lines.append(f"M{x:.1f} {frame.bottom:.1f}v5")
        texts.append(_tick(x, frame.bottom + 18, "middle", text))
    middle, centre = (frame.top + frame.bottom) / 2, (frame.left + frame.right) / 2
    texts.append(
        f'<text transform="translate({edge:.1f} {middle:.1f}) rotate(-90)" '
        f'text-anchor="middle">{markup_text(titles[1])}</text>'
    )
    texts.append(
        f'<text x="{centre:.1f}" y="{frame.bottom + 37:.1f}" text-anchor="middle">'
        f"{markup_text(titles[0])}</text>"
    )
    return lines, texts


def _tick(x: float, y: float, anchor: str, text: str) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{TICK_SIZE:g}">'
        f"{markup_text(text)}</text>"
    )


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
