"""Recorded reports as pages show them: on the page of a model, and in a text.

For what is missing, or does not fit the course, a block shows the command that measures it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from markupsafe import Markup, escape
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import (
    IndexReader,
    Library,
    MarkdownWriter,
    MjcfModel,
    PageContext,
    Renderer,
    find_blocks,
    urls,
)
from coursebuild.core.model import scenario_anchor
from coursebuild.core.model.diet_findings import DietReport, Finding
from coursebuild.core.model.measurements import (
    EngineReport,
    ScenarioReport,
    SceneReport,
    SweepReport,
)
from coursebuild.core.model.report_files import BENCH, DIET, ENGINES
from coursebuild.core.pages.marks import escape_marks, guard_lines
from coursebuild.core.pages.renderer import Strings
from coursebuild.features.bench import grids
from coursebuild.features.bench.model import Bench, declared_scenarios
from coursebuild.features.bench.scenario_view import (
    EngineView,
    ScenarioView,
    engine_view,
    plots,
    scenario_view,
)


class BenchView(Struct, frozen=True):
    """The values of the block's template."""

    model: str
    href: str
    """The address of the same on the model's page."""
    command: str
    scenario: ScenarioView | None = None
    """`None` if no report fits the course."""
    tables: tuple[grids.Grid, ...] = ()
    folded_table: grids.Grid | None = None
    """The table of settings, if it is folded below something else."""
    machine: str = ""
    engines: EngineView | None = None
    """What other engines do; `None` also if no report fits."""
    engines_command: str = ""
    """Empty where other engines are not shown."""
    engines_machine: str = ""
    alone: bool = False
    """Whether other engines are all that is shown."""


def bench_view(library: Library, place: urls.Place, bench: Bench) -> BenchView:
    """Find the report that a block on a page shows, and make what the page shows of it."""
    scene: SceneReport | None = library.reports.scenes.get(bench.model)
    reports: Sequence[ScenarioReport | SweepReport] = ()
    if scene is not None:
        reports = scene.scenarios if bench.sweep is None else scene.sweeps
    name = bench.scenario if bench.sweep is None else bench.sweep
    report = next((report for report in reports if name in (None, report.name)), None)
    anchor = "measured"
    if isinstance(report, SweepReport):
        anchor = scenario_anchor(f"sweep-{report.name}")
    elif report is not None and report.name in declared_scenarios(library.course, bench.model):
        anchor = scenario_anchor(report.name)
    href = place.href(urls.model_page_path(bench.model), anchor)
    view = BenchView(bench.model, href, BENCH.command(bench.model))
    if "engines" in bench.shows:
        view = _with_engines(library, place, bench, view)
    if view.alone or scene is None or report is None:
        return view
    scenario = scenario_view(library.words, report)
    only_table, is_sweep = bench.shows == ("table",), isinstance(report, SweepReport)
    by_name = {"stable": scenario.stable, "orders": scenario.orders}
    tables = [grid for name in bench.shows if (grid := by_name.get(name)) is not None]
    if not is_sweep and {"plot", "table"}.isdisjoint(bench.shows):  # these are about settings
        scenario = replace(scenario, verdict="", notes=())
    has_fold = not only_table and (is_sweep or "table" in bench.shows)
    return replace(
        view,
        scenario=scenario,
        tables=(scenario.settings,) if only_table else tuple(tables),
        folded_table=scenario.settings if has_fold else None,
        machine=grids.machine_text(library.words, scene.machine),
    )


def _with_engines(library: Library, place: urls.Place, bench: Bench, view: BenchView) -> BenchView:
    """Add what other engines do, where it was recorded."""
    report: EngineReport | None = library.reports.engines.get(bench.model)
    scenarios = () if report is None else report.scenarios
    name = bench.scenario
    scenario = next((scenario for scenario in scenarios if name in (None, scenario.name)), None)
    alone = bench.shows == ("engines",)
    href = place.href(urls.model_page_path(bench.model), _ENGINES) if alone else view.href
    command = ENGINES.command(bench.model)
    view = replace(view, alone=alone, href=href, engines_command=command)
    if report is None or scenario is None:
        return view
    return replace(
        view,
        engines=engine_view(library.words, scenario, report),
        engines_machine=grids.machine_text(library.words, report.machine),
    )


