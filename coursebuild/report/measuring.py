"""What `bench`, `stability` and `diet` print around what they measured.

Entry points: `measured_text`, `measured_json`; `checked_text`, `failure_text`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.numerics.reports.departures import Checked, Departure
from coursebuild.numerics.reports.records import ReportFailure
from coursebuild.report.plain import json_text
from coursebuild.report.terminal import (
    BOLD,
    FAINT,
    GREEN,
    RED,
    YELLOW,
    Column,
    Style,
    table,
    visible,
)
from coursebuild.report.text import diagnostic_text
from coursebuild.report.values import plural


def measured_text(
    measured: str,
    style: Style,
    *,
    diagnostics: Sequence[Diagnostic] = (),
    failures: Sequence[ReportFailure] = (),
    checked: Sequence[Checked] = (),
    remarks: Sequence[str] = (),
) -> str:
    """What is wrong, what was measured, how it differs from what was recorded, what was done."""
    parts = [diagnostic_text(one, style) + "\n" for one in diagnostics]
    parts += ["".join(failure_text(one, style) for one in failures), measured]
    parts += [checked_text(checked, style), "".join(f"{visible(one)}\n" for one in remarks)]
    return "\n".join(part for part in parts if part)


def measured_json(
    measured: Mapping[str, object],
    *,
    diagnostics: Sequence[Diagnostic] = (),
    failures: Sequence[ReportFailure] = (),
    checked: Sequence[Checked] = (),
    remarks: Sequence[str] = (),
) -> str:
    """The same as one JSON object."""
    return json_text(
        {
            **measured,
            "diagnostics": diagnostics,
            "failures": failures,
            "checked": checked,
            "remarks": remarks,
        }
    )


def failure_text(failure: ReportFailure, style: Style) -> str:
    """What is wrong with a recorded report, and how to mend it."""
    text = f"{style.paint('error', RED)}{style.paint(f': {visible(failure.message)}', BOLD)}\n"
    return text + (f"  help: {visible(failure.help)}\n" if failure.help else "")


def checked_text(checked: Sequence[Checked], style: Style) -> str:
    """Each recorded report: as it was recorded, or all that left its band."""
    return "\n".join(_checked(one, style) for one in checked)


def _checked(one: Checked, style: Style) -> str:
    if one.departures:
        many = plural(len(one.departures), "figure")
        said = style.paint(f"{many} not as recorded in {visible(one.path)}", RED)
    else:
        said = style.paint(f"as recorded in {visible(one.path)}", GREEN)
    lines = [f"{style.paint(visible(one.name), BOLD)}  {said}"]
    lines += ["  " + style.paint(visible(remark), YELLOW) for remark in one.remarks]
    for where in dict.fromkeys(departure.where for departure in one.departures):
        head, *rows = _rows([each for each in one.departures if each.where == where])
        lines += ["", "  " + style.paint(visible(where), BOLD), "    " + style.paint(head, FAINT)]
        lines += [f"    {row}" for row in rows]
    return "\n".join(lines) + "\n"


def _rows(found: Sequence[Departure]) -> list[str]:
    return table(
        [
            Column("setting", tuple(one.setting for one in found), left=True),
            Column("figure", tuple(one.figure for one in found), left=True),
            Column("recorded", tuple(one.recorded for one in found)),
            Column("measured", tuple(one.measured for one in found)),
            Column("band", tuple(one.band for one in found), left=True),
        ]
    )
