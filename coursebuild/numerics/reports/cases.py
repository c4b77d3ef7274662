"""What was measured on a hard case.

Entry point: `CaseReport`; `merged`, integrators of which the same is said.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import TypeAlias

from coursebuild.core.model.results import Machine
from coursebuild.numerics.reports import Interval, Record
from coursebuild.numerics.reports.bench import OrderRow, StableRow


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


class ErrorLine(Record, frozen=True):
    """One run against the reference. Errors are the largest over the duration, and at its end."""

    integrator: str
    timestep: float
    """s."""
    status: str
    reasons: tuple[str, ...]
    """Why it is not `ok`."""
    position: tuple[float, float] | None
    """m or rad."""
    attitude: tuple[float, float] | None
    """rad."""
    velocity: tuple[float, float] | None
    """m/s or rad/s."""
    energy_drift: float | None
    momentum_drift: float | None
    penetration: float
    """m."""
    refsafe: bool
    """Whether constraints were softened because the timestep is long: it is another model."""


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