_ENGINES = "engines"
"""The anchor of what other engines do, on the page of a model."""


def draw_bench(page: PageContext, block: Bench) -> Markup:
    """Draw the report, with its plots, each for wide and for narrow screens."""
    view = _view(page, block)
    # The blocks of a page are numbered.
    places = [b.span.start for b in find_blocks(page.document, Bench)]
    number = places.index(block.span.start) + 1
    report = view.scenario.report if view.scenario and "plot" in block.shows else None
    drawings = plots(page.words, f"_bench-{number}", report) if report else ()
    engines = view.engines
    engine_drawings = (
        plots(page.words, f"_bench-engines-{number}", engines.scenario) if engines else ()
    )
    return page.template(
        "bench/bench.html", bench=view, plots=drawings, engine_plots=engine_drawings
    )


def bench_markdown(writer: MarkdownWriter, block: Bench) -> str:
    """Write the report without its plot, and what the plot shows."""
    view = _view(writer.page, block)
    html = writer.page.template("bench/bench.html", bench=view, plots=(), engine_plots=())
    head, *rest = writer.html(html).split("\n\n")
    report = None if view.scenario is None else view.scenario.report
    if isinstance(report, ScenarioReport) and "plot" in block.shows:
        # The table of a sweep holds all that its plot shows.
        translate = writer.page.words.translate
        texts = (f"{translate(c.title)}. {translate(c.text)}" for c in report.charts)
        rest = [*(guard_lines(escape_marks(text)) for text in texts), *rest]
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


class FindingView(Struct, frozen=True):
    """A finding of the diet, and its texts in the page's language."""

    finding: Finding
    message: str
    label: str
    saving: str


class DietView(Struct, frozen=True):
    """What the model could do without."""

    summary: str
    findings: tuple[FindingView, ...]
    machine: str
    file: str
    """The address of the report."""


class MeasurementsView(Struct, frozen=True):
    """All measurements of a model."""

    scenarios: tuple[ScenarioView, ...]
    unmeasured: tuple[str, ...]
    """The anchors of scenarios that are declared and not measured."""
    machine: str
    """Machine and versions; empty if nothing was measured."""
    file: str
    """The address of the report; empty if there is none."""
    diet: DietView | None
    numerics: str
    """The address of the hard cases; empty if there are none."""
    sweeps: tuple[ScenarioView, ...]
    engines: tuple[EngineView, ...] = ()
    engines_machine: str = ""
    engines_file: str = ""


def measurements_view(library: Library, place: urls.Place, model: MjcfModel) -> MeasurementsView:
    """Make what the page of a model shows of its reports."""
    words, name = library.words, model.name
    scene: SceneReport | None = library.reports.scenes.get(name)
    diet: DietReport | None = library.reports.diets.get(name)
    engines: EngineReport | None = library.reports.engines.get(name)
    scenarios = () if scene is None else scene.scenarios
    sweeps = () if scene is None else scene.sweeps
    anchors = {s: scenario_anchor(s) for s in declared_scenarios(library.course, name)}
    return MeasurementsView(
        scenarios=tuple(
            scenario_view(words, scenario, anchors.get(scenario.name, f"_scenario-{n}"))
            for n, scenario in enumerate(scenarios, 1)
        ),
        unmeasured=tuple(
            anchor
            for scenario, anchor in anchors.items()
            if scenario not in {report.name for report in scenarios}
        ),
        machine="" if scene is None else grids.machine_text(words, scene.machine),
        file="" if scene is None else place.href(urls.file_path(BENCH.path(name))),
        diet=None if diet is None else _diet(words, place, diet),
        numerics=place.href(urls.NUMERICS) if library.reports.cases else "",
        sweeps=tuple(
            scenario_view(words, sweep, scenario_anchor(f"sweep-{sweep.name}")) for sweep in sweeps
        ),
        engines=()
        if engines is None
        else tuple(engine_view(words, scenario, engines) for scenario in engines.scenarios),
        engines_machine="" if engines is None else grids.machine_text(words, engines.machine),
        engines_file="" if engines is None else place.href(urls.file_path(ENGINES.path(name))),
    )


