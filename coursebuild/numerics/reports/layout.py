"""Where the parts of a work–precision plot go: its frame, the lanes above it, the key below.

Entry points: `PlotLayout`; `Frame`, from values to places; `grid(frame, …)`, ticks and titles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from msgspec import Struct

from coursebuild.core.drawing.marks import markup_text, shortened, text_width
from coursebuild.core.drawing.scales import log_ticks
from coursebuild.numerics.reports.bench import ScenarioReport
from coursebuild.numerics.reports.points import Chart, PlotLine, Point, lane_text
from coursebuild.numerics.reports.strokes import FINE, label

SIZE = 12.0
"""Of letters, in the units of the drawing."""
TICK_SIZE = 11.0
WIDE, NARROW = 620.0, 350.0
_HEIGHT = {WIDE: 320.0, NARROW: 260.0}
"""Of the plot itself, in the units of the drawing."""
LANE, TALL_LANE = 18.0, 32.0
ROW = 18.0
"""From one line of a key to the next."""
_LARGEST = 290.0
"""Powers of ten beyond this are drawn there."""


class Lane(Struct, frozen=True):
    """A line's place above the plot."""

    line: PlotLine
    text: str
    top: float
    tall: bool
    """Whether its text stands above what it shows."""

    @property
    def middle(self) -> float:
        """The height of what it shows."""
        return self.top + (TALL_LANE if self.tall else LANE) - LANE / 2


