"""Speed against error in a scenario, and sweeps of parameters."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from mjbench.reports import Interval, PartFailure, Reach, Record
from mjbench.reports.charts import Chart


class SweepRow(Record, frozen=True):
    """The model with one parameter at one value."""

    parameter: str
    """As the course names it, such as `geom.solref[0]`."""
    value: str
    own: bool
    """Whether it is the value that the model has."""
    status: str
    """`ok`, `slow-growth`, `diverged` or `refused` by MuJoCo, as of a setting."""
    reasons: tuple[str, ...] = ()
    change: float | None = None
    """How far the motion is from that of the model as it is, in a picture: 1 is just visible.
    `None` in chaos where it becomes visible, since its size then says nothing of the parameter."""
    parted: float | None = None
    """When it becomes visible there, s."""
    figure: float | None = None
    """As `change`, of what the scenario declares to be measured, in its unit."""
    penetration: float | None = None
    """Deepest contact, m."""
    slip: float | None = None
    """The longest way that two geoms slide on each other, m."""
    restitution: float | None = None
    """Of the hardest hit: speed apart over speed together, along the normal; 0 for what stays."""
    residual: float | None = None
    """Of the solver: the largest difference of forces, constraint or applied, between forward and
    inverse dynamics, relative to the largest constraint force."""
    iterations: float | None = None
    """Of the solver, mean of all steps."""
    cost: Interval | None = None
    """Time for the scenario, relative to the model as it is."""


class SweepReport(Record, frozen=True):
    """All rows of a sweep."""

    name: str
    title: str
    scenario: str
    show: tuple[str, ...]
    """The figures to show: those that are declared, else those that differ."""
    rows: tuple[SweepRow, ...]


FLOORS = 10.0
"""Errors below this many floors of the reference are not given."""


class MeasuredSetting(Record, frozen=True):
    """What can be chosen without changing the scene."""

    integrator: str
    """As MJCF names it."""
    timestep: float
    """s."""
    solver: str
    """As MJCF names it; empty where nothing is constrained, so that no solver runs."""
    iterations: int
    """At most; 0 where no solver runs."""
    cone: str
    """As MJCF names it; empty where nothing can touch."""
    options: tuple[tuple[str, str], ...] = ()
    """Options and flags that are not the scene's own, as MJCF names them, with their values."""

    @property
    def solver_settings(self) -> tuple[str, int, str, tuple[tuple[str, str], ...]]:
        """All but integrator and timestep."""
        return self.solver, self.iterations, self.cone, self.options


class Errors(Record, frozen=True):
    """How far a motion is from its reference: at its largest over the horizon, and at its end.

    `None` for what the motion does not have, and where the run was lost.
    """

    position: tuple[float, float] | None
    """m or rad: Euclidean norm over coordinates."""
    attitude: tuple[float, float] | None
    """rad: the largest angle of any body."""
    velocity: tuple[float, float] | None
    """m/s or rad/s: Euclidean norm."""


class MeasuredRun(Errors, frozen=True):
    """One run against its reference."""

    status: str
    """`ok`, `slow-growth`, `diverged` or `refused` by MuJoCo."""
    reasons: tuple[str, ...]
    """Why it is not `ok`."""
    energy_drift: float | None
    """Relative, with its sign; `None` where energy is not conserved."""
    momentum_drift: float | None
    """Relative; `None` where angular momentum is not conserved."""
    penetration: float
    """Deepest contact, m."""
    refsafe: bool
    """Whether constraints were softened because the timestep is long: it is another model."""


class WorkPrecisionRow(MeasuredRun, frozen=True):
    """One setting in one scenario."""

    setting: MeasuredSetting
    figure: tuple[float, float] | None
    """Of what the scenario declares to be measured, in its unit; `None` where it declares none."""
    slip: float | None
    """Largest creep of a contact that sticks in the reference, m; `None` without contact."""
    model_error: float | None
    """What remains of the error however small the timestep, in the errors' unit (soft contact, a
    pyramid for a cone): against the closed form; `None` where there is none."""
    steps: int
    cost: Interval | None
    """Time for the scenario, relative to the scene's own setting; `None` where it was not timed."""
    seconds: Interval | None
    """Processor time for a simulated second on this machine, s; `None` where it was not timed."""
    own: bool
    """Whether it is the scene's own setting."""
    front: bool
    """Whether no other is both cheaper and more accurate, beyond what timing can tell."""
    dominated_by: int | None
    """The row (from 0) that is cheaper and no less accurate; `None` on the front, and for what was
    lost or not timed."""
    seen: float | None = None
    """The largest displacement or turn of a body in a picture, where 1 is just visible. The front
    is that of cost and the figure, or where none is declared, of cost and this."""
    parted: float | None = None
    """In a chaotic scenario, s: when it is `horizon_error` from the reference; its errors mean
    nothing later, and are not given."""
    evaluations: int = 0
    """How often the forward dynamics are computed in the scenario, on any machine; 0 where that was
    not recorded."""
    iterations: float | None = None
    """Iterations of the solver in the scenario; `None` where none runs."""
    lucky: str = ""
    """Why its error says nothing of what the setting does; empty where it does."""
    same: bool = False
    """Whether the motion is that of the scene's own setting, to the bit."""
    step_error: float | None = None
    """What of `seen` comes from timestep and solver, and not from the model of contacts; `None`
    where that was not measured apart."""
    halves: Mapping[str, tuple[float, float]] = {}
    """The largest errors in the first and in the second half of the horizon, by their fields; empty
    where these were not measured."""
    idle: bool = False
    """Whether it changes no bit of the motion and saves no time: it is not shown."""
    name: str = ""
    """The setting in words; solver, iterations and cone only where they are not the scene's own."""

    @property
    def realtime(self) -> float | None:
        """Simulated time over processor time."""
        return 1 / self.seconds.value if self.seconds and self.seconds.value else None

    @property
    def work(self) -> int:
        """`evaluations`, also where they were not recorded."""
        return self.evaluations or max(self.steps, 1) * step_evaluations(self.setting.integrator)