def draw_measurements(renderer: Renderer, view: MeasurementsView) -> Markup:
    """Draw the part of the page."""

    def draw(kind: str, reports: Iterable[Any]) -> list[Any]:
        return [
            plots(renderer.words, f"_{kind}-{n}", report) for n, report in enumerate(reports, 1)
        ]

    return renderer.render(
        "bench/measurements.html",
        measurements=view,
        plots=[
            *draw("plot", (scenario.report for scenario in view.scenarios)),
            *draw("sweep", (sweep.report for sweep in view.sweeps)),
        ],
        engine_plots=draw("engines", (engines.scenario for engines in view.engines)),
    )


def measurement_facts(library: Library, model: MjcfModel) -> tuple[tuple[str, str], ...]:
    """Say what the model is made of, and how fast it runs, as pairs of words."""
    words = library.words
    scene: SceneReport | None = library.reports.scenes.get(model.name)

    def speed(times: float | None) -> str:
        return (
            ""
            if times is None
            else words("measured.times", factor=words.decimals(grids.factor(times)))
        )

    native = browser = None
    if scene is not None and scene.scenarios:
        native = next((row.realtime for row in scene.scenarios[0].rows if row.own), None)
    text = grids.size(len(model.source.text.encode()))
    facts = {"mjcf_file": text}
    if scene is not None and (card := scene.card) is not None:
        browser = card.browser
        facts = {"possible": str(card.possible), "touched": str(card.touched)}
        facts |= {"mjcf": grids.size(card.mjcf), "mjb": grids.size(card.mjb)}
    facts |= {"native": speed(native), "browser": speed(browser)}
    return tuple((words(f"measured.{name}"), fact) for name, fact in facts.items() if fact)


def _diet(words: Strings, place: urls.Place, diet: DietReport) -> DietView:
    count = sum(finding.is_fault for finding in diet.findings)
    summary = words("measured.diet_open", n=count) if count else words("measured.slim")
    failures = [
        f"{scenario.name}: {'; '.join(scenario.reasons)}"
        for scenario in diet.scenarios
        if scenario.status != "ok"
    ]
    if failures:
        summary += " " + words("measured.diet_lost", scenarios="; ".join(failures))
    return DietView(
        summary,
        tuple(_finding(words, finding) for finding in diet.findings),
        grids.machine_text(words, diet.machine),
        place.href(urls.file_path(DIET.path(diet.model))),
    )


def _finding(words: Strings, finding: Finding) -> FindingView:
    label, saving = escape(finding.label), finding.saving
    if finding.difference:  # a figure alone where its words were not recorded
        label += Markup(" ({})").format(
            finding.shown or grids.unbroken(words.decimals(grids.power(finding.difference, 2)))
        )
    label += "; in what is left" if finding.in_rest else ""
    parts = []
    if saving.time is not None:
        text = words("measured.saves_time", factor=words.decimals(grids.factor(saving.time)))
        parts.append(text if saving.certain else words("measured.saves_none"))
    if saving.memory:
        parts.append(words("measured.saves_memory", size=grids.size(saving.memory)))
    if saving.text:
        parts.append(words("measured.saves_text", size=grids.size(saving.text)))
    return FindingView(finding, grids.sentence(finding.message), label, ", ".join(parts))
