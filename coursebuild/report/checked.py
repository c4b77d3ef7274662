"""Recorded reports held against what was measured, as text.

Entry points: `checked_text`, `failure_text`.
"""

from __future__ import annotations

from collections.abc import Sequence

from coursebuild.numerics.reports.departures import Checked, Departure
from coursebuild.numerics.reports.records import Failure
from coursebuild.report.table import Column, table
from coursebuild.report.text import Style, visible
from coursebuild.report.values import plural

_BOLD, _RED, _YELLOW, _GREEN, _FAINT = "1", "1;31", "1;33", "32", "2"
_INDENT = "  "


def checked_text(checked: Sequence[Checked], style: Style) -> str:
    """Each report: as it was recorded, or all that left its band."""
    return "\n".join(_report(one, style) for one in checked)


def failure_text(failure: Failure, style: Style) -> str:
    """What is wrong with a recorded report, and how to mend it."""
    text = f"{style.paint('error', _RED)}{style.paint(f': {visible(failure.message)}', _BOLD)}\n"
    return text + (f"  help: {visible(failure.help)}\n" if failure.help else "")


def _report(one: Checked, style: Style) -> str:
    head = style.paint(visible(one.name), _BOLD)
    if one.departures:
        many = plural(len(one.departures), "figure")
        said = style.paint(f"{many} not as recorded in {visible(one.path)}", _RED)
    else:
        said = style.paint(f"as recorded in {visible(one.path)}", _GREEN)
    lines = [f"{head}  {said}"]
    lines += [_INDENT + style.paint(visible(remark), _YELLOW) for remark in one.remarks]
    for where in dict.fromkeys(departure.where for departure in one.departures):
        found = [departure for departure in one.departures if departure.where == where]
        lines += ["", _INDENT + style.paint(visible(where), _BOLD)]
        head, *rows = _rows(found)
        lines += [2 * _INDENT + style.paint(head, _FAINT)]
        lines += [2 * _INDENT + row for row in rows]
    return "\n".join(lines) + "\n"


def _rows(found: Sequence[Departure]) -> list[str]:
    columns = [
        Column("setting", tuple(one.setting for one in found), 0, left=True),
        Column("figure", tuple(one.figure for one in found), 0, left=True),
        Column("recorded", tuple(one.recorded for one in found), 0),
        Column("measured", tuple(one.measured for one in found), 0),
        Column("band", tuple(one.band for one in found), 0, left=True),
    ]
    return table(columns, 10_000)
