"""What was measured on a hard case.

Entry point: `CaseReport`; `merged`, integrators of which the same is said.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

from coursebuild.numerics.reports import Record
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
    """`closed`, `ode` or `self`."""
    source: str
    floor: float
    second: str
    """The source of the second reference; empty where there is none."""
    agreement: float | None
    """The largest difference of the two."""


class CaseReport(Record, frozen=True):
    """Everything that was measured on a hard case."""

    name: str
    title: str
    case: int
    engine: str
    """Version of MuJoCo."""
    note: str
    reference: ReferenceLine | None
    boundaries: tuple[BoundaryLine, ...]
    figures: tuple[FigureLine, ...]
    orders: tuple[OrderRow, ...]
    errors: tuple[ErrorLine, ...]


Cells: TypeAlias = tuple[str, ...]


def merged(rows: Iterable[tuple[str, Cells]]) -> dict[Cells, str]:
    """What is said of integrators, and the names of those of which it is said."""
    together: dict[Cells, list[str]] = {}
    for integrator, cells in rows:
        together.setdefault(cells, []).append(integrator)
    return {cells: ", ".join(names) for cells, names in together.items()}