class PlotLayout:
    """The places in one plot, in units of the drawing; fixed once made."""

    def __init__(self, report: ScenarioReport, found: Chart, width: float) -> None:
        self.report = report
        self.chart = found
        self.width = width
        self.wide = width == WIDE
        cost = "cost, relative to the scene’s own setting" if found.timed else "steps"
        label = shortened(f"error: {found.quantity.label}", _HEIGHT[width], SIZE)
        self.titles = (cost, label)
        low_x, high_x, low_y, high_y = self._ranges()
        texts = [text for _, text in ticks_y(low_y, high_y, _HEIGHT[width])]
        left = 32 + max((text_width(text, TICK_SIZE) for text in texts), default=0.0)
        right = width - (self._names_width() if self.wide else 10.0)
        names = [(line.integrator, self.short(line.integrator)) for line in found.lines]
        self.names = [] if self.wide else wrapped(names, width - 12)
        head = 8 + ROW * len(self.names) + (4 if self.names else 0)
        flat = Frame(left, right, 0, 1, low_x, high_x, low_y, high_y)
        self.lanes = self._lanes(flat, head)
        high = sum(TALL_LANE if lane.tall else LANE for lane in self.lanes)
        top = head + high + (6 if self.lanes else 0)
        self.frame = Frame(left, right, top, top + _HEIGHT[width], low_x, high_x, low_y, high_y)
        self.key = wrapped(self._key(), width - (left if self.wide else 6.0))
        self.key_top = self.frame.bottom + 50
        self.height = self.key_top + ROW * len(self.key)

    @property
    def points(self) -> list[Point]:
        """Every point of the plot."""
        return [p for line in self.chart.lines for p in (*line.points, *line.others)]

    @property
    def band(self) -> bool:
        """Whether what the reference does not resolve is in the picture."""
        floor = self.chart.quantity.least
        return floor > 0 and log(floor) > self.frame.low_y

    @property
    def visible(self) -> bool:
        """Whether the error that is just visible is in the picture."""
        return self.chart.quantity.name == "seen" and self.frame.low_y < 0 < self.frame.high_y

    def short(self, name: str) -> str:
        """The name of a line, in the room that there is for it."""
        return shortened(name, 0.22 * self.width, SIZE)

    def inside(self, cost: float | None) -> bool:
        """Whether a cost is within the plot."""
        return cost is not None and self.frame.low_x <= log(cost) <= self.frame.high_x

    def _ranges(self) -> tuple[float, float, float, float]:
        points = self.points
        costs = [log(p.cost) for p in points]
        costs += [log(p.cost) for line in self.chart.lines for p in line.lost]
        low, high = min(costs), max(costs)
        for line in self.chart.lines:  # a boundary that is far away is not worth the room
            at = None if line.boundary is None else log(line.boundary)
            if at is not None and low - 0.5 <= at <= high + 0.5:
                low, high = min(low, at), max(high, at)
        pad = max(0.06 * (high - low), 0.12)
        errors = [log(p.error) for p in points if p.error]
        if (
            self.chart.quantity.name == "seen"
            and errors
            and min(errors) - 1 <= 0 <= max(errors) + 1
        ):
            errors.append(0.0)  # from where on it is visible
        least = self.chart.quantity.least
        floor = log(least) if least > 0 else -_LARGEST
        bottom, top = min(errors, default=floor), max(errors, default=floor + 1)
        if floor > bottom - 1.5:  # the band, with room for what it says
            bottom = min(bottom, floor) - 0.07 * max(top - bottom, 1.0)
        span = max(top - bottom, 0.6)
        top = max(top, bottom + 0.6)
        return low - pad, high + pad, bottom - 0.05 * span, top + 0.08 * span

    def _names_width(self) -> float:
        names = [self.short(line.integrator) for line in self.chart.lines]
        return max(text_width(name, SIZE) for name in names) + 48

    def _lanes(self, frame: Frame, head: float) -> list[Lane]:
        found: list[Lane] = []
        at = head
        for line in self.chart.lines:
            boundary = line.boundary
            inside = boundary is not None and frame.low_x <= log(boundary) <= frame.high_x
            if not (line.lost or inside or line.stable == 0):
                continue
            text = shortened(lane_text(line), frame.right - frame.left, TICK_SIZE)
            ends = [frame.x(p.cost) for p in line.lost]
            ends += [frame.x(boundary)] if boundary is not None and inside else []
            ends += [frame.right] if line.stable == 0 else []
            room = frame.right - max(ends, default=frame.left) - 14
            tall = text_width(text, TICK_SIZE) > room
            found.append(Lane(line, text, at, tall))
            at += TALL_LANE if tall else LANE
        return found

    def _key(self) -> list[tuple[str, str]]:
        """What the marks mean: only those that there are."""
        rows = self.report.rows
        lost = [p for line in self.chart.lines for p in line.lost]
        points = self.points
        others = any(line.others for line in self.chart.lines)
        own = any(rows[p.row].own for p in (*points, *lost))
        unstable = any(
            lane.line.stable == 0 or self.inside(lane.line.boundary) for lane in self.lanes
        )
        shown = [
            ("front", "on the Pareto front", any(rows[p.row].front for p in points)),
            ("beaten", "another is better", any(not rows[p.row].front for p in points)),
            ("other", "other solver, iterations or cone", others),
            ("own", "the scene’s own setting", own),
            ("lost", "run lost", bool(lost)),
            ("unstable", "unstable", unstable),
        ]
        return [(kind, text) for kind, text, there in shown if there]


def log(value: float) -> float:
    """The power of ten, within what can be drawn."""
    if not value > 0:
        return -_LARGEST
    return min(max(math.log10(value), -_LARGEST), _LARGEST)


def wrapped(entries: Sequence[tuple[str, str]], room: float) -> list[list[tuple[str, str]]]:
    """Entries of a key in rows that are no wider than there is room."""
    rows: list[list[tuple[str, str]]] = []
    used = math.inf
    for entry in entries:
        wide = entry_width(entry[1])
        if used + wide > room:
            rows.append([])
            used = 0.0
        rows[-1].append(entry)
        used += wide
    return rows


def entry_width(text: str) -> float:
    """What an entry of a key takes, with its mark and the gap behind it."""
    return 30 + text_width(text, TICK_SIZE) + 10


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
