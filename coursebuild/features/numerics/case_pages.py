"""The pages of the hard cases: measurements of MuJoCo beside theory.

They exist where hard cases are recorded: one picture of all cases, and a page for each family.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import groupby
from operator import attrgetter

from markupsafe import Markup
from msgspec import Struct

from coursebuild.api import Library, urls
from coursebuild.core.model.addresses import document_anchors
from coursebuild.core.model.measurements import CaseReport, FigureLine
from coursebuild.core.model.report_files import STABILITY
from coursebuild.core.pages.renderer import Strings
from coursebuild.features.bench import grids, scenario_view
from coursebuild.features.bench.chart import PAIR_SIZE, chart_svg
from coursebuild.features.bench.shown_errors import INTEGRATORS, seconds_text
from coursebuild.features.numerics import KIND

_DIGITS = 3
_BOUNDARY = (
    *scenario_view.STABLE,
    "measured.remark",
)
_FIGURE = ("numerics.measured", "numerics.spread", "numerics.exact", "measured.difference")


class CaseView(Struct, frozen=True):
    """A hard case."""

    name: str
    """Its id."""
    title: str
    sentences: tuple[str, ...]
    """What the plots say, and a note on the case."""
    plots: tuple[Markup, ...]
    """The error against time."""
    folded_plots: tuple[Markup, ...]
    tables: tuple[grids.Grid, ...]
    notes: tuple[str, ...]


class LabLink(Struct, frozen=True):
    """A lab in which a reader tries what a family is about."""

    lesson: str
    """The title of where it is."""
    href: str


class MatrixCell(Struct, frozen=True):
    """What an integrator comes to in a case, among all integrators."""

    text: str
    shade: int
    """0 for the best of them, one more for each factor of two from it, at most `_SHADES`."""


class MatrixRow(Struct, frozen=True):
    """A case in the picture of all cases."""

    title: str
    href: str
    groups: tuple[tuple[MatrixCell, ...], ...]
    """Largest stable timesteps, orders and costs, by integrator."""


class CaseFamily(Struct, frozen=True):
    """Cases of one number, in the picture of all cases."""

    title: str
    href: str
    rows: tuple[MatrixRow, ...]


_SHADES = 3


def case_families(library: Library) -> dict[str, tuple[CaseReport, ...]]:
    """The cases by the id of their family, which names its page."""
    number_of = attrgetter("case")
    groups = groupby(sorted(library.reports.cases, key=number_of), key=number_of)
    return {f"case-{number}": tuple(reports) for number, reports in groups}


def _family_title(words: Strings, reports: tuple[CaseReport, ...]) -> str:
    key = f"numerics.case_{reports[0].case}"
    return words(key) if len(reports) > 1 and words.has(key) else reports[0].title


def numerics_values(library: Library) -> dict[str, object]:
    """The values for the template of the first page."""
    words, place, families = library.words, urls.Place(urls.NUMERICS), []
    for part, reports in case_families(library).items():
        href = place.href(KIND.part_path(part))
        rows = tuple(
            MatrixRow(report.title, f"{href}#{urls.encode(report.name)}", _matrix(words, report))
            for report in reports
        )
        families.append(CaseFamily(_family_title(words, reports), href, rows))
    return {
        "families": tuple(families),
        "integrators": INTEGRATORS,
        **_sources(library, place),
    }


def family_values(library: Library, part: str) -> dict[str, object]:
    """The values for the template of the page of a family."""
    words, place = library.words, urls.Place(KIND.part_path(part))
    reports = case_families(library)[part]
    return {
        "title": _family_title(words, reports),
        "up": place.href(KIND.path),
        "labs": tuple(_labs(library, place, reports)),
        "cases": tuple(case_view(words, report) for report in reports),
        **_sources(library, place),
    }


def _labs(
    library: Library, place: urls.Place, reports: tuple[CaseReport, ...]
) -> Iterator[LabLink]:
    """The first lab of each lesson whose label, `lab:NAME`, names a case or a family of them."""
    names = tuple(f"lab:{report.name}-" for report in reports)
    for owner, document in library.course.owned_documents:
        for anchor, _, _ in document_anchors(document):
            if anchor.startswith("lab:") and any(name.startswith(f"{anchor}-") for name in names):
                yield LabLink(owner.title, place.href(urls.owner_path(owner), anchor))
                break


def _sources(library: Library, place: urls.Place) -> dict[str, object]:
    """What was measured where, and the file with all of it."""
    texts = (grids.machine_text(library.words, case.machine) for case in library.reports.cases)
    return {"where": dict.fromkeys(texts), "file": place.href(urls.file_path(STABILITY.path()))}


def _matrix(words: Strings, report: CaseReport) -> tuple[tuple[MatrixCell, ...], ...]:
    part = report.main if report.main != "energy_drift" else ""
    orders = {
        row.integrator: (fit.value, f"{fit.value:.2f}")
        for row in (report.orders if part else ())
        if (fit := getattr(row, part)) is not None
    }
    limits = {
        line.integrator: (
            math.inf if line.largest == "all" else -math.inf,
            words(f"numerics.{line.largest}"),
        )
        if isinstance(line.largest, str)
        else (math.log2(line.largest), line.shown.partition(";")[0])
        for line in report.boundaries
    }
    costs = {name: (-math.log2(cost), seconds_text(cost, _DIGITS)) for name, cost in report.reached}
    return tuple(map(_cells, (limits, orders, costs)))


def _cells(figures: Mapping[str, tuple[float, str]]) -> tuple[MatrixCell, ...]:
    """Texts by integrator, and how many factors of two each is from the best; none without any."""
    if not figures:
        return ()
    best = max(size for size, _ in figures.values())
    cells = []
    for integrator in INTEGRATORS:
        size, text = figures.get(integrator, (-math.inf, ""))
        is_best = size == best > -math.inf
        shade = 0 if is_best else int(min(_SHADES, best - size))
        cells.append(MatrixCell(text, shade))
    return tuple(cells)


def case_view(words: Strings, report: CaseReport) -> CaseView:
    """A case as the page shows it."""
    label = words("numerics.orders", title=report.title)
    orders = scenario_view.orders_table(words, label, report.orders, merge=True)
    rows = [
        (
            line.integrator,
            (
                *scenario_view.stable_cells(words, line),
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
        Markup(chart_svg(chart, f"{name}-{number}", PAIR_SIZE, words))
        for number, chart in enumerate(report.charts, 1)
    ]
    return CaseView(
        name,
        report.title,
        tuple(_describe(words, report)),
        tuple(filter(None, drawings[:1])),
        tuple(filter(None, drawings[1:])),
        tuple(grid for grid in tables if grid is not None),
        tuple(_notes(words, report)),
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
    return [*notes, *scenario_view.lost_runs(words, runs)]
