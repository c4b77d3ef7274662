"""The work–precision plot of a scenario as SVG: error against cost, both logarithmic.

Entry point: `plot_svg(report, …)`, for pages and for files of their own.

1. A line for each integrator, from long timesteps to short ones, with a colour, a mark and a dash
   of its own. A mark is filled where the setting is on the Pareto front, and hollow where another
   one is better. Small marks without a line have another solver, iterations or cone.
2. Lanes above the plot show what was lost: a cross for each run, and the range of the timesteps
   that are unstable, up to the largest stable one.
3. A band below shows what the reference does not resolve.
4. A ring is around the scene's own setting.

Colours are variables of the page's style sheet with a value of their own to fall back on, set as
attributes, since pages allow no styles inside of them. The same report gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from coursebuild.core.drawing.marks import Box, apart, clear_place, markup_text, text_width
from coursebuild.core.drawing.scales import number_text
from coursebuild.numerics.reports.bench import ScenarioReport
from coursebuild.numerics.reports.layout import (
    NARROW,
    ROW,
    SIZE,
    TICK_SIZE,
    WIDE,
    Lane,
    PlotLayout,
    entry_width,
    grid,
)
from coursebuild.numerics.reports.points import (
    PlotLine,
    Point,
    Quantity,
    chart,
    described,
    point_title,
    seconds_text,
    setting_text,
    telling,
)
from coursebuild.numerics.reports.strokes import (
    FINE,
    HALO,
    INK,
    MARK,
    OWN,
    RING,
    SMALL,
    area,
    colour,
    cross,
    key_mark,
    label,
    leader,
    line_look,
    path,
    ring,
    symbol,
)

_BOLD = 1.12
"""By what bold letters are wider."""
_VISIBLE = "just visible"
_STEM = 26.0
"""From the frame to the names at its right."""
_FONT = "var(--sans, system-ui, sans-serif)"

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
    layout = PlotLayout(report, found, NARROW if narrow else WIDE)
    body = "".join(_Picture(layout).parts())
    title, text = described(report, found)
    style = f"<style>{STYLE}</style>" if whole else ""
    key = markup_text(name)
    head = ' xmlns="http://www.w3.org/2000/svg"' if whole else ""
    return (
        f'<svg{head} class="work-precision" viewBox="0 0 {layout.width:g} {layout.height:g}" '
        f'role="img" aria-labelledby="{key}-title {key}-text" fill="currentColor" '
        f'font-size="{SIZE:g}" font-family="{_FONT}"><title id="{key}-title">{markup_text(title)}'
        f'</title><desc id="{key}-text">{markup_text(text)}</desc>{style}{body}</svg>'
        + ("\n" if whole else "")
    )


class _Picture:
    """Draws one plot."""

    def __init__(self, layout: PlotLayout) -> None:
        self.layout = layout
        self.frame = layout.frame
        self.report = layout.report
        self.lines = layout.chart.lines

    def parts(self) -> Iterator[str]:
        """All parts, what lies below first."""
        frame = self.frame
        lines, texts = grid(frame, self.layout.titles)
        yield from self._band()
        yield from self._visible()
        yield path("".join(lines), 'stroke="currentColor" stroke-opacity="0.16"')
        edge = f"M{frame.left:.1f} {frame.top:.1f}V{frame.bottom:.1f}H{frame.right:.1f}"
        yield path(edge, 'stroke="currentColor" stroke-opacity="0.7"')
        yield from texts
        for lane in self.layout.lanes:
            yield from self._lane(lane)
        for line in self.lines:
            if len(line.points) > 1:
                places = (self._place(point) for point in line.points)
                d = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
                yield path(d, line_look(line.number, round_joins=True))
        for line in self.lines:
            for point, size in self._sized(line):
                x, y = self._place(point)
                full, title = self.report.rows[point.row].front, self._title(point)
                yield symbol(line.number, x, y, size, full=full, title=title)
        if self.layout.wide:
            yield from self._names()
        else:
            yield from self._key(self.layout.names, 12.0)
        yield from self._own()
        yield from self._key(self.layout.key, self.layout.key_top + 12)

    def _sized(self, line: PlotLine) -> Iterator[tuple[Point, float]]:
        """Points of a line and beside it, with the sizes of their marks."""
        yield from ((point, MARK) for point in line.points)
        yield from ((point, SMALL) for point in line.others)

    def _place(self, point: Point) -> tuple[float, float]:
        assert point.error is not None
        return self.frame.x(point.cost), self.frame.y(max(point.error, 1e-300))

    def _title(self, point: Point) -> str:
        return point_title(self.report, self.layout.chart, point)

    def _band(self) -> Iterator[str]:
        """What the reference does not resolve."""
        if not self.layout.band:
            return
        frame, floor = self.frame, self.layout.chart.quantity.least
        top = frame.y(floor)
        d = f"M{frame.left:.1f} {top:.1f}H{frame.right:.1f}V{frame.bottom:.1f}H{frame.left:.1f}Z"
        yield area(d, 'fill-opacity="0.09"')
        text = f"under {number_text(floor)}: not resolved by the reference"
        y = (top + frame.bottom) / 2 + 4 if frame.bottom - top >= 16 else top - 5
        yield label(frame.right - 6, y, text, f'text-anchor="end" {FINE} {HALO}')

    def _visible(self) -> Iterator[str]:
        """From where on a learner sees the error."""
        if not self.layout.visible:
            return
        frame, y = self.frame, self.frame.y(1.0)
        look = 'stroke="currentColor" stroke-dasharray="1 3" stroke-width="1.2"'
        yield path(f"M{frame.left:.1f} {y:.1f}H{frame.right:.1f}", look)
        box = self._visible_box()
        yield label(box.left, box.bottom - 3, _VISIBLE, f"{FINE} {HALO}")

    def _visible_box(self) -> Box:
        """Where it says so: at an end of the line, above or below it, where it hides least."""
        frame, y = self.frame, self.frame.y(1.0)
        wide = text_width(_VISIBLE, TICK_SIZE)
        taken = list(self._marked())
        places = [
            Box(left, top, left + wide, top + 15)
            for left in (frame.left + 6, frame.right - 6 - wide)
            for top in (y - 17, y + 2)
        ]
        return min(places, key=lambda box: sum(box.over(other) for other in taken))

    def _lane(self, lane: Lane) -> Iterator[str]:
        """What was lost of an integrator: the unstable range, crosses, and words."""
        frame, line, y = self.frame, lane.line, lane.middle
        paint = colour(line.number)
        till = frame.right - (0 if lane.tall else text_width(lane.text, TICK_SIZE) + 8)
        if till > frame.left:
            d = f"M{frame.left:.1f} {y:.1f}H{till:.1f}"
            yield path(d, 'stroke="currentColor" stroke-opacity="0.16"')
        end = None
        if line.stable == 0:
            end = frame.right
        elif line.boundary is not None and self.layout.inside(line.boundary):
            end = frame.x(line.boundary)
        if end is not None:
            d = f"M{frame.left:.1f} {y - 5:.1f}H{end:.1f}v10H{frame.left:.1f}Z"
            yield area(d, f'fill="{paint}" fill-opacity="0.2"')
        if end is not None and line.stable:
            yield path(f"M{end:.1f} {y - 7:.1f}v14", f'stroke="{paint}" stroke-width="2"')
        for point in line.lost:
            title = markup_text(self._title(point))
            yield (
                f'<path d="{cross(frame.x(point.cost), y)}" fill="none" stroke="{paint}" '
                f'stroke-width="1.8"><title>{title}</title></path>'
            )
        base = lane.top + 11 if lane.tall else y + 4
        yield label(frame.right, base, lane.text, f'text-anchor="end" {FINE} {HALO}')

    def _names(self) -> Iterator[str]:
        """Names of the lines at the right, each with a thin line to where its own ends."""
        ends = []
        for line in self.lines:
            last = (*line.others, *line.points)[-1:]
            if last:
                x, y = self._place(last[0])
                ends.append((y, line.number, x, self.layout.short(line.integrator)))
        ends.sort()
        frame = self.frame
        places = apart([end[0] for end in ends], 17, frame.top + 4, frame.bottom - 4)
        at = frame.right + _STEM
        for (y, number, x, name), place in zip(ends, places, strict=True):
            turn = max(frame.right, x + 7)
            d = f"M{x + 7:.1f} {y:.1f}L{turn:.1f} {y:.1f}L{at - 9:.1f} {place:.1f}"
            yield path(d, f'stroke="{colour(number)}" stroke-opacity="0.45" stroke-width="0.8"')
            yield symbol(number, at, place, MARK, full=True)
            yield label(at + 9, place + 4, name, f'fill="{INK}"')

    def _own(self) -> Iterator[str]:
        """A ring around the scene's own setting, and what it is."""
        found = self._own_place()
        if found is None:
            return
        x, y, row = found
        setting = self.report.rows[row].setting
        yield ring(x, y, RING)
        frame = self.frame
        inside = Box(frame.left + 2, frame.top + 2, frame.right - 2, frame.bottom - 2)
        taken = list(self._taken())
        for said in (setting_text(setting, setting), seconds_text(setting.timestep)):
            text = f"own: {said}"
            size = (_BOLD * text_width(text, SIZE) + 4, 15.0)
            box, hidden = clear_place((x, y), size, inside, taken)
            if not hidden:
                break
        yield from leader((x, y), box)
        look = f'fill="{OWN}" text-anchor="middle" font-weight="600" {HALO}'
        yield label((box.left + box.right) / 2, box.bottom - 3.5, text, look)

    def _own_place(self) -> tuple[float, float, int] | None:
        rows = self.report.rows
        for point in self.layout.points:
            if rows[point.row].own:
                return (*self._place(point), point.row)
        for lane in self.layout.lanes:
            for point in lane.line.lost:
                if rows[point.row].own:
                    return self.frame.x(point.cost), lane.middle, point.row
        return None

    def _taken(self) -> Iterator[Box]:
        """What a label should not hide: marks, lines, and other words."""
        yield from self._marked()
        if self.layout.visible:
            yield self._visible_box()
        if self.layout.band:
            frame = self.frame
            top = frame.y(self.layout.chart.quantity.least)
            yield Box(frame.left, min(top, frame.bottom - 18), frame.right, frame.bottom)

    def _marked(self) -> Iterator[Box]:
        """Where marks and lines are."""
        for point in self.layout.points:
            x, y = self._place(point)
            yield Box(x - 6, y - 6, x + 6, y + 6)
        for line in self.lines:
            for first, second in pairwise(line.points):
                (x0, y0), (x1, y1) = self._place(first), self._place(second)
                many = max(1, int(max(abs(x1 - x0), abs(y1 - y0)) / 6))
                for k in range(many + 1):
                    x, y = x0 + (x1 - x0) * k / many, y0 + (y1 - y0) * k / many
                    yield Box(x - 2, y - 2, x + 2, y + 2)

    def _key(self, rows: Sequence[Sequence[tuple[str, str]]], top: float) -> Iterator[str]:
        """Marks and what they mean, in rows."""
        numbers = {line.integrator: line.number for line in self.lines}
        for index, row in enumerate(rows):
            x, y = self.frame.left if self.layout.wide else 6.0, top + ROW * index
            for kind, text in row:
                yield from key_mark(kind, numbers.get(kind), x + 14, y - 4)
                yield label(x + 30, y, text, FINE)
                x += entry_width(text)
