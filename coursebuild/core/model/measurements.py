"""Reports of mjbench as files of the course, `content/reports/…`: what of them is shown.

mjbench's `schemas/` say what each field means, and in which unit. A field that is not here is not
shown; one that is here and is missing in a file makes it a damaged one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild.core.model.results import Machine

FLOORS = 10.0
"""Errors below this many floors of the reference are not given."""


class Interval(Struct, frozen=True):
    """A figure that varies between measurements, with its 95 % interval."""

    value: float
    low: float
    high: float

    def scale(self, factor: float) -> Interval:
        """The interval in another unit."""
        return Interval(factor * self.value, factor * self.low, factor * self.high)

    @property
    def half_width(self) -> float:
        """Relative to the value; infinite where that is 0."""
        return (self.high - self.low) / (2 * self.value) if self.value else math.inf


class SweepRow(Struct, frozen=True):
    """A model with one parameter at one value."""

    parameter: str
    value: str
    own: bool
    status: str
    reasons: tuple[str, ...] = ()
    change: float | None = None
    parted: float | None = None
    figure: float | None = None
    penetration: float | None = None
    slip: float | None = None
    restitution: float | None = None
    residual: float | None = None
    iterations: float | None = None
    cost: Interval | None = None


class SweepReport(Struct, frozen=True):
    """All values of the parameters of a sweep."""

    name: str
    title: str
    scenario: str
    show: tuple[str, ...]
    rows: tuple[SweepRow, ...]


class MeasuredSetting(Struct, frozen=True):
    """What can be chosen without changing the scene."""

    integrator: str
    timestep: float
    solver: str
    iterations: int
    cone: str
    options: tuple[tuple[str, str], ...] = ()


class Errors(Struct, frozen=True):
    """How far a motion is from its reference: at its largest, and at its end."""

    position: tuple[float, float] | None
    attitude: tuple[float, float] | None
    velocity: tuple[float, float] | None


class MeasuredRun(Errors, frozen=True):
    """One run against its reference."""

    status: str
    reasons: tuple[str, ...]
    energy_drift: float | None
    momentum_drift: float | None
    penetration: float
    refsafe: bool


class WorkPrecisionRow(MeasuredRun, frozen=True):
    """One setting in one scenario."""

    setting: MeasuredSetting
    figure: tuple[float, float] | None
    slip: float | None
    model_error: float | None
    steps: int
    cost: Interval | None
    seconds: Interval | None
    own: bool
    front: bool
    dominated_by: int | None
    seen: float | None = None
    parted: float | None = None
    evaluations: int = 0
    iterations: float | None = None
    lucky: str = ""
    step_error: float | None = None
    idle: bool = False
    name: str = ""

    @property
    def realtime(self) -> float | None:
        """Simulated time over processor time."""
        return 1 / self.seconds.value if self.seconds and self.seconds.value else None


class FittedOrder(Struct, frozen=True):
    """The power of the timestep that errors are proportional to."""

    value: float
    uncertainty: float
    bend: float

    @property
    def text(self) -> str:
        """In words."""
        return f"{self.value:.2f} ± {self.uncertainty:.2f}, bend {self.bend:.2f}"


class OrderRow(Struct, frozen=True):
    """Orders of an integrator; `None` where errors are too few, or follow no one power."""

    integrator: str
    position: FittedOrder | None
    attitude: FittedOrder | None
    velocity: FittedOrder | None

    @property
    def has_orders(self) -> bool:
        """Whether an order is known for any of the errors."""
        return any(order is not None for order in (self.position, self.attitude, self.velocity))


Reach: TypeAlias = float | Literal["all", "none"]
"""The largest timestep at which something holds, s: or it holds at all of them, or at none."""


class StableRow(Struct, frozen=True):
    """The largest stable timestep of an integrator in a scenario."""

    integrator: str
    largest: Reach
    searched: tuple[float, float]
    islands: tuple[float, float] | None
    duration: float
    energy: float | None
    theory: Reach | None = None
    formula: str = ""
    near: Reach | None = None
    through: Reach | None = None
    shown: str = ""


class FigureLine(Struct, frozen=True):
    """A quantity that was measured and is known."""

    name: str
    unit: str
    integrator: str
    measured: float | None
    exact: float | None
    source: str
    spread: tuple[float, float] | None = None


class RowVerdict(Struct, frozen=True):
    """What is said of the scene's own setting."""

    better: int | None
    text: str


class ErrorQuantity(Struct, frozen=True):
    """An error that rows have, in the order in which they are shown."""

    name: str
    label: str
    least: float
    resolved: bool


