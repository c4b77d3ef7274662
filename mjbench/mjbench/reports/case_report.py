"""The report on a hard case."""

from __future__ import annotations

from mjbench.machine import Machine
from mjbench.reports import Interval, Record, scene_report
from mjbench.reports.charts import Chart

RIGHT = 1e-3
"""m or rad: the error at which costs are compared."""


class StepCost(Record, frozen=True):
    """The time of a step of an integrator."""

    integrator: str
    seconds: Interval
    """Processor time on the machine of the report."""


class ErrorLine(scene_report.MeasuredRun, frozen=True):
    """An integrator at a timestep."""

    integrator: str
    timestep: float
    """s."""


class ReferenceLine(Record, frozen=True):
    """The reference that errors were measured against."""

    kind: str
    """`closed` or `ode`."""
    source: str
    second: str
    """The source of the second reference."""
    position: float
    """How far the two references are apart, m or rad; the motion is known no better."""
    attitude: float
    """rad."""
    velocity: float
    """m/s or rad/s."""


class CaseReport(Record, frozen=True):
    """Everything that was measured on a hard case."""

    name: str
    title: str
    case: int
    """Its number on the list of hard cases."""
    machine: Machine
    note: str
    reference: ReferenceLine
    boundaries: tuple[scene_report.StableRow, ...]
    figures: tuple[scene_report.FigureLine, ...]
    orders: tuple[scene_report.OrderRow, ...]
    errors: tuple[ErrorLine, ...]
    costs: tuple[StepCost, ...]
    charts: tuple[Chart, ...] = ()
    """Each error against processor time, and evaluations."""
    main: str = ""
    """The name of the error that is drawn first; empty where none is resolved."""
    least: float = 0.0
    """Such errors that are not larger are not resolved."""
    reached: tuple[tuple[str, float], ...] = ()
    """Processor time for a simulated second, s, by integrator, with the timestep that errs by
    `RIGHT`; those that do not come so near are left out."""
