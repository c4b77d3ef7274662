"""The result of `bench`, `stability` and `diet`, and what they print besides their reports.

Entry points: `Measurement`, `measurement_text`, `measurement_json`; `format_checks`,
`failure_text`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Generic, TypeVar

from msgspec import Struct

from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.numerics.reports.departures import Departure, RecordCheck
from coursebuild.numerics.reports.records import ReportFailure
from coursebuild.report.text import (
    BOLD,
    FAINT,
    GREEN,
    RED,
    YELLOW,
    Column,
    Style,
    diagnostic_paragraphs,
    table,
    visible,
)
from coursebuild.report.values import json_text, plural

_T = TypeVar("_T")


class Measurement(Struct, Generic[_T], frozen=True):
    """The result of a command that measures."""

    reports: tuple[_T, ...]
    """Reports on models, by name, or on hard cases, by number."""
    diagnostics: tuple[Diagnostic, ...] = ()
    """Diagnostics of models and of what is declared for them."""
    failures: tuple[ReportFailure, ...] = ()
    checked: tuple[RecordCheck, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether everything was measured and agrees with the record, and nothing is to be done."""
        has_departures = any(check.departures for check in self.checked)
        has_errors = any(diagnostic.is_error for diagnostic in self.diagnostics)
        has_tasks = any(not getattr(report, "ok", True) for report in self.reports)
        return not (has_errors or self.failures or has_departures or has_tasks)


def measurement_text(reports: str, measurement: Measurement[_T], style: Style) -> str:
    """Write diagnostics, failures, the text of the reports, checks and remarks."""
    parts = list(diagnostic_paragraphs(measurement.diagnostics, style))
    parts += ["".join(failure_text(failure, style) for failure in measurement.failures), reports]
    parts += [format_checks(measurement.checked, style)]
    parts += ["".join(f"{visible(remark)}\n" for remark in measurement.remarks)]
    return "\n".join(part for part in parts if part)


def measurement_json(reports: Mapping[str, object], measurement: Measurement[_T]) -> str:
    """Write the same as one JSON object."""
    rest = {name: getattr(measurement, name) for name in Measurement.__struct_fields__[1:]}
    return json_text({**reports, **rest})


def failure_text(failure: ReportFailure, style: Style) -> str:
    """Say what is wrong with a recorded report, and how to mend it."""
    text = f"{style.paint('error', RED)}{style.paint(f': {visible(failure.message)}', BOLD)}\n"
    return text + (f"  help: {visible(failure.help)}\n" if failure.help else "")


def format_checks(checks: Sequence[RecordCheck], style: Style) -> str:
    """Say of each recorded report that it holds, or which figures left their bands."""
    return "\n".join(_format_check(check, style) for check in checks)


def _format_check(check: RecordCheck, style: Style) -> str:
    if check.departures:
        figures = plural(len(check.departures), "figure")
        verdict = style.paint(f"{figures} not as recorded in {visible(check.path)}", RED)
    else:
        verdict = style.paint(f"as recorded in {visible(check.path)}", GREEN)
    lines = [f"{style.paint(visible(check.name), BOLD)}  {verdict}"]
    lines += ["  " + style.paint(visible(remark), YELLOW) for remark in check.remarks]
    for place in dict.fromkeys(departure.where for departure in check.departures):
        head, *rows = _departure_table([d for d in check.departures if d.where == place])
        lines += ["", "  " + style.paint(visible(place), BOLD), "    " + style.paint(head, FAINT)]
        lines += [f"    {row}" for row in rows]
    return "\n".join(lines) + "\n"


def _departure_table(departures: Sequence[Departure]) -> list[str]:
    names = ("setting", "figure", "recorded", "measured", "band")
    return table(
        [
            Column(
                name,
                tuple(getattr(departure, name) for departure in departures),
                left=name not in ("recorded", "measured"),
            )
            for name in names
        ]
    )
