"""The plots of a hard case as SVG: error, or energy drift, against processor time.

Entry points: `case_quantities(report)`, what can be drawn; `case_svg(report, quantity, name)`.
"""

from __future__ import annotations

from collections.abc import Iterator

from coursebuild.numerics.reports.bench import FLOORS
from coursebuild.numerics.reports.cases import CaseReport
from coursebuild.numerics.reports.chart import BESIDE, Chart, Line, Point, chart_svg
from coursebuild.numerics.reports.text import KNOWN, Quantity, seconds_text, status_text


def case_quantities(report: CaseReport) -> tuple[Quantity, ...]:
    """The error that says most, and energy drift where energy is conserved."""
    known = report.reference
    errors = (
        Quantity("position", "error of position (m or rad)", FLOORS * known.position),
        Quantity("attitude", "error of attitude (rad)", FLOORS * known.attitude),
        Quantity("velocity", "error of velocity (m/s or rad/s)", FLOORS * known.velocity),
    )
    drift = Quantity("energy_drift", "energy drift, relative")
    runs = [line for line in report.errors if line.status == "ok"]
    return (*[one for one in errors if one.tells(runs)][:1], *[drift] * drift.tells(runs))


def case_svg(report: CaseReport, quantity: Quantity, name: str) -> str:
    """The plot as an `svg` element; empty where nothing was timed.

    `name` is unlike those of all other plots on the page.
    """
    lines = tuple(
        Line(integrator, number, tuple(points))
        for number, integrator in enumerate(KNOWN)
        if (points := [*_points(report, quantity, integrator)])
    )
    chart = Chart(
        title=f"{report.title}: {quantity.label} against processor time",
        text=" ".join(_range(line) for line in lines if line.drawn),
        axes=("processor time for a simulated second (s)", quantity.label),
        lines=lines,
        least=quantity.least,
    )
    return chart_svg(chart, name, BESIDE)


def _points(report: CaseReport, quantity: Quantity, integrator: str) -> Iterator[Point]:
    """By timestep; without runs of which nothing is off, for which there is no place."""
    for run in report.errors:
        cost = report.cost(run)
        if run.integrator != integrator or cost is None:
            continue
        if run.status != "ok":
            told = f"{integrator} at {seconds_text(run.timestep)}: {status_text(run.status)}"
            yield Point(cost, None, told)
        elif error := quantity.of(run):
            yield Point(cost, error, f"{integrator}: {error:.3g} at {seconds_text(cost.value, 3)}")


def _range(line: Line) -> str:
    (x0, y0), *_, (x1, y1) = [(p.x.value, p.y) for p in (*line.drawn, line.drawn[-1])]
    return f"{line.name}: {y0:.2g} at {seconds_text(x0, 2)}, {y1:.2g} at {seconds_text(x1, 2)}."
