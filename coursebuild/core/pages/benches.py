"""A recorded report in a text: the plot of a scenario, its tables, and where it was measured.

Entry points: `bench`, the block as HTML; `bench_text`, as what a Markdown file is made from.

What is shown is what the page of the model shows. Where no report fits the course, the block says
so, with the command that makes one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from markupsafe import Markup
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Bench, document_blocks
from coursebuild.core.pages.figures import Grid, again, where
from coursebuild.core.pages.page_inputs import ShownBench
from coursebuild.core.pages.scenarios import scenario_view

if TYPE_CHECKING:
    from coursebuild.core.pages.context import PageContext
    from coursebuild.numerics.reports.bench import ScenarioReport


class BenchView(Struct, frozen=True):
    """The block, ready for its template."""

    model: str
    href: str
    """Where the model's page shows the same."""
    command: str
    title: str = ""
    """Of the scenario; empty where nothing was measured, like all that follows."""
    verdict: str = ""
    notes: tuple[str, ...] = ()
    tables: tuple[Grid, ...] = ()
    folded: Grid | None = None
    """The settings, where they stand below something else."""
    about: tuple[str, ...] = ()
    where: str = ""


def bench(page: PageContext, block: Bench) -> Markup:
    """A recorded report."""
    return page.template("blocks/bench.html", bench=_view(page, block), plots=_plots(page, block))


def bench_text(page: PageContext, block: Bench) -> tuple[Markup, str]:
    """The block without its plot, and what is to be seen in the plot."""
    from coursebuild.numerics.reports.points import chart, described, telling

    report = _shown(page, block).report
    quantity = None if report is None or "plot" not in block.shows else telling(report)
    said = ""
    if report is not None and quantity is not None:
        silent = replace(report, verdict=replace(report.verdict, text=""))  # the block says it
        said = ". ".join(described(silent, chart(report, quantity)))
    return page.template("blocks/bench.html", bench=_view(page, block), plots=()), said


def _shown(page: PageContext, block: Bench) -> ShownBench:
    return page.shown.benches[block.span.start]


def _view(page: PageContext, block: Bench) -> BenchView:
    words, shown = page.tools.words, _shown(page, block)
    command = again("bench", block.model, "--record")
    if shown.report is None or shown.machine is None:
        return BenchView(block.model, shown.href, command)
    view = scenario_view(words, shown.report, "")
    grids = {"stable": view.stable, "orders": view.orders}
    tables = [grid for name in block.shows if (grid := grids.get(name)) is not None]
    alone = block.shows == ("table",)
    settings = bool({"plot", "table"}.intersection(block.shows))
    return BenchView(
        model=block.model,
        href=shown.href,
        command=command,
        title=view.title,
        verdict=view.verdict if settings else "",
        notes=view.notes if settings else (),
        tables=(view.settings,) if alone else tuple(tables),
        folded=view.settings if "table" in block.shows and not alone else None,
        about=view.about,
        where=where(words, shown.machine),
    )


def _plots(page: PageContext, block: Bench) -> tuple[Markup, ...]:
    """The plot, for wide and for narrow screens; their ids are numbered through the page."""
    from coursebuild.core.pages.draw import plots  # which draws pages, and so blocks

    report: ScenarioReport | None = _shown(page, block).report
    if report is None or "plot" not in block.shows:
        return ()
    places = [b.span.start for b in document_blocks(page.document) if isinstance(b, Bench)]
    return plots(f"_bench-{places.index(block.span.start) + 1}", report)