class ChartPoint(Struct, frozen=True):
    """A run, in a chart."""

    x: float
    y: float | None
    title: str
    spread: tuple[float, float] | None = None
    full: bool = True
    small: bool = False
    ringed: bool = False

    @property
    def ends(self) -> tuple[float, float]:
        """Between which `x` lies."""
        return self.spread or (self.x, self.x)


class ChartLine(Struct, frozen=True):
    """Points joined in their order, except for small and lost ones."""

    name: str
    number: int
    points: tuple[ChartPoint, ...]

    @property
    def visible_points(self) -> list[ChartPoint]:
        """The points that were not lost."""
        return [point for point in self.points if point.y is not None]


class ChartLevel(Struct, frozen=True):
    """A level of the vertical axis that means something."""

    y: float
    text: str


class ChartMark(Struct, frozen=True):
    """An entry of the key of a chart."""

    kind: str
    text: str


class Chart(Struct, frozen=True):
    """Lines between two logarithmic axes."""

    title: str
    text: str
    axes: tuple[str, str]
    lines: tuple[ChartLine, ...]
    least: float = 0.0
    levels: tuple[ChartLevel, ...] = ()
    marks: tuple[ChartMark, ...] = ()


class ScenarioReport(Struct, frozen=True):
    """Everything that was measured in a scenario."""

    name: str
    title: str
    duration: float
    horizon: float
    hold: float
    reference: str
    source: str
    floor: float
    second: str
    agreement: float | None
    lyapunov: float | None
    figure: str
    rows: tuple[WorkPrecisionRow, ...]
    orders: tuple[OrderRow, ...]
    stable: tuple[StableRow, ...]
    verdict: RowVerdict
    velocity_floor: float = 0.0
    notes: tuple[str, ...] = ()
    horizons: tuple[float, float] | None = None
    horizon_error: Mapping[str, float] = {}
    quantities: tuple[ErrorQuantity, ...] = ()
    charts: tuple[Chart, ...] = ()
    cut_short: bool = False

    @property
    def own_setting(self) -> MeasuredSetting | None:
        """The scene's own setting; `None` where there are no rows."""
        return next((row.setting for row in self.rows if row.own), None)


class SceneCard(Struct, frozen=True):
    """The size of a model, and how fast the browser's engine runs it."""

    possible: int
    touched: int
    mjcf: int
    mjb: int
    browser: float | None


class ErrorLine(MeasuredRun, frozen=True):
    """An integrator at a timestep."""

    integrator: str
    timestep: float


class ReferenceLine(Struct, frozen=True):
    """The reference that errors were measured against, and how well it is known."""

    kind: str
    source: str
    second: str
    position: float
    attitude: float
    velocity: float


class CaseReport(Struct, frozen=True):
    """Everything that was measured on a hard case."""

    name: str
    title: str
    case: int
    machine: Machine
    note: str
    reference: ReferenceLine
    boundaries: tuple[StableRow, ...]
    figures: tuple[FigureLine, ...]
    orders: tuple[OrderRow, ...]
    errors: tuple[ErrorLine, ...]
    charts: tuple[Chart, ...] = ()
    main: str = ""
    reached: tuple[tuple[str, float], ...] = ()


class SceneReport(Struct, frozen=True):
    """Everything that was measured on a model."""

    model: str
    digest: str
    quick: bool
    machine: Machine
    scenarios: tuple[ScenarioReport, ...]
    card: SceneCard | None = None
    sweeps: tuple[SweepReport, ...] = ()


class BatchCost(Struct, frozen=True):
    """What a step costs among so many worlds."""

    worlds: int
    seconds: Interval | None = None
    ratio: Interval | None = None
    compile_seconds: float | None = None
    remark: str = ""


class EngineRow(Errors, frozen=True):
    """An engine on a device, in one precision."""

    engine: str
    title: str
    versions: tuple[tuple[str, str], ...]
    status: str
    message: str = ""
    device: str = ""
    label: str = ""
    bits: int = 0
    threads: int = 0
    compile_seconds: float | None = None
    apart: float | None = None
    energy_drift: float | None = None
    costs: tuple[BatchCost, ...] = ()


class EngineScenario(Struct, frozen=True):
    """All engines in a scenario."""

    name: str
    title: str
    duration: float
    horizon: float
    reference: str
    source: str
    floor: float
    velocity_floor: float
    setting: MeasuredSetting
    rows: tuple[EngineRow, ...]


class EngineReport(Struct, frozen=True):
    """Everything that was measured on a model in other engines."""

    model: str
    digest: str
    quick: bool
    machine: Machine
    load: float
    scenarios: tuple[EngineScenario, ...]
