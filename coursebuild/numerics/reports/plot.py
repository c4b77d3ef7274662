"""The work–precision plot of a scenario as SVG: error against cost, both logarithmic.

Entry point: `plot_svg(report, …)`, for pages and for files of their own.

1. A line for each integrator, from long timesteps to short ones, with a colour, a mark and a dash
   of its own. A mark is filled where the setting is on the Pareto front, and hollow where another
   one is better. Small marks without a line have another solver, iterations or cone. Bars are the
   intervals of the costs.
2. Crosses at the upper edge are runs that were lost.
3. A band below shows what the reference does not resolve.
4. A ring is around the scene's own setting.

Colours are variables of the page's style sheet with a value of their own to fall back on, set as
attributes, since pages allow no styles inside of them. The same report gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterator

from coursebuild.core.drawing.marks import markup_text, shortened, text_width
from coursebuild.core.drawing.scales import number_text
from coursebuild.numerics.reports.bench import ScenarioReport
from coursebuild.numerics.reports.layout import (
    NARROW,
    SIZE,
    TICK_SIZE,
    WIDE,
    Frame,
    grid,
    key,
    log,
    svg,
    ticks_y,
)
from coursebuild.numerics.reports.points import (
    Chart,
    PlotLine,
    Point,
    Quantity,
    chart,
    described,
    point_title,
    setting_text,
    telling,
)
from coursebuild.numerics.reports.strokes import (
    FINE,
    HALO,
    MARK,
    RING,
    SMALL,
    area,
    bar,
    colour,
    cross,
    label,
    line_look,
    path,
    ring,
    symbol,
)

_HEIGHT = {WIDE: 320.0, NARROW: 260.0}
"""Of the plot itself, in the units of the drawing."""
_TOP = 16.0
"""Above it, for what was lost."""
_NEAR = 1e-300
"""An error of nothing is drawn here."""

STYLE = """\
:root{color-scheme:light dark;background:light-dark(#fcfbf8,#17191c);color:light-dark(#484742,\
#c0bcb3);--paper:light-dark(#fcfbf8,#17191c);--ink:light-dark(#1e1e1c,#e6e3dc);\
--rust:light-dark(#86340c,#f3b184);--trace-1:light-dark(#0072b2,#56b4e9);\
--trace-2:light-dark(#b34d00,#e69f00);--trace-3:light-dark(#00795a,#2fc79a);\
--trace-4:light-dark(#a8467f,#e59fc7);--trace-5:light-dark(#7a6a00,#f0e442);\
--trace-6:light-dark(#2b6f9e,#8fd0f5);--trace-7:light-dark(#1e1e1c,#e6e3dc)}\
@media print{:root{color-scheme:light;background:#fff}}"""
"""Of a file of its own: what a page's style sheet says otherwise."""


def plot_svg(
    report: ScenarioReport,
    *,
    name: str,
    quantity: Quantity | None = None,
    narrow: bool = False,
    whole: bool = False,
) -> str:
    """The plot as an `svg` element.

    Args:
        report: of the scenario.
        name: unlike those of all other plots on the page: what describes it has an id.
        quantity: which error; the one that tells most where none is given.
        narrow: for narrow screens: the text has the same size there.
        whole: for a file of its own, which has no style sheet.

    Returns:
        The markup; empty where no row of the scenario has this error.
    """
    shown = quantity or telling(report)
    if shown is None:
        return ""
    found = chart(report, shown)
    if not any((*line.points, *line.others) for line in found.lines):
        return ""
    width = NARROW if narrow else WIDE
    frame = _frame(report, found, width)
    left = 6.0 if narrow else frame.left
    below, height = key(_entries(report, found), left, frame.bottom + 62, width)
    body = "".join(_parts(report, found, frame)) + below
    style = STYLE if whole else ""
    return svg(body, (width, height), name, described(report, found), style)


def _frame(report: ScenarioReport, found: Chart, width: float) -> Frame:
    """The rectangle of the plot, wide enough for all that is in it."""
    points = [p for line in found.lines for p in (*line.points, *line.others)]
    lost = [p for line in found.lines for p in line.lost]
    costs = [log(x) for p in (*points, *lost) for x in (p.cost.low, p.cost.high)]
    pad = max(0.06 * (max(costs) - min(costs)), 0.12)
    errors = [log(p.error) for p in points if p.error]
    floor = log(found.quantity.least or _NEAR)
    bottom, top = min(errors, default=floor), max(errors, default=floor + 1)
    if found.quantity.name == "seen" and bottom - 1 <= 0 <= top + 1:
        bottom, top = min(bottom, 0.0), max(top, 0.0)  # from where on it is visible
    if floor > bottom - 1.5:  # the band, with room for what it says
        bottom = min(bottom, floor) - 0.07 * max(top - bottom, 1.0)
    span = max(top - bottom, 0.6)
    low, high = bottom - 0.05 * span, bottom + 1.08 * span
    texts = [text for _, text in ticks_y(low, high, _HEIGHT[width])]
    left = 32 + max((text_width(text, TICK_SIZE) for text in texts), default=0.0)
    edges = (left, width - 10, _TOP, _TOP + _HEIGHT[width])
    return Frame(*edges, min(costs) - pad, max(costs) + pad, low, high)


def _parts(report: ScenarioReport, found: Chart, frame: Frame) -> Iterator[str]:
    """All parts, what lies below first."""
    cost = "cost, relative to the scene’s own setting" if found.timed else "steps"
    error = shortened(f"error: {found.quantity.label}", frame.bottom - frame.top, SIZE)
    lines, texts = grid(frame, (cost, error))
    yield from _levels(found.quantity, frame)
    yield path("".join(lines), 'stroke="currentColor" stroke-opacity="0.16"')
    edge = f"M{frame.left:.1f} {frame.top:.1f}V{frame.bottom:.1f}H{frame.right:.1f}"
    yield path(edge, 'stroke="currentColor" stroke-opacity="0.7"')
    yield from texts
    for line in found.lines:
        if len(line.points) > 1:
            places = (_place(frame, point) for point in line.points)
            d = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
            yield path(d, line_look(line.number, round_joins=True))
    for line in found.lines:
        yield from _marks(report, found, frame, line)


def _levels(quantity: Quantity, frame: Frame) -> Iterator[str]:
    """What the reference does not resolve, and from where on a learner sees the error."""
    if quantity.least > 0 and log(quantity.least) > frame.low_y:
        top = frame.y(quantity.least)
        d = f"M{frame.left:.1f} {top:.1f}H{frame.right:.1f}V{frame.bottom:.1f}H{frame.left:.1f}Z"
        yield area(d, 'fill-opacity="0.09"')
        text = f"under {number_text(quantity.least)}: not resolved by the reference"
        y = (top + frame.bottom) / 2 + 4 if frame.bottom - top >= 16 else top - 5
        yield label(frame.right - 6, y, text, f'text-anchor="end" {FINE} {HALO}')
    if quantity.name == "seen" and frame.low_y < 0 < frame.high_y:
        y = frame.y(1.0)
        look = 'stroke="currentColor" stroke-dasharray="1 3" stroke-width="1.2"'
        yield path(f"M{frame.left:.1f} {y:.1f}H{frame.right:.1f}", look)
        yield label(frame.left + 6, y - 4, "just visible", f"{FINE} {HALO}")


def _marks(report: ScenarioReport, found: Chart, frame: Frame, line: PlotLine) -> Iterator[str]:
    """Each run of an integrator, with the interval of its cost."""
    sizes = [(p, MARK) for p in line.points] + [(p, SMALL) for p in line.others]
    for point, size in sizes:
        x, y = _place(frame, point)
        title, full = point_title(report, found, point), report.rows[point.row].front
        yield bar(frame.x(point.cost.low), frame.x(point.cost.high), y, line.number)
        yield symbol(line.number, x, y, size, full=full, title=title)
    for point in line.lost:
        title = markup_text(point_title(report, found, point))
        yield (
            f'<path d="{cross(*_place(frame, point))}" fill="none" '
            f'stroke="{colour(line.number)}" stroke-width="1.8"><title>{title}</title></path>'
        )
    for point in (*line.points, *line.others, *line.lost):
        if report.rows[point.row].own:
            yield ring(*_place(frame, point), RING)


def _place(frame: Frame, point: Point) -> tuple[float, float]:
    """Where a run is; at the upper edge where it was lost."""
    y = frame.top - 6 if point.error is None else frame.y(max(point.error, _NEAR))
    return frame.x(point.cost.value), y


def _entries(report: ScenarioReport, found: Chart) -> list[tuple[str, int | None, str]]:
    """What lines and marks mean: only those that there are."""
    rows = report.rows
    drawn = [rows[p.row] for line in found.lines for p in (*line.points, *line.others)]
    own = [f"the scene’s own: {setting_text(r.setting, r.setting)}" for r in rows if r.own]
    marks = (
        ("front", "on the Pareto front", any(row.front for row in drawn)),
        ("beaten", "another is better", not all(row.front for row in drawn)),
        ("other", "other solver, iterations or cone", any(line.others for line in found.lines)),
        ("own", "".join(own[:1]), bool(own)),
        ("lost", "run lost", any(line.lost for line in found.lines)),
    )
    names = [("line", line.number, line.integrator) for line in found.lines]
    return names + [(kind, None, text) for kind, text, there in marks if there]