def step_evaluations(integrator: str) -> int:
    """How often a step computes the forward dynamics."""
    return 4 if integrator == "RK4" else 1


class FittedOrder(Record, frozen=True):
    """The power of the timestep that errors are proportional to."""

    value: float
    uncertainty: float
    """Half the width of the interval in which it lies in 95 % of cases."""
    bend: float
    """The largest difference of two slopes between neighbouring timesteps: 0 is a straight line."""

    @property
    def text(self) -> str:
        """In words."""
        return f"{self.value:.2f} ± {self.uncertainty:.2f}, bend {self.bend:.2f}"


class OrderRow(Record, frozen=True):
    """Orders of an integrator; `None` where errors are too few, or follow no one power."""

    integrator: str
    position: FittedOrder | None
    attitude: FittedOrder | None
    velocity: FittedOrder | None


class StableRow(Record, frozen=True):
    """The largest stable timestep of an integrator in a scenario."""

    integrator: str
    largest: Reach
    """s: at all timesteps that were tried up to it runs stay bounded."""
    searched: tuple[float, float]
    """The shortest and the longest timestep that was tried, s."""
    islands: tuple[float, float] | None
    """The shortest and longest stable timesteps beyond the largest, s; `None` where none is."""
    duration: float
    """Simulated time of each run, s."""
    energy: float | None
    """Most energy that a stable run may have, J; `None` where it is not judged."""
    bracket: tuple[float, float] | None = None
    """s: the least and the most of what the own start over the duration, over twice the duration,
    and the start nearby that is lost first say; `None` where all is stable, or it is not known."""
    theory: Reach | None = None
    """As `largest`, of linear theory; `None` where there is none for what the scenario visits."""
    formula: str = ""
    """Where the theory comes from; empty where there is none."""
    reason: str = ""
    """Why the first timestep beyond the largest is lost."""
    near: Reach | None = None
    """As `largest`, of runs that stay near the motion of small steps; `None`: not measured."""
    near_reason: str = ""
    through: Reach | None = None
    """As `largest`, of runs in which nothing goes through anything; `None`: not measured."""
    through_reason: str = ""
    shown: str = ""
    """The largest stable timestep in words, with the digits on which all runs agree."""

    @property
    def monotone(self) -> bool:
        """Whether all timesteps that were tried beyond the largest are lost."""
        return self.islands is None


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
    """Of an ensemble, the range of its middle eight tenths; `measured` is the median then."""


class ErrorParts(Record, frozen=True):
    """Where the error of the own setting comes from, as a learner sees it (1: just visible).

    `None` for what was not measured, or does not apply.
    """

    timestep: float | None
    """Against small steps, with a solver that goes to its end."""
    solver: float | None
    """Against the same with a solver that goes to its end: iterations and tolerance."""
    contact_model: float | None
    """Of small steps against the closed form, or of a pyramid against the cone: no timestep mends
    it."""
    rounding: float | None
    """Against the same from a start whose last digits are others."""
    least: float
    """Below this nothing is known of them."""
    dominant: str = ""
    """The field that is the largest; empty where none is known to be."""
    mend: str = ""
    """What makes that smaller, and what it costs; empty where no setting that was measured does."""


class PhaseProfile(Record, frozen=True):
    """Where the time of a step goes under a setting, by MuJoCo's timers."""

    row: int
    """The row of the setting, from 0."""
    name: str
    """The setting in words."""
    steps: int
    step: float
    """Wall time of a step, s: of each stretch of steps the quickest of all rounds."""
    phases: Mapping[str, float]
    """By its name, what each phase takes of that, s; together they are the step. What has no timer
    is `other`: accelerations without constraints, energy, callbacks."""
    contacts: tuple[float, int]
    """After a step: the mean, and the most."""
    constraints: tuple[float, int]
    """The same of the rows of constraints."""
    iterations: float
    """Of the solver in the last evaluation of a step, over all islands: the mean."""
    islands: float
    """In which constraints are solved apart: the mean; 0 where they are not."""
    rounds: int


