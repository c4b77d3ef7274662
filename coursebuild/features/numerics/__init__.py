"""The page of the hard cases: measurements of MuJoCo beside theory.

The page exists where hard cases are recorded.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import groupby
from operator import attrgetter

from markupsafe import Markup
from msgspec import Struct

from coursebuild.api import Command, Feature, Library, PageKind, urls
from coursebuild.core.model.measurements import CaseReport, FigureLine, SceneReport
from coursebuild.core.model.report_files import STABILITY
from coursebuild.core.pages.renderer import Strings
from coursebuild.features.bench import grids, scenario_view
from coursebuild.features.bench.chart import PAIR_SIZE, chart_svg
from coursebuild.features.bench.shown_errors import INTEGRATORS, seconds_text, status_text

_DIGITS = 3
_BOUNDARY = (
    *scenario_view.STABLE,
    "measured.difference",
    "measured.beyond",
    "measured.growth",
    "measured.remark",
)
_FIGURE = ("numerics.measured", "numerics.spread", "numerics.exact", "measured.difference")


class CaseView(Struct, frozen=True):
    """A hard case."""

    name: str
    """Its id."""
    title: str
    matrix: tuple[tuple[str, ...], ...]
    """Cells in the table of all cases: orders, largest stable timesteps, costs, by integrator."""
    sentences: tuple[str, ...]
    """What the plots say, and a note on the case."""
    plots: tuple[Markup, ...]
    """The error against time and against evaluations."""
    folded_plots: tuple[Markup, ...]
    tables: tuple[grids.Grid, ...]
    notes: tuple[str, ...]
    page: str
    """The address of the model's page, for a case of the course's own; else empty."""


class CaseGroup(Struct, frozen=True):
    """Cases of one number, or of the course's own."""

    number: int
    """0: of the course's own."""
    title: str
    cases: tuple[CaseView, ...]


def numerics_values(library: Library) -> dict[str, object]:
    """The values for the template of the page."""
    words, place = library.words, urls.Place(urls.NUMERICS)
    scenes: Mapping[str, SceneReport] = library.reports.scenes
    course_reports = [report for name in sorted(scenes) for report in scenes[name].cases]
    cases: list[CaseReport] = [
        *sorted(library.reports.cases, key=attrgetter("case")),
        *course_reports,
    ]
    groups = []
    for number, group_reports in groupby(cases, key=attrgetter("case")):
        views = tuple(case_view(words, place, report) for report in group_reports)
        key = f"numerics.case_{number}"
        has_own_title = (not number or len(views) > 1) and words.has(key)
        groups.append(CaseGroup(number, words(key) if has_own_title else views[0].title, views))
    tables = []  # of all cases: name, column of `matrix`, and by group the cases with cells
    for column, name in enumerate(("order", "largest", "cost")):
        bodies = [[case for case in group.cases if any(case.matrix[column])] for group in groups]
        if any(bodies):
            tables.append((name, column, [members for members in bodies if members]))
    return {
        "groups": tuple(groups),
        "tables": tuple(tables),
        "integrators": INTEGRATORS,
        "where": dict.fromkeys(grids.machine_text(words, report.machine) for report in cases),
        "file": place.href(urls.file_path(STABILITY.path())),
    }


def _matrix(words: Strings, report: CaseReport) -> tuple[tuple[str, ...], ...]:
    part = report.main if report.main != "energy_drift" else ""
    fits = {row.integrator: getattr(row, part) for row in report.orders} if part else {}
    limits = {
        line.integrator: words(f"numerics.{line.largest}")
        if isinstance(line.largest, str)
        else line.shown.partition(";")[0]
        for line in report.boundaries
    }
    orders = (fits.get(integrator) for integrator in INTEGRATORS)
    costs = map(dict(report.reached).get, INTEGRATORS)
    return (
        tuple("" if fit is None else f"{fit.value:.2f}" for fit in orders),
        tuple(limits.get(integrator, "") for integrator in INTEGRATORS),
        tuple("" if cost is None else seconds_text(cost, _DIGITS) for cost in costs),
    )


