"""The text that `stability` prints: what the page of a case says, and the errors of its plots.

Entry point: `stability_text`.
"""

from __future__ import annotations

from collections.abc import Sequence

from coursebuild.core.pages import urls
from coursebuild.features.bench.commands.grids import english, grid_lines, plain_text
from coursebuild.features.numerics.page import case_view
from coursebuild.numerics.reports.case_report import CaseReport, ErrorLine
from coursebuild.numerics.reports.plots import case_quantities
from coursebuild.numerics.reports.wording import seconds_text, status_text
from coursebuild.report.terminal import BOLD, Column, Style, table


def stability_text(reports: Sequence[CaseReport], style: Style) -> str:
    """The reports as text, with a blank line between cases."""
    return "\n".join(_case(report, style) for report in reports)


def _case(report: CaseReport, style: Style) -> str:
    view = case_view(english(), urls.Place(urls.NUMERICS), report)
    number = f"case {report.case}: " if report.case else ""
    lines = [style.paint(report.name, BOLD) + f"  {number}{report.title}"]
    for text in (*view.sentences, *view.notes):
        lines += style.wrap(plain_text(text), "  ")
    for block in (*(grid_lines(grid, style) for grid in view.grids), _errors(report)):
        lines += ["", *(f"  {line}".rstrip() for line in block)] if block else []
    return "\n".join(lines) + "\n"


def _errors(report: CaseReport) -> list[str]:
    """The largest error of each run, by timestep and integrator."""
    quantity = next(iter(case_quantities(report)), None)
    if quantity is None:
        return []
    runs = {(line.timestep, line.integrator): line for line in report.errors}
    steps = sorted({step for step, _ in runs}, reverse=True)

    def cell(run: ErrorLine | None) -> str:
        error = None if run is None else quantity.value_of(run)
        if run is None or error is None:
            return "" if run is None else status_text(run.status)
        return f"<{quantity.least:.1e}" if error <= quantity.least * (1 + 1e-9) else f"{error:.2e}"

    columns = [Column(quantity.label, tuple(seconds_text(h, 4) for h in steps), left=True)]
    for name in dict.fromkeys(name for _, name in runs):
        columns.append(Column(name, tuple(cell(runs.get((step, name))) for step in steps)))
    return table(columns)
