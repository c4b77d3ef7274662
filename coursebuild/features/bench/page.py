"""A recorded report in a text: the plot of a scenario, its tables, and where it was measured.

Entry points: `bench_data`, the values that a page needs; `draw_bench`, `bench_markdown`,
`index_bench`.

The block shows the same as the page of the model. If no report fits the course, it says so, with
the command that makes one.
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
from coursebuild.features.bench.figures import Grid, machine_text
from coursebuild.features.bench.model import Bench, declared_scenarios
from coursebuild.features.bench.scenarios import ScenarioView, plots, scenario_view
from coursebuild.numerics.reports.bench import ScenarioReport
from coursebuild.numerics.reports.records import BENCH
from coursebuild.numerics.reports.sweep import SweepReport

if TYPE_CHECKING:
    from coursebuild.core.features import IndexReader, MarkdownWriter
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.pages.library import Library


class BenchData(Struct, frozen=True):
    """What a page needs of a report."""

    href: str
    """The address of the same on the model's page."""
    report: ScenarioReport | SweepReport | None
    """`None` if none fits the course."""
    machine: Machine | None
    """The machine on which it was measured."""


class BenchView(Struct, frozen=True):
    """The values of the block's template."""

    model: str
    href: str
    """The address of the same on the model's page."""
    command: str
    scenario: ScenarioView | None = None
    """`None` if nothing was measured."""
    tables: tuple[Grid, ...] = ()
    folded_table: Grid | None = None
    """The table of settings, if it is folded below something else."""
    machine: str = ""


def bench_data(library: Library, place: urls.Place, bench: Bench) -> BenchData:
    """Find the report that a block on a page shows."""
    scene = library.reports.scenes.get(bench.model)
    scenarios = () if scene is None else scene.scenarios
    sweeps = () if scene is None else scene.sweeps
    reports: Iterator[ScenarioReport | SweepReport]
    reports = (scenario for scenario in scenarios if bench.scenario in (None, scenario.name))
    if bench.sweep is not None:
        reports = (sweep for sweep in sweeps if sweep.name == bench.sweep)
    report = next(reports, None)
    anchor = "measured"
    if isinstance(report, SweepReport):
        anchor = scenario_anchor(f"sweep-{report.name}")
    elif report is not None and report.name in declared_scenarios(library.course, bench.model):
        anchor = scenario_anchor(report.name)
    href = place.href(urls.model_page_path(bench.model), anchor)
    machine = None if scene is None or report is None else scene.machine
    return BenchData(href, report, machine)


def draw_bench(page: PageContext, block: Bench) -> Markup:
    """Draw the report."""
    return page.template("bench/bench.html", bench=_view(page, block), plots=_plots(page, block))


def bench_markdown(writer: MarkdownWriter, block: Bench) -> str:
    """Write the report without its plot, and what the plot shows."""
    from coursebuild.numerics.reports.plot import work_precision

    page, report = writer.page, _data(writer.page, block).report
    if isinstance(report, SweepReport):
        report = None  # its table holds all that its plot shows
    html = page.template("bench/bench.html", bench=_view(page, block), plots=())
    head, *rest = writer.html(html).split("\n\n")
    if report is not None and "plot" in block.shows:
        # The block says the verdict itself.
        plot = work_precision(replace(report, verdict=replace(report.verdict, text="")))
        if plot is not None:
            rest.insert(0, guard_lines(escape_marks(f"{plot.title}. {plot.text}")))
    return "\n\n".join((head, *rest))


def index_bench(reader: IndexReader, block: Bench) -> None:
    """Index the model, and the title of its report."""
    reader.add_name(block.model)
    data = reader.values(block)
    if isinstance(data, BenchData) and data.report is not None:
        reader.add("text", data.report.title or data.report.name)


def _data(page: PageContext, block: Bench) -> BenchData:
    data = page.inputs.blocks[block.span.start]
    assert isinstance(data, BenchData)
    return data


def _view(page: PageContext, block: Bench) -> BenchView:
    words, data = page.renderer.words, _data(page, block)
    view = BenchView(block.model, data.href, BENCH.command(block.model))
    if data.report is None or data.machine is None:
        return view
    scenario = scenario_view(words, data.report)
    only_table, is_sweep = block.shows == ("table",), isinstance(data.report, SweepReport)
    grids = {"stable": scenario.stable, "orders": scenario.orders}
    tables = [grid for name in block.shows if (grid := grids.get(name)) is not None]
    if not is_sweep and {"plot", "table"}.isdisjoint(block.shows):  # these are about settings
        scenario = replace(scenario, verdict="", notes=())
    has_fold = not only_table and (is_sweep or "table" in block.shows)
    return replace(
        view,
        scenario=scenario,
        tables=(scenario.settings,) if only_table else tuple(tables),
        folded_table=scenario.settings if has_fold else None,
        machine=machine_text(words, data.machine),
    )


def _plots(page: PageContext, block: Bench) -> tuple[Markup, ...]:
    """Draw the plot for wide and for narrow screens; the blocks of a page are numbered."""
    report = _data(page, block).report
    if report is None or "plot" not in block.shows:
        return ()
    places = [b.span.start for b in document_blocks(page.document) if isinstance(b, Bench)]
    return plots(f"_bench-{places.index(block.span.start) + 1}", report)
