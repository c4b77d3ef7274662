"""What was measured on a hard case.

Entry points: `CaseReport`; `merged`, integrators of which the same is said; `course_cases(report)`,
the hard cases of a course's own: scenarios of models whose exact motion stands in `exact_file`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import TypeAlias

from msgspec.structs import asdict

from coursebuild.core.model.results import Machine
from coursebuild.numerics.reports import Interval, Record
from coursebuild.numerics.reports.bench import (
    MeasuredRun,
    OrderRow,
    ScenarioReport,
    SceneReport,
    StableRow,
    WorkPrecisionRow,
)


class BoundaryLine(StableRow, frozen=True):
    """The largest stable timestep of an integrator, beside theory."""

    theory: float | None
    """s, as `largest`; `None` also where there is no theory and so no formula."""
    formula: str
    """Where the theory comes from; empty where there is none."""
    difference: float | None
    """Measured against theory, relative."""
    beyond: str
    """How the first unstable one tried went."""
    growth: float | None
    """By what the velocities were multiplied in a step there, where they stayed finite."""


class FigureLine(Record, frozen=True):
    """A quantity that was measured and is known."""

    name: str
    unit: str
    integrator: str
    measured: float | None
    """`None` where it is not finite."""
    exact: float | None
    """`None` where theory does not say it."""
    source: str
    spread: tuple[float, float] | None = None
    """Of an ensemble, between what eight tenths of it lie; `measured` is the middle one then."""


class StepCost(Record, frozen=True):
    """What a step of an integrator takes."""

    integrator: str
    seconds: Interval
    """Processor time on the machine of the report."""


class ErrorLine(MeasuredRun, frozen=True):
    """An integrator at a timestep."""

    integrator: str
    timestep: float
    """s."""


class ReferenceLine(Record, frozen=True):
    """What the errors were measured against."""

    kind: str
    """`closed` or `ode`."""
    source: str
    second: str
    """The source of the second reference."""
    position: float
    """How far the two are apart, m or rad: no more is known."""
    attitude: float
    """rad."""
    velocity: float
    """m/s or rad/s."""


class CaseReport(Record, frozen=True):
    """Everything that was measured on a hard case."""

    name: str
    title: str
    case: int
    """Its number on the list of hard cases; 0 for one of the course's own."""
    machine: Machine
    note: str
    reference: ReferenceLine
    boundaries: tuple[BoundaryLine, ...]
    figures: tuple[FigureLine, ...]
    orders: tuple[OrderRow, ...]
    errors: tuple[ErrorLine, ...]
    costs: tuple[StepCost, ...]

    def cost(self, line: ErrorLine) -> Interval | None:
        """Processor time for a simulated second, s; `None` where the integrator was not timed."""
        found = (one.seconds for one in self.costs if one.integrator == line.integrator)
        step = next(found, None)
        return None if step is None else step.scaled(1 / line.timestep)

    def cost_to(self, integrator: str, error: float) -> float | None:
        """The same for what is right to an error, m or rad; `None` where no run is.

        Between two runs it goes by powers. No timestep longer than those tried is thought of.
        """
        runs = sorted(
            (cost.value, max(pair[0] for pair in places))
            for line in self.errors
            if line.integrator == integrator and (cost := self.cost(line)) is not None
            if (places := [pair for pair in (line.position, line.attitude) if pair is not None])
        )
        if runs and runs[0][1] <= error:
            return runs[0][0]
        for (little, much), (more, less) in pairwise(runs):
            if less <= error < much:
                part = math.log(much / error) / math.log(much / less)
                return float(little * (more / little) ** part)
        return None


Cells: TypeAlias = tuple[str, ...]


def merged(rows: Iterable[tuple[str, Cells]]) -> dict[Cells, str]:
    """What is said of integrators, and the names of those of which it is said."""
    together: dict[Cells, list[str]] = {}
    for integrator, cells in rows:
        together.setdefault(cells, []).append(integrator)
    return {cells: ", ".join(names) for cells, names in together.items()}


def exact_file(model: str) -> str:
    """Where a course says the exact motion of a model, if it knows it."""
    return f"models/{model}.exact.py"


def course_cases(report: SceneReport) -> tuple[CaseReport, ...]:
    """The scenarios of a model whose exact motion the course says in its `exact.py`."""
    known = (one for one in report.scenarios if one.source == exact_file(report.model))
    return tuple(_course_case(report, one) for one in known)


def _course_case(report: SceneReport, scenario: ScenarioReport) -> CaseReport:
    own = scenario.own
    rows = [row for row in scenario.rows if own and row.setting.solving == own.solving]
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
    measured = {name: getattr(row, name) for name in MeasuredRun.__struct_fields__}
    return ErrorLine(integrator=row.setting.integrator, timestep=row.setting.timestep, **measured)
