"""What the page of the hard cases shows.

Entry point: `numerics_values(library)`.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.strings import Strings
from coursebuild.features.bench.figures import (
    FigurePart,
    Grid,
    about_reference,
    again,
    bounded,
    exact,
    grid,
    percent,
    power,
    sentence,
)
from coursebuild.features.bench.scenarios import (
    ORDERS,
    STABLE,
    lost_runs,
    stable_again,
    stable_cells,
    stable_title,
)
from coursebuild.numerics.reports.cases import (
    BoundaryLine,
    CaseReport,
    Cells,
    ErrorLine,
    FigureLine,
    merged,
)
from coursebuild.numerics.reports.points import FLOORS, integrator_rank, seconds_text, status_text
from coursebuild.numerics.reports.records import STABILITY

_QUANTITIES = (
    ("position", "measured.position"),
    ("attitude", "measured.attitude"),
    ("velocity", "measured.velocity"),
)
_BOUNDARY = (
    *STABLE,
    "measured.theory",
    "measured.difference",
    "measured.beyond",
    "measured.growth",
    "measured.remark",
)
_FIGURE = ("numerics.measured", "numerics.exact", "measured.difference")
_Rows = list[tuple[str, Cells]]
"""Integrators, and what is said of each."""


class CaseView(Struct, frozen=True):
    """A hard case."""

    name: str
    title: str
    about: tuple[str, ...]
    """What it is and what it was held against, a sentence each."""
    grids: tuple[Grid, ...]
    errors: tuple[Grid, ...]
    """Errors by timestep, which are many."""
    notes: tuple[str, ...]
    command: str


class CaseGroup(Struct, frozen=True):
    """Cases of one number."""

    number: int
    title: str
    cases: tuple[CaseView, ...]


def numerics_values(library: Library) -> dict[str, object]:
    """What the page of the hard cases shows."""
    words, place = library.words, urls.Place(urls.NUMERICS)
    cases = library.reports.cases
    numbers = sorted({one.case for one in cases})
    groups = tuple(_group(words, n, [one for one in cases if one.case == n]) for n in numbers)
    return {
        "groups": groups,
        "engine": ", ".join(sorted({one.engine for one in cases})),
        "file": place.href(urls.file_path(STABILITY.path())),
        "command": again("stability", "--record"),
    }


def _group(words: Strings, number: int, cases: Sequence[CaseReport]) -> CaseGroup:
    first = cases[0].title
    key = f"numerics.case_{number}"
    title = words(key) if len(cases) > 1 and words.has(key) else first
    return CaseGroup(number, title, tuple(_case(words, one) for one in cases))


def _case(words: Strings, report: CaseReport) -> CaseView:
    grids = (_boundaries(words, report), _figures(words, report), _orders(words, report))
    return CaseView(
        report.name,
        report.title,
        tuple(_about(words, report)),
        tuple(one for one in grids if one is not None),
        tuple(_errors(words, report)),
        tuple(_notes(words, report)),
        again("stability", report.name),
    )


def _about(words: Strings, report: CaseReport) -> list[str]:
    told = [sentence(report.note)] if report.note else []
    found = report.reference
    return told if found is None else [*told, *about_reference(words, found.kind, found)]


def _grid(
    words: Strings, label: str, titles: Sequence[str], rows: _Rows, *, left: str = ""
) -> Grid | None:
    if not rows:
        return None
    found = merged(rows)
    columns = [(words("measured.integrator"), list(found.values()))]
    columns += [(title, [row[n] for row in found]) for n, title in enumerate(titles)]
    return grid(label, columns, words=(left,))


def _boundaries(words: Strings, report: CaseReport) -> Grid | None:
    rows = [(line.integrator, _boundary(words, line)) for line in report.boundaries]
    titles = [words(key) for key in _BOUNDARY]
    label = f"{report.title}: {stable_title(words, report.boundaries[0])}" if rows else ""
    return _grid(words, label, titles, rows, left=words("measured.remark"))


def _boundary(words: Strings, line: BoundaryLine) -> tuple[str, ...]:
    theory = seconds_text(line.theory) if line.theory else ""
    if line.formula and not line.theory:
        theory = words("numerics.all" if line.theory is None else "numerics.none")
    return (
        *stable_cells(words, line),
        theory,
        percent(line.difference),
        status_text(line.beyond) if line.beyond else "",
        "" if line.growth is None else f"{line.growth:.9f}",
        stable_again(words, line),
    )


def _figures(words: Strings, report: CaseReport) -> Grid | None:
    """Quantities that are known."""
    if not report.figures:
        return None
    names: list[str] = []
    cells: list[tuple[str, ...]] = []
    parts: list[FigurePart] = []
    for name in dict.fromkeys(line.name for line in report.figures):
        lines = [line for line in report.figures if line.name == name]
        rows = merged((line.integrator, _figure(words, line)) for line in lines)
        names += rows.values()
        cells += rows
        unit, sources = lines[0].unit, dict.fromkeys(one.source for one in lines if one.source)
        title = sentence(f"{name} ({unit})" if unit else name).removesuffix(".")
        parts.append(FigurePart(title, "; ".join(sources), len(rows)))
    columns = [(words("measured.integrator"), names)]
    for n, key in enumerate(_FIGURE):
        columns.append((words(key), [row[n] for row in cells]))
    label = words("numerics.figures", title=report.title)
    return grid(label, columns, parts=tuple(parts))


def _figure(words: Strings, line: FigureLine) -> tuple[str, ...]:
    measured = words("numerics.infinite") if line.measured is None else exact(line.measured)
    difference: str = ""
    if line.exact is not None and line.measured is not None:
        difference = power(line.measured - line.exact, 2)
    return measured, exact(line.exact), difference


def _orders(words: Strings, report: CaseReport) -> Grid | None:
    shown = [o for o in report.orders if (o.position, o.attitude, o.velocity) != (None, None, None)]
    rows: _Rows = []
    for one in shown:
        values = (one.position, one.attitude, one.velocity)
        rows.append((one.integrator, tuple("" if v is None else f"{v:.3f}" for v in values)))
    titles = [words(key) for _, key in ORDERS]
    return _grid(words, words("numerics.orders", title=report.title), titles, rows)


def _errors(words: Strings, report: CaseReport) -> list[Grid]:
    """Errors by timestep and integrator, a table for each quantity."""
    found = []
    least = 0.0 if report.reference is None else FLOORS * report.reference.floor
    lines = {(one.timestep, one.integrator): one for one in report.errors}
    steps = sorted({one.timestep for one in report.errors}, reverse=True)
    names = sorted({one.integrator for one in report.errors}, key=integrator_rank)
    for quantity, key in _QUANTITIES:
        if all(getattr(one, quantity) is None for one in report.errors):
            continue
        columns = [(words("measured.timestep"), [seconds_text(step) for step in steps])]
        for name in names:
            cells = [_error(lines.get((step, name)), quantity, least) for step in steps]
            columns.append((name, cells))
        label = words("numerics.errors", quantity=words(key))
        found.append(grid(label, columns))
    return found


def _error(line: ErrorLine | None, quantity: str, least: float) -> str:
    if line is None:
        return ""
    if line.status != "ok":
        return status_text(line.status)
    pair: tuple[float, float] | None = getattr(line, quantity)
    return bounded(None if pair is None else pair[0], least)


def _notes(words: Strings, report: CaseReport) -> list[str]:
    notes = []
    formulas = dict.fromkeys(line.formula for line in report.boundaries if line.formula)
    if formulas:
        notes.append(words("numerics.theory", sources="; ".join(formulas)))
    softened = sorted({line.timestep for line in report.errors if line.refsafe})
    if softened:
        times = ", ".join(seconds_text(step) for step in softened)
        notes.append(words("measured.refsafe", settings=times))
    runs = ((f"{one.integrator} at {seconds_text(one.timestep)}", one) for one in report.errors)
    return [*notes, *lost_runs(runs)]
