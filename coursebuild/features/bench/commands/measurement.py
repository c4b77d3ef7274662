"""What `bench`, `stability` and `diet` print around what they measured.

Entry points: `Measurement`, `measured_text`, `measured_json`; `checked_text`, `failure_text`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Generic, TypeVar

from msgspec import Struct

from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.numerics.reports.departures import Departure, RecordCheck
from coursebuild.numerics.reports.records import ReportFailure
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
from coursebuild.report.values import json_text, plural

_T = TypeVar("_T")


class Measurement(Struct, Generic[_T], frozen=True):
    """What a run of a command that measures found."""

    reports: tuple[_T, ...]
    """On models by name, on hard cases by number."""
    diagnostics: tuple[Diagnostic, ...] = ()
    """Of models and what is declared for them."""
    failures: tuple[ReportFailure, ...] = ()
    checked: tuple[RecordCheck, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether everything was measured, is as it was recorded, and nothing is to be done."""
        departed = any(one.departures for one in self.checked)
        wrong = any(one.is_error for one in self.diagnostics)
        open_ones = any(not getattr(one, "ok", True) for one in self.reports)
        return not (wrong or self.failures or departed or open_ones)


def measured_text(measured: str, found: Measurement[_T], style: Style) -> str:
    """What is wrong, what was measured, how it differs from what was recorded, what was done."""
    parts = [diagnostic_text(one, style) + "\n" for one in found.diagnostics]
    parts += ["".join(failure_text(one, style) for one in found.failures), measured]
    parts += [checked_text(found.checked, style)]
    parts += ["".join(f"{visible(one)}\n" for one in found.remarks)]
    return "\n".join(part for part in parts if part)


def measured_json(measured: Mapping[str, object], found: Measurement[_T]) -> str:
    """The same as one JSON object."""
    around = {name: getattr(found, name) for name in Measurement.__struct_fields__[1:]}
    return json_text({**measured, **around})


def failure_text(failure: ReportFailure, style: Style) -> str:
    """What is wrong with a recorded report, and how to mend it."""
    text = f"{style.paint('error', RED)}{style.paint(f': {visible(failure.message)}', BOLD)}\n"
    return text + (f"  help: {visible(failure.help)}\n" if failure.help else "")


def checked_text(checked: Sequence[RecordCheck], style: Style) -> str:
    """Each recorded report: as it was recorded, or all that left its band."""
    return "\n".join(_checked(one, style) for one in checked)


def _checked(one: RecordCheck, style: Style) -> str:
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
    names = ("setting", "figure", "recorded", "measured", "band")
    return table(
        [
            Column(n, tuple(getattr(o, n) for o in found), left=n not in ("recorded", "measured"))
            for n in names
        ]
    )
