"""Hard cases of a course's own: scenarios of models whose exact motion it says.

Entry points: `course_cases(report)`; `exact_file(model)`, in which the motion stands.
"""

from __future__ import annotations

from msgspec.structs import asdict

from coursebuild.numerics.reports.bench import (
    ScenarioReport,
    SceneReport,
    StableRow,
    WorkPrecisionRow,
)
from coursebuild.numerics.reports.cases import (
    BoundaryLine,
    CaseReport,
    ErrorLine,
    ReferenceLine,
    StepCost,
)
from coursebuild.numerics.reports.text import solving, usual_setting


def exact_file(model: str) -> str:
    """Where a course says the exact motion of a model, if it knows it."""
    return f"models/{model}.exact.py"


def course_cases(report: SceneReport) -> tuple[CaseReport, ...]:
    """The scenarios of a model whose exact motion the course says in its `exact.py`."""
    known = (one for one in report.scenarios if one.source == exact_file(report.model))
    return tuple(_course_case(report, one) for one in known)


def _course_case(report: SceneReport, scenario: ScenarioReport) -> CaseReport:
    usual = usual_setting(scenario.rows)
    rows = [row for row in scenario.rows if usual and solving(row.setting) == solving(usual)]
    steps = {
        row.setting.integrator: row.seconds.scaled(row.setting.timestep)
        for row in reversed(rows)
        if row.seconds is not None
    }
    floors = scenario.floor, scenario.floor, scenario.velocity_floor
    return CaseReport(
        name=f"{report.model}/{scenario.name}",
        title=f"{report.model}: {scenario.title or scenario.name}",
        case=0,
        machine=report.machine,
        note="; ".join(scenario.notes),
        reference=ReferenceLine(scenario.reference, scenario.source, scenario.second, *floors),
        boundaries=tuple(_boundary(row) for row in scenario.stable),
        figures=(),
        orders=scenario.orders,
        errors=tuple(_error_line(row) for row in rows),
        costs=tuple(StepCost(name, seconds) for name, seconds in steps.items()),
    )


def _boundary(row: StableRow) -> BoundaryLine:
    return BoundaryLine(
        **asdict(row), theory=None, formula="", difference=None, beyond="", growth=None
    )


def _error_line(row: WorkPrecisionRow) -> ErrorLine:
    names = set(ErrorLine.__struct_fields__) - {"integrator", "timestep"}
    return ErrorLine(
        integrator=row.setting.integrator,
        timestep=row.setting.timestep,
        **{name: getattr(row, name) for name in names},
    )
