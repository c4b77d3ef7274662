"""What `stability` prints of the hard cases: their errors, references, boundaries and figures.

Entry point: `stability_text`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from coursebuild.features.bench.commands.grids import english
from coursebuild.features.bench.scenarios import (
    ORDERS,
    STABLE,
    lost_runs,
    stable_again,
    stable_cells,
    stable_title,
)
from coursebuild.numerics.reports.bench import FittedOrder
from coursebuild.numerics.reports.case_plot import case_quantities
from coursebuild.numerics.reports.cases import (
    BoundaryLine,
    CaseReport,
    Cells,
    ErrorLine,
    FigureLine,
    ReferenceLine,
    merged,
)
from coursebuild.numerics.reports.text import seconds_text
from coursebuild.report.terminal import (
    BOLD,
    FAINT,
    YELLOW,
    Column,
    Style,
    table,
)

_BOUNDARY = (
    *STABLE,
    "measured.theory",
    "measured.difference",
    "measured.beyond",
    "measured.growth",
)
_KNOWN = ("numerics.exact", "measured.difference")


def stability_text(reports: Sequence[CaseReport], style: Style) -> str:
    """As text: for each case its reference, boundaries, known quantities and orders."""
    return "\n".join(_case(report, style) for report in reports)


def _case(report: CaseReport, style: Style) -> str:
    number = f"case {report.case}: " if report.case else ""
    lines = [style.paint(f"{report.name}", BOLD) + f"  {number}{report.title}"]
    lines += [f"  {line}" for line in _reference(report.reference)]
    if report.note:
        lines.append(f"  {report.note}")
    if report.boundaries:
        rows = [(line.integrator, _boundary(line)) for line in report.boundaries]
        lines.append(f"  {style.paint(stable_title(english(), report.boundaries[0]), FAINT)}")
        lines += _table(map(english(), _BOUNDARY), rows)
        again = [(line.integrator, stable_again(english(), line)) for line in report.boundaries]
        lines += [f"  {integrator}: {told}" for integrator, told in again if told]
    for name in dict.fromkeys(line.name for line in report.figures):
        found = [line for line in report.figures if line.name == name]
        rows = [(line.integrator, _figure(line)) for line in found]
        lines += _table((name, *map(english(), _KNOWN)), rows)
    fitted: list[tuple[str, Cells]] = [
        (o.integrator, (_order(o.position), _order(o.attitude), _order(o.velocity)))
        for o in report.orders
        if o.there
    ]
    if fitted:
        lines += _table((english()(key) for _, key in ORDERS), fitted)
    lines += _errors(report)
    softened = sorted({line.timestep for line in report.errors if line.refsafe})
    if softened:
        times = ", ".join(map(seconds_text, softened))
        lines.append(f"  {english()('measured.refsafe', settings=times)}")
    runs = ((f"{one.integrator} at {seconds_text(one.timestep)}", one) for one in report.errors)
    lines += [style.paint(f"  {told}", YELLOW) for told in lost_runs(runs)]
    return "\n".join(lines) + "\n"


def _errors(report: CaseReport) -> list[str]:
    """The largest error of each run, by timestep and integrator."""
    shown = next(iter(case_quantities(report)), None)
    if shown is None:
        return []
    runs = {(one.timestep, one.integrator): one for one in report.errors}
    steps = sorted({step for step, _ in runs}, reverse=True)

    def cell(run: ErrorLine | None) -> str:
        error = None if run is None else shown.of(run)
        if run is None or error is None:
            return "" if run is None else run.status
        return f"<{shown.least:.1e}" if error <= shown.least * (1 + 1e-9) else f"{error:.2e}"

    columns = [Column(shown.label, tuple(seconds_text(one, 4) for one in steps), left=True)]
    for name in dict.fromkeys(name for _, name in runs):
        columns.append(Column(name, tuple(cell(runs.get((step, name))) for step in steps)))
    return [f"  {line}" for line in table(columns)]


def _reference(line: ReferenceLine) -> list[str]:
    sizes = f"{max(line.position, line.attitude):.0e}, velocities to {line.velocity:.0e}"
    return [
        f"reference ({line.kind}, known to {sizes}): {line.source}",
        f"second: {line.second}",
    ]


def _boundary(line: BoundaryLine) -> Cells:
    theory = _seconds(line.theory) if line.theory else ""
    if line.formula and not line.theory:
        theory = "all" if line.theory is None else "none"
    growth = "" if line.growth is None else f"{line.growth:.9f}"
    difference = "" if line.difference is None else f"{100 * line.difference:+.3f} %"
    return *stable_cells(english(), line), theory, difference, line.beyond, growth


def _figure(line: FigureLine) -> Cells:
    unit = f" {line.unit}" if line.unit else ""
    measured = "not finite" if line.measured is None else f"{line.measured:.10g}{unit}"
    if line.spread is not None:
        measured = f"{line.measured:.3g}{unit} ({line.spread[0]:.3g} to {line.spread[1]:.3g})"
    exact = "" if line.exact is None else f"{line.exact:.10g}{unit}"
    difference = ""
    if line.exact is not None and line.measured is not None:
        difference = f"{line.measured - line.exact:+.1e}"
    return measured, exact, difference


def _order(fit: FittedOrder | None) -> str:
    return "" if fit is None else fit.text


def _seconds(value: float) -> str:
    return f"{value:.6g} s"


def _table(titles: Iterable[str], rows: Sequence[tuple[str, Cells]]) -> list[str]:
    """What is said of integrators under its titles, in columns; their names stand behind."""
    lines = [(*cells, names) for cells, names in merged(rows).items()]
    columns = zip((*titles, ""), zip(*lines, strict=True), strict=True)
    return [f"  {line}" for line in table([Column(t, cells, left=True) for t, cells in columns])]
