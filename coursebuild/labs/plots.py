"""A recorded plot as SVG: for paper, for readers without JavaScript, and before a lab starts.

Entry point: `plot_svg(plot, times, traces)`.

Lines carry their names at their ends, and differ by dashes besides colour. Colours are classes that
the style sheet defines for light and dark; the text takes the page's colour.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from coursebuild.model import LabPlot

_WIDE, _NARROW, _HEIGHT = 480.0, 340.0, 210.0
_LEFT, _TOP, _BOTTOM = 46.0, 12.0, 38.0
_DASHES = ("", "6 3", "2 3", "8 3 2 3", "1 4")
_LABEL_GAP = 13.0


def ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Round numbers from `low` to `high`, about so many."""
    span = high - low
    if not (span > 0 and math.isfinite(span)):
        return [low]
    raw = span / about
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(power * m for m in (1, 2, 2.5, 5, 10) if power * m >= raw * 0.999)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [round(i * step, 12) for i in range(first, last + 1)]


def number(value: float) -> str:
    """A tick's text, with a real minus."""
    return f"{value:.6g}".replace("-", "\u2212")


def plot_svg(
    plot: LabPlot,
    times: Sequence[float],
    traces: Sequence[Sequence[float | None]],
    *,
    narrow: bool = False,
) -> str:
    """The plot as an `svg` element; values that are no finite numbers interrupt their line.

    A narrow one is for the margin: its text has the same size there.
    """
    shown = [
        (t, i) for i, t in enumerate(times) if plot.window is None or t >= times[-1] - plot.window
    ]
    if not shown:
        return ""
    low_t, high_t = shown[0][0], max(shown[-1][0], shown[0][0] + 1e-9)
    values = [
        v for line in traces for _, i in shown if (v := line[i]) is not None and math.isfinite(v)
    ]
    values += [y for y, _ in plot.ref_lines]
    low, high = _range(values, plot.ymin, plot.ymax)
    width = _NARROW if narrow else _WIDE
    longest = max((len(trace.label) for trace in plot.traces), default=0)
    margin = min(14.0 + 6.2 * longest, 0.35 * width)
    frame = _Frame(low_t, high_t, low, high, width, margin)
    parts = [*_axes(frame, plot)]
    for y, label in plot.ref_lines:
        if low <= y <= high:
            parts.append(_reference(frame, y, label))
    ends: list[tuple[float, str, int]] = []
    for n, (trace, line) in enumerate(zip(plot.traces, traces, strict=True)):
        points = [(t, line[i]) for t, i in shown]
        parts.append(_line(frame, points, n))
        last = next((v for _, v in reversed(points) if v is not None and math.isfinite(v)), None)
        if last is not None:
            ends.append((frame.y(min(max(last, low), high)), trace.label, n))
    parts += _labels(frame, ends)
    title = f"{plot.ylabel} against {plot.xlabel}" if plot.ylabel else "plot"
    names = ", ".join(trace.label for trace in plot.traces)
    return (
        f'<svg class="lab-plot" viewBox="0 0 {width:g} {_HEIGHT:g}" role="img" '
        f'aria-label="{escape(f"{title}: {names}")}">' + "".join(parts) + "</svg>"
    )


class _Frame:
    """From values to places."""

    def __init__(
        self, low_t: float, high_t: float, low: float, high: float, width: float, margin: float
    ) -> None:
        self.low_t, self.high_t, self.low, self.high = low_t, high_t, low, high
        self.right = width - margin

    def x(self, t: float) -> float:
        return _LEFT + (t - self.low_t) / (self.high_t - self.low_t) * (self.right - _LEFT)

    def y(self, v: float) -> float:
        return (
            _HEIGHT - _BOTTOM - (v - self.low) / (self.high - self.low) * (_HEIGHT - _TOP - _BOTTOM)
        )


def _range(values: list[float], ymin: float | None, ymax: float | None) -> tuple[float, float]:
    low = min(values, default=0.0) if ymin is None else ymin
    high = max(values, default=1.0) if ymax is None else ymax
    if not high > low:
        pad = abs(low) * 0.1 or 1.0
        return low - pad, low + pad
    pad = 0.04 * (high - low)
    return (low if ymin is not None else low - pad), (high if ymax is not None else high + pad)


def _axes(frame: _Frame, plot: LabPlot) -> list[str]:
    right, bottom = frame.right, _HEIGHT - _BOTTOM
    parts = []
    for value in ticks(frame.low, frame.high):
        y = frame.y(value)
        parts.append(f'<path class="lab-grid" d="M{_LEFT:g} {y:.1f}H{right:g}"/>')
        parts.append(
            f'<text x="{_LEFT - 6:g}" y="{y + 3.5:.1f}" text-anchor="end">{number(value)}</text>'
        )
    for value in ticks(frame.low_t, frame.high_t, 6):
        x = frame.x(value)
        parts.append(f'<path class="lab-axis" d="M{x:.1f} {bottom:g}v4"/>')
        parts.append(
            f'<text x="{x:.1f}" y="{bottom + 16:g}" text-anchor="middle">{number(value)}</text>'
        )
    parts.append(f'<path class="lab-axis" d="M{_LEFT:g} {_TOP:g}V{bottom:g}H{right:g}"/>')
    middle = (_TOP + bottom) / 2
    parts.append(
        f'<text transform="translate(13 {middle:g}) rotate(-90)" text-anchor="middle">'
        f"{escape(plot.ylabel)}</text>"
    )
    centre = (_LEFT + right) / 2
    parts.append(
        f'<text x="{centre:g}" y="{_HEIGHT - 5:g}" text-anchor="middle">'
        f"{escape(plot.xlabel)}</text>"
    )
    return parts


def _reference(frame: _Frame, y: float, label: str) -> str:
    at = frame.y(y)
    return (
        f'<path class="lab-reference" d="M{_LEFT:g} {at:.1f}H{frame.right:g}"/>'
        f'<text x="{_LEFT + 4:g}" y="{at - 4:.1f}">{escape(label)}</text>'
    )


def _line(frame: _Frame, points: Sequence[tuple[float, float | None]], n: int) -> str:
    path: list[str] = []
    pen = False
    for t, v in points:
        if v is None or not math.isfinite(v):
            pen = False
            continue
        # What leaves the frame is drawn a little beyond it and cut by the view.
        v = min(max(v, frame.low), frame.high)
        path.append(f"{'L' if pen else 'M'}{frame.x(t):.1f} {frame.y(v):.1f}")
        pen = True
    dash = _DASHES[n % len(_DASHES)]
    style = f' stroke-dasharray="{dash}"' if dash else ""
    return f'<path class="lab-trace lab-trace-{n % 7 + 1}"{style} d="{"".join(path)}"/>'


def _labels(frame: _Frame, ends: list[tuple[float, str, int]]) -> list[str]:
    """Names at the ends of the lines, moved apart where they would overlap."""
    placed: list[str] = []
    last = -math.inf
    for y, label, n in sorted(ends):
        last = max(y, last + _LABEL_GAP)
        placed.append(
            f'<text class="lab-name lab-name-{n % 7 + 1}" x="{frame.right + 6:g}" '
            f'y="{last + 3.5:.1f}">{escape(label)}</text>'
        )
    return placed