class RowVerdict(Record, frozen=True):
    """Whether a scene's own setting is a good choice."""

    better: int | None
    """The row that is better in no column worse, from starts nearby too; `None` where none is."""
    text: str
    """The same in a sentence or two."""
    lines: tuple[str, ...] = ()
    """The whole in at most five lines: speed, error, what is better, stability, what is not
    known."""


class ErrorQuantity(Record, frozen=True):
    """An error that rows have, in the order in which they are shown."""

    name: str
    """The field of a row: `figure`, `step_error`, `seen`, `position`, `attitude` or `velocity`."""
    label: str
    """What it is, with its unit."""
    least: float
    """Errors that are not larger are not resolved by the reference."""
    resolved: bool
    """Whether any row has a larger one."""

    def value_of(self, row: MeasuredRun) -> float | None:
        """The largest error of a row over the horizon; `None` where the row has none."""
        error: tuple[float, float] | float | None = getattr(row, self.name)
        value = error[0] if isinstance(error, tuple) else error
        return None if value is None or not math.isfinite(value) else abs(value)

    def is_resolved(self, rows: Iterable[MeasuredRun]) -> bool:
        """Whether any of the rows has an error above the floor."""
        errors = (self.value_of(row) for row in rows)
        return any(error is not None and error > self.least * (1 + 1e-9) for error in errors)


class ScenarioReport(Record, frozen=True):
    """Everything that was measured in a scenario."""

    name: str
    title: str
    duration: float
    """s."""
    horizon: float
    """s: how long errors of trajectories mean something; less than the duration in chaos."""
    hold: float
    """Seconds for which a command holds; 0 where nothing is commanded."""
    reference: str
    """`closed`, `ode` or `self`."""
    source: str
    """Where the reference comes from."""
    floor: float
    """How far the reference may be off in places and attitudes, m or rad; no error is given below
    ten times as much. Velocities have a floor of their own."""
    second: str
    """The source of the second reference; empty where there is none."""
    agreement: float | None
    """The largest difference of the two."""
    lyapunov: float | None
    """Largest Lyapunov exponent, 1/s; `None` where the scenario is not chaotic."""
    figure: str
    """The declared quantity, with its unit in brackets; empty without one."""
    rows: tuple[WorkPrecisionRow, ...]
    orders: tuple[OrderRow, ...]
    stable: tuple[StableRow, ...]
    verdict: RowVerdict
    velocity_floor: float = 0.0
    """As `floor`, for velocities: around an impact they are known far worse than places."""
    notes: tuple[str, ...] = ()
    """Remarks for reading the figures."""
    overlaps: str = ""
    """What lies inside something else at the beginning, and how deep; empty where nothing does."""
    figures: tuple[FigureLine, ...] = ()
    """What the scenario says is known in theory, measured with its own timestep."""
    horizons: tuple[float, float] | None = None
    """s: the shortest and the longest of runs whose beginnings were nudged in different ways;
    `None` where the scenario is not chaotic."""
    least_seen: float = 0.0
    """Below this nothing is known of what is seen."""
    least_figure: float = 0.0
    """The same of the declared quantity, in its unit."""
    cost_of: MeasuredSetting | None = None
    """The setting that costs are relative to, where the scene's own was lost."""
    horizon_error: Mapping[str, float] = {}
    """The errors at which predictions end, by unit. Empty in older reports, where it is a tenth of
    a radian or of the model's extent."""

    floors: tuple[float, float] | None = None
    """The largest floors under any cone, of places and of velocities: rows of two cones are
    compared down to ten of these; `None` where only those of the own cone were recorded."""
    contact_model: Mapping[str, float] = {}
    """What the model of contacts errs by, as it is seen, by cone; empty where it was not measured
    apart, or nothing touches."""
    parts: ErrorParts | None = None
    """`None` where the error was not taken apart."""
    failures: tuple[PartFailure, ...] = ()
    """What was not measured."""
    quantities: tuple[ErrorQuantity, ...] = ()
    main: str = ""
    """The name of the error that settings are compared by first, and that is drawn."""
    charts: tuple[Chart, ...] = ()
    """Error against cost, or evaluations where nothing was timed."""
    profile: tuple[PhaseProfile, ...] = ()
    """Where the time goes under the settings that the verdict compares, the own first; empty where
    it was not asked for."""
    profile_text: str = ""
    """What of that the verdict rests on."""
    cut_short: bool = False
    """Whether the search for stable timesteps ended because of the scenario's duration."""
    drawn: tuple[str, ...] = ()
    """Parameters with which verdicts have to hold too, as they were drawn."""

    @property
    def own_row(self) -> WorkPrecisionRow | None:
        """The row of the scene's own setting; `None` where it was not measured."""
        return next((row for row in self.rows if row.own), None)

    @property
    def own_setting(self) -> MeasuredSetting | None:
        """The scene's own setting; `None` where there are no rows."""
        return next((row.setting for row in self.rows if row.own), None)
