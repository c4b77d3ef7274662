"""Reports that nobody measured, as mjbench writes them and pages read them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import msgspec
from msgspec import structs

from coursebuild.core.model import measurements
from coursebuild.core.model.report_files import VERSION, ReportKind
from coursebuild.core.model.results import Machine
from mjbench.derive import derive_case, derive_charts, derive_scenario
from mjbench.reports.model_report import CaseReport, SceneReport
from mjbench.reports.scene_report import ScenarioReport
from samples import cases, reports

_T = TypeVar("_T")
MACHINE = Machine(**structs.asdict(reports.MACHINE))


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


def derived(report: ScenarioReport) -> ScenarioReport:
    """The report with all that mjbench says of it, but for its verdict."""
    whole = derive_charts(derive_scenario(report, lambda _: ()))
    return structs.replace(whole, verdict=report.verdict)


def _scenario(rows: list[dict[str, Any]], **fields: Any) -> ScenarioReport:
    whole = reports.scenario(rows, **fields)
    return derived(msgspec.convert(msgspec.to_builtins(whole), ScenarioReport))


def _case(*arguments: Any, **fields: Any) -> CaseReport:
    whole = msgspec.to_builtins(cases.case(*arguments, **fields))
    return derive_case(msgspec.convert(whole, CaseReport))


def _scene(*scenarios: Any, **fields: Any) -> SceneReport:
    return reports.scene(*(scenarios or [derived(reports.swing())]), **fields)


scenario = _maker(_scenario, measurements.ScenarioReport)
swing = _maker(lambda: derived(reports.swing()), measurements.ScenarioReport)
awkward = _maker(lambda: derived(reports.awkward()), measurements.ScenarioReport)
scene = _maker(_scene, measurements.SceneReport)
case = _maker(_case, measurements.CaseReport)
run = _maker(cases.run, measurements.ErrorLine)


def file_of(kind: ReportKind[_T], report: _T) -> bytes:
    """A file with what is read of a report."""
    head = {"holds": f"mjbench {kind.name}", "version": VERSION}
    return msgspec.json.encode({**head, kind.field: report})