def case_view(words: Strings, place: urls.Place, report: CaseReport) -> CaseView:
    """A case as the page shows it."""
    model = "" if report.case else report.name.rpartition("/")[0]
    label = words("numerics.orders", title=report.title)
    orders = scenario_view.orders_table(words, label, report.orders, merge=True)
    rows = [
        (
            line.integrator,
            (
                *scenario_view.stable_cells(words, line),
                grids.percent(line.difference),
                status_text(line.beyond) if line.beyond else "",
                grids.power(line.growth),
                scenario_view.stable_again(words, line),
            ),
        )
        for line in report.boundaries
    ]
    label = (
        f"{report.title}: {scenario_view.stable_title(words, report.boundaries)}" if rows else ""
    )
    boundaries = scenario_view.integrator_table(words, label, _BOUNDARY, rows, merge=True)
    tables = (boundaries, _figures(words, report), orders)
    name = urls.encode(report.name)
    drawings = [
        Markup(chart_svg(chart, f"{name}-{number}", PAIR_SIZE))
        for number, chart in enumerate(report.charts, 1)
    ]
    first = sum(chart.axes[1] == report.charts[0].axes[1] for chart in report.charts)
    return CaseView(
        name,
        report.title,
        _matrix(words, report),
        tuple(_describe(words, report)),
        tuple(filter(None, drawings[:first])),
        tuple(filter(None, drawings[first:])),
        tuple(grid for grid in tables if grid is not None),
        tuple(_notes(words, report)),
        place.href(urls.model_page_path(model)) if model else "",
    )


def _describe(words: Strings, report: CaseReport) -> Iterator[str]:
    costs = [(cost, integrator) for integrator, cost in report.reached]
    if costs:
        (least, best), (most, worst) = min(costs), max(costs)
        key = "cheapest" if most > 1.05 * least else "alike"
        key = f"numerics.{key if len(costs) > 1 else 'only'}"
        texts = seconds_text(least, _DIGITS), f"{most / least:.3g}"
        cheapest, ratio = map(words.decimals, texts)
        yield words(key, best=best, cost=cheapest, worst=worst, factor=ratio)
    elif report.main:
        yield words("numerics.out_of_reach")
    if report.note:
        yield grids.sentence(report.note)


def _figures(words: Strings, report: CaseReport) -> grids.Grid | None:
    def cells(line: FigureLine) -> tuple[str, ...]:
        value = words("numerics.infinite") if line.measured is None else grids.power(line.measured)
        difference: str = ""
        if line.exact is not None and line.measured is not None:
            difference = grids.power(line.measured - line.exact, 2)
        spread = "" if line.spread is None else " … ".join(map(grids.power, line.spread))
        return value, spread, grids.power(line.exact), difference

    named_rows: list[grids.NamedRow] = []
    parts: list[grids.FigurePart] = []
    for name in dict.fromkeys(line.name for line in report.figures):
        lines = [line for line in report.figures if line.name == name]
        rows = grids.merge_rows((line.integrator, cells(line)) for line in lines)
        named_rows += rows
        unit = lines[0].unit
        sources = dict.fromkeys(figure.source for figure in lines if figure.source)
        title = grids.sentence(f"{name} ({unit})" if unit else name).removesuffix(".")
        parts.append(grids.FigurePart(title, "; ".join(sources), len(rows)))
    label = words("numerics.figures", title=report.title)
    return scenario_view.integrator_table(words, label, _FIGURE, named_rows, parts=tuple(parts))


def _notes(words: Strings, report: CaseReport) -> list[str]:
    reference = report.reference
    place, speed = (
        grids.power(error, 1)
        for error in (max(reference.position, reference.attitude), reference.velocity)
    )
    notes: list[str] = [
        words("numerics.references", first=reference.source, second=reference.second),
        grids.phrase(words, "numerics.known", place=place, speed=speed),
    ]
    formulas = dict.fromkeys(line.formula for line in report.boundaries if line.formula)
    if formulas:
        notes.append(words("numerics.theory", sources="; ".join(formulas)))
    softened_steps = sorted({line.timestep for line in report.errors if line.refsafe})
    if softened_steps:
        times = words.decimals(", ".join(map(seconds_text, softened_steps)))
        notes.append(words("measured.refsafe", settings=times))
    runs = ((f"{run.integrator} at {seconds_text(run.timestep)}", run) for run in report.errors)
    return [*notes, *scenario_view.lost_runs(runs)]


FEATURE = Feature(
    name="numerics",
    needs=("bench",),
    pages=(
        PageKind(
            name="numerics",
            values=numerics_values,
            exists=lambda library: bool(library.reports.cases),
            order=40,
        ),
    ),
    commands=(
        Command(
            name="stability",
            summary="measure MuJoCo on hard cases and compare with theory",
            module="coursebuild.features.numerics.commands",
        ),
    ),
)
