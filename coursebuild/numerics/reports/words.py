"""What a work–precision plot says in words: titles of its points, and itself for who cannot see it.

Entry points: `described`, `point_title`, `lane_text`.
"""

from __future__ import annotations

from coursebuild.numerics.reports.bench import ScenarioReport
from coursebuild.numerics.reports.points import (
    Chart,
    Line,
    Point,
    seconds_text,
    setting_text,
    status_text,
)


def described(report: ScenarioReport, found: Chart) -> tuple[str, str]:
    """The title of the plot, and what is to be seen in it."""
    label = found.quantity.label
    against = "cost" if found.timed else "steps"
    title = f"{report.title or report.name}: error of {label} against {against}"
    parts = [_range(line) for line in found.lines if line.points or line.others]
    parts += [f"{lane_text(line)}." for line in found.lines if line.lost or line.stable == 0]
    own = next((n for n, row in enumerate(report.rows) if row.own), None)
    if own is not None:
        parts.append(f"The scene’s own setting is {setting_text(report.rows[own].setting)}.")
    if report.verdict.text:
        parts.append(report.verdict.text)
    if found.quantity.floor > 0:
        parts.append(f"No error below {found.quantity.least:.1e} is given.")
    return title, " ".join(parts)


def _range(line: Line) -> str:
    points = [*line.points, *line.others]
    errors = [p.error for p in points if p.error is not None]
    costs = [p.cost for p in points]
    spread = f"{min(errors):.2g}"
    if max(errors) > min(errors):
        spread = f"{max(errors):.2g} to {spread}"
    cost = f"{min(costs):.3g}"
    if max(costs) > min(costs):
        cost = f"{cost} to {max(costs):.3g}"
    return f"{line.integrator}: errors {spread} at costs of {cost}."


def point_title(report: ScenarioReport, found: Chart, point: Point) -> str:
    """What a point says when it is pointed at."""
    row = report.rows[point.row]
    parts = [setting_text(row.setting)]
    if point.error is None:
        parts.append("; ".join((status_text(row.status), *row.reasons)))
    else:
        parts.append(f"error {point.error:.3g}")
    if point.timed:
        parts.append(f"cost {point.cost:.3g}")
    elif found.timed:
        parts.append("not timed")
    parts.append(f"{row.steps} steps")
    if row.own:
        parts.append("the scene’s own setting")
    if row.front:
        parts.append("on the Pareto front")
    elif row.dominated_by is not None and 0 <= row.dominated_by < len(report.rows):
        better = setting_text(report.rows[row.dominated_by].setting, row.setting)
        parts.append(f"{better} is better")
    return " · ".join(parts)


def lane_text(line: Line) -> str:
    """What was lost of an integrator, and where it is stable."""
    if line.stable == 0:
        return f"{line.integrator} is never stable"
    if line.stable is not None:
        return f"{line.integrator} is stable up to {seconds_text(line.stable, 3)}"
    many = len(line.lost)
    return f"{line.integrator} lost {'a run' if many == 1 else f'{many} runs'}"
