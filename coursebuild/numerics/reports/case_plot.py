"""The plots of a hard case as SVG: error, or energy drift, against processor time.

Entry points: `case_quantities(report)`, what can be drawn; `case_svg(report, quantity, name)`.

A line for each integrator, from long timesteps to short ones, with its name where it ends. Crosses
at the upper edge are runs that were lost; what the references do not resolve is shaded.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from coursebuild.core.drawing.marks import apart, markup_text
from coursebuild.numerics.reports.bench import FLOORS
from coursebuild.numerics.reports.cases import CaseReport, ErrorLine
from coursebuild.numerics.reports.layout import Frame, grid, log, svg
from coursebuild.numerics.reports.points import KNOWN, seconds_text, status_text
from coursebuild.numerics.reports.strokes import (
    FINE,
    HALO,
    MARK,
    area,
    colour,
    cross,
    label,
    line_look,
    path,
    symbol,
)

_WIDTH, _HEIGHT = 430.0, 300.0
_FRAME = (62.0, 340.0, 16.0, 252.0)
_LINE = 15.0
"""From one name to the next."""
_TIME = "processor time for a simulated second (s)"

Point = tuple[float, float]
"""Processor time for a simulated second, s, and what is drawn against it."""


class CaseQuantity(Struct, frozen=True):
    """What of a case's runs is drawn."""

    name: str
    """The field of a run."""
    label: str
    least: float = 0.0
    """Nothing below is known."""

    def of(self, line: ErrorLine) -> float | None:
        """Of a run that ended well; 0 is no number to be drawn."""
        found: tuple[float, float] | float | None = getattr(line, self.name)
        value = found[0] if isinstance(found, tuple) else found
        return abs(value) if value and line.status == "ok" else None


def case_quantities(report: CaseReport) -> tuple[CaseQuantity, ...]:
    """The error that says most, and energy drift where energy is conserved."""
    known = report.reference
    errors = (
        CaseQuantity("position", "error of position (m or rad)", FLOORS * known.position),
        CaseQuantity("attitude", "error of attitude (rad)", FLOORS * known.attitude),
        CaseQuantity("velocity", "error of velocity (m/s or rad/s)", FLOORS * known.velocity),
    )
    said = [one for one in errors if _beyond(report, one)][:1]
    drift = CaseQuantity("energy_drift", "energy drift, relative")
    return tuple(said + [drift] * _beyond(report, drift))


def _beyond(report: CaseReport, quantity: CaseQuantity) -> bool:
    """Whether any run says more than that it is nothing."""
    least = quantity.least * (1 + 1e-9)
    return any((quantity.of(line) or 0.0) > least for line in report.errors)


def case_svg(report: CaseReport, quantity: CaseQuantity, name: str) -> str:
    """The plot as an `svg` element; empty where nothing was timed.

    `name` is unlike those of all other plots on the page.
    """
    lines = {one: _points(report, quantity, one) for one in KNOWN}
    lines = {integrator: points for integrator, points in lines.items() if points}
    if not lines:
        return ""
    frame = _frame(lines)
    body = "".join(_parts(report, quantity, frame, lines))
    title = f"{report.title}: {quantity.label} against processor time"
    said = (_range(integrator, points) for integrator, points in lines.items())
    return svg(body, (_WIDTH, _HEIGHT), name, (title, " ".join(said)), "")


def _points(report: CaseReport, quantity: CaseQuantity, integrator: str) -> list[Point]:
    """By timestep."""
    runs = [line for line in report.errors if line.integrator == integrator]
    found = [(report.cost(line), quantity.of(line)) for line in runs]
    return [(x, y) for x, y in found if x is not None and y is not None]


def _range(integrator: str, points: list[Point]) -> str:
    (x0, y0), (x1, y1) = points[0], points[-1]
    return f"{integrator}: {y0:.2g} at {seconds_text(x0, 2)}, {y1:.2g} at {seconds_text(x1, 2)}."


def _frame(lines: Mapping[str, list[Point]]) -> Frame:
    xs = [log(x) for points in lines.values() for x, _ in points]
    ys = [log(y) for points in lines.values() for _, y in points]
    wide, high = max(max(xs) - min(xs), 0.5), max(max(ys) - min(ys), 1.0)
    edges = (min(xs) - 0.05 * wide, min(xs) + 1.05 * wide, min(ys) - 0.05 * high)
    return Frame(*_FRAME, *edges, min(ys) + 1.05 * high)


def _parts(
    report: CaseReport, quantity: CaseQuantity, frame: Frame, lines: Mapping[str, list[Point]]
) -> Iterator[str]:
    """All parts, what lies below first."""
    strokes, texts = grid(frame, (_TIME, quantity.label))
    if quantity.least and log(quantity.least) > frame.low_y:
        top = frame.y(quantity.least)
        d = f"M{frame.left:.1f} {top:.1f}H{frame.right:.1f}V{frame.bottom:.1f}H{frame.left:.1f}Z"
        yield area(d, 'fill-opacity="0.09"')
    yield path("".join(strokes), 'stroke="currentColor" stroke-opacity="0.16"')
    yield from texts
    for integrator, points in lines.items():
        number = KNOWN.index(integrator)
        places = [(frame.x(x), frame.y(y)) for x, y in points]
        if len(places) > 1:
            d = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
            yield path(d, line_look(number, round_joins=True))
        for (x, y), (cost, value) in zip(places, points, strict=True):
            title = f"{integrator}: {value:.3g} at {seconds_text(cost, 3)}"
            yield symbol(number, x, y, MARK - 1, full=True, title=title)
    yield from _lost(report, frame)
    yield from _names(frame, lines)


def _lost(report: CaseReport, frame: Frame) -> Iterator[str]:
    for line in report.errors:
        cost = report.cost(line)
        if line.status != "ok" and cost is not None:
            paint = colour(KNOWN.index(line.integrator))
            told = f"{line.integrator} at {seconds_text(line.timestep)}: {status_text(line.status)}"
            yield (
                f'<path d="{cross(frame.x(cost), frame.top - 6)}" fill="none" stroke="{paint}" '
                f'stroke-width="1.6"><title>{markup_text(told)}</title></path>'
            )


def _names(frame: Frame, lines: Mapping[str, list[Point]]) -> Iterator[str]:
    """At the right, in the order in which the lines end, and none on another."""
    ends = sorted((frame.y(points[-1][1]), name) for name, points in lines.items())
    places = apart([y for y, _ in ends], _LINE, frame.top, frame.bottom)
    for (y, name), at in zip(ends, places, strict=True):
        paint = colour(KNOWN.index(name))
        start = f"M{frame.x(lines[name][-1][0]) + 5:.1f} {y:.1f}L{frame.right + 6:.1f} {at:.1f}"
        yield path(start, f'stroke="{paint}" stroke-opacity="0.5" stroke-width="0.8"')
        look = f'fill="{paint}" font-weight="600" {FINE} {HALO}'
        yield label(frame.right + 9, at + 4, name, look)
