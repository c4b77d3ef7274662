"""A recorded report in a text: the plot of a scenario, its tables, and where it was measured.

Entry points: `shown_bench`, what the page shows of the course; `draw_bench`, `bench_markdown`,
`index_bench`.

What is shown is what the page of the model shows. Where no report fits the course, the block says
so, with the command that makes one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from markupsafe import Markup
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import document_blocks, scenario_anchor
from coursebuild.core.model.results import Machine
from coursebuild.core.pages import urls
from coursebuild.core.pages.marks import escape_marks, guard_lines
from coursebuild.features.bench.figures import Grid, where
from coursebuild.features.bench.model import Bench, declared_scenarios
from coursebuild.features.bench.scenarios import ScenarioView, plots, scenario_view
from coursebuild.numerics.reports.bench import ScenarioReport
from coursebuild.numerics.reports.records import BENCH
from coursebuild.numerics.reports.sweep import SweepReport

if TYPE_CHECKING:
    from coursebuild.core.features import IndexReader, MarkdownWriter
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.pages.library import Library


class ShownBench(Struct, frozen=True):
    """What a page shows of a report."""

    href: str
    """Where the model's page shows the same."""
    report: ScenarioReport | SweepReport | None
    """`None` where none fits the course."""
    machine: Machine | None
    """Where it was measured."""


class BenchView(Struct, frozen=True):
    """The block, ready for its template."""

    model: str
    href: str
    """Where the model's page shows the same."""
    command: str
    shown: ScenarioView | None = None
    """`None` where nothing was measured."""
    tables: tuple[Grid, ...] = ()
    folded: Grid | None = None
    """The settings, where they stand below something else."""
    where: str = ""


def shown_bench(library: Library, place: urls.Place, bench: Bench) -> ShownBench:
    """What the reports have for a block on a page."""
    scene = library.reports.scenes.get(bench.model)
    scenarios = () if scene is None else scene.scenarios
    named: Iterator[ScenarioReport | SweepReport]
    named = (one for one in scenarios if bench.scenario in (None, one.name))
    if bench.sweep is not None:
        named = (one for one in (() if scene is None else scene.sweeps) if one.name == bench.sweep)
    report = next(named, None)
    declared = declared_scenarios(library.course, bench.model)
    anchor = "measured"
    if isinstance(report, SweepReport):
        anchor = scenario_anchor(f"sweep-{report.name}")
    elif report is not None and report.name in declared:
        anchor = scenario_anchor(report.name)
    href = place.href(urls.model_page_path(bench.model), anchor)
    machine = None if scene is None or report is None else scene.machine
    return ShownBench(href, report, machine)


def draw_bench(page: PageContext, block: Bench) -> Markup:
    """The report on a page."""
    return page.template("bench/bench.html", bench=_view(page, block), plots=_plots(page, block))


def bench_markdown(writer: MarkdownWriter, block: Bench) -> str:
    """The report without its plot, and what is to be seen in the plot."""
    from coursebuild.numerics.reports.plot import work_precision

    page, report = writer.page, _shown(writer.page, block).report
    if isinstance(report, SweepReport):
        report = None  # all that its plot shows is in its table
    html = page.template("bench/bench.html", bench=_view(page, block), plots=())
    head, *rest = writer.html(html).split("\n\n")
    if report is not None and "plot" in block.shows:
        silent = replace(report, verdict=replace(report.verdict, text=""))  # the block says it
        plot = work_precision(silent)
        if plot is not None:
            rest.insert(0, guard_lines(escape_marks(f"{plot.title}. {plot.text}")))
    return "\n\n".join((head, *rest))


def index_bench(reader: IndexReader, block: Bench) -> None:
    """The model, and what happened to it."""
    reader.add_name(block.model)
    shown = reader.values(block)
    if isinstance(shown, ShownBench) and shown.report is not None:
        reader.add("text", shown.report.title or shown.report.name)


def _shown(page: PageContext, block: Bench) -> ShownBench:
    shown = page.inputs.blocks[block.span.start]
    assert isinstance(shown, ShownBench)
    return shown


def _view(page: PageContext, block: Bench) -> BenchView:
    words, shown = page.renderer.words, _shown(page, block)
    nothing = BenchView(block.model, shown.href, BENCH.command(block.model))
    if shown.report is None or shown.machine is None:
        return nothing
    view = scenario_view(words, shown.report)
    alone, swept = block.shows == ("table",), isinstance(shown.report, SweepReport)
    grids = {"stable": view.stable, "orders": view.orders}
    tables = [grid for name in block.shows if (grid := grids.get(name)) is not None]
    if not swept and {"plot", "table"}.isdisjoint(block.shows):  # nothing is said of settings
        view = replace(view, verdict="", notes=())
    return replace(
        nothing,
        shown=view,
        tables=(view.settings,) if alone else tuple(tables),
        folded=view.settings if not alone and (swept or "table" in block.shows) else None,
        where=where(words, shown.machine),
    )


def _plots(page: PageContext, block: Bench) -> tuple[Markup, ...]:
    """The plot, for wide and for narrow screens; their ids are numbered through the page."""
    report = _shown(page, block).report
    if report is None or "plot" not in block.shows:
        return ()
    places = [b.span.start for b in document_blocks(page.document) if isinstance(b, Bench)]
    return plots(f"_bench-{places.index(block.span.start) + 1}", report)
