"""Reports that nobody measured, as mjbench writes them and pages read them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import msgspec

from coursebuild.core.model import measurements
from coursebuild.core.model.report_files import VERSION, ReportKind
from coursebuild.core.model.results import Machine
from samples import cases, reports

_T = TypeVar("_T")
MACHINE = Machine(**msgspec.structs.asdict(reports.MACHINE))


def read(value: object, form: type[_T]) -> _T:
    """A report of mjbench as it is read from its file."""
    return msgspec.convert(msgspec.to_builtins(value), form)


def _maker(make: Callable[..., Any], form: type[_T]) -> Callable[..., _T]:
    def build(*arguments: Any, **fields: Any) -> _T:
        values, keywords = msgspec.to_builtins((arguments, fields))
        return read(make(*values, **keywords), form)

    return build


FIRST = read(reports.FIRST, measurements.FittedOrder)
interval = _maker(reports.interval, measurements.Interval)
row = _maker(reports.row, measurements.WorkPrecisionRow)
diverged_row = _maker(reports.diverged_row, measurements.WorkPrecisionRow)
scenario = _maker(reports.scenario, measurements.ScenarioReport)
swing = _maker(reports.swing, measurements.ScenarioReport)
awkward = _maker(reports.awkward, measurements.ScenarioReport)
scene = _maker(reports.scene, measurements.SceneReport)
case = _maker(cases.case, measurements.CaseReport)
run = _maker(cases.run, measurements.ErrorLine)


def file_of(kind: ReportKind[_T], report: _T) -> bytes:
    """A file with what is read of a report."""
    head = {"holds": f"mjbench {kind.name}", "version": VERSION}
    return msgspec.json.encode({**head, kind.field: report})
