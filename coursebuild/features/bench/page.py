"""A recorded report in a text: the plot of a scenario, its tables, and where it was measured.

Entry points: `bench_view`, the values that a page needs; `draw_bench`, `bench_markdown`,
`index_bench`.

The block shows the same as the page of the model. If no report fits the course, it says so, with
the command that makes one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from markupsafe import Markup
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import find_blocks, scenario_anchor
from coursebuild.core.pages import urls
from coursebuild.core.pages.marks import escape_marks, guard_lines
from coursebuild.features.bench.figures import Grid, machine_text
from coursebuild.features.bench.model import Bench, declared_scenarios
from coursebuild.features.bench.scenarios import ScenarioView, plots, scenario_view
from coursebuild.numerics.reports.records import BENCH
from coursebuild.numerics.reports.scene_report import ScenarioReport, SceneReport, SweepReport

if TYPE_CHECKING:
    from coursebuild.core.features import IndexReader, MarkdownWriter
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.pages.library import Library


class BenchView(Struct, frozen=True):
    """The values of the block's template."""

    model: str
    href: str
    """The address of the same on the model's page."""
    command: str
    scenario: ScenarioView | None = None
    """`None` if no report fits the course."""
    tables: tuple[Grid, ...] = ()
    folded_table: Grid | None = None
    """The table of settings, if it is folded below something else."""
    machine: str = ""


def bench_view(library: Library, place: urls.Place, bench: Bench) -> BenchView:
    """Find the report that a block on a page shows, and make what the page shows of it."""
    scene: SceneReport | None = library.reports.scenes.get(bench.model)
    report = None if scene is None else _find_report(scene, bench)
    anchor = "measured"
    if isinstance(report, SweepReport):
        anchor = scenario_anchor(f"sweep-{report.name}")
    elif report is not None and report.name in declared_scenarios(library.course, bench.model):
        anchor = scenario_anchor(report.name)
    href = place.href(urls.model_page_path(bench.model), anchor)
    view = BenchView(bench.model, href, BENCH.command(bench.model))
    if scene is None or report is None:
        return view
    scenario = scenario_view(library.words, report)
    only_table, is_sweep = bench.shows == ("table",), isinstance(report, SweepReport)
    grids = {"stable": scenario.stable, "orders": scenario.orders}
    tables = [grid for name in bench.shows if (grid := grids.get(name)) is not None]
    if not is_sweep and {"plot", "table"}.isdisjoint(bench.shows):  # these are about settings
        scenario = replace(scenario, verdict="", notes=())
    has_fold = not only_table and (is_sweep or "table" in bench.shows)
    return replace(
        view,
        scenario=scenario,
        tables=(scenario.settings,) if only_table else tuple(tables),
        folded_table=scenario.settings if has_fold else None,
        machine=machine_text(library.words, scene.machine),
    )


def _find_report(scene: SceneReport, bench: Bench) -> ScenarioReport | SweepReport | None:
    if bench.sweep is not None:
        return next((sweep for sweep in scene.sweeps if sweep.name == bench.sweep), None)
    return next((s for s in scene.scenarios if bench.scenario in (None, s.name)), None)


def draw_bench(page: PageContext, block: Bench) -> Markup:
    """Draw the report, with its plot for wide and for narrow screens."""
    view = _view(page, block)
    drawings: tuple[Markup, ...] = ()
    if view.scenario is not None and "plot" in block.shows:
        # The blocks of a page are numbered.
        places = [b.span.start for b in find_blocks(page.document, Bench)]
        drawings = plots(f"_bench-{places.index(block.span.start) + 1}", view.scenario.report)
    return page.template("bench/bench.html", bench=view, plots=drawings)


def bench_markdown(writer: MarkdownWriter, block: Bench) -> str:
    """Write the report without its plot, and what the plot shows."""
    from coursebuild.numerics.reports.plots import work_precision

    view = _view(writer.page, block)
    html = writer.page.template("bench/bench.html", bench=view, plots=())
    head, *rest = writer.html(html).split("\n\n")
    report = None if view.scenario is None else view.scenario.report
    if isinstance(report, ScenarioReport) and "plot" in block.shows:
        # The block says the verdict itself. The table of a sweep holds all that its plot shows.
        plot = work_precision(replace(report, verdict=replace(report.verdict, text="")))
        if plot is not None:
            rest.insert(0, guard_lines(escape_marks(f"{plot.title}. {plot.text}")))
    return "\n\n".join((head, *rest))


def index_bench(reader: IndexReader, block: Bench) -> None:
    """Index the model, and the title of its report."""
    reader.add_name(block.model)
    view = reader.values(block)
    if isinstance(view, BenchView) and view.scenario is not None:
        reader.add("text", view.scenario.title)


def _view(page: PageContext, block: Bench) -> BenchView:
    view = page.inputs.blocks[block.span.start]
    assert isinstance(view, BenchView)
    return view
