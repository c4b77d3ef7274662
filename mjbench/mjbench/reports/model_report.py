"""The reports on a model, on a hard case, and on a model in other engines."""

from __future__ import annotations

from mjbench.machine import Machine
from mjbench.reports import Interval, PartFailure, Record, scene_report
from mjbench.reports.charts import Chart
from mjbench.reports.scene_report import Errors, MeasuredSetting, ScenarioReport, SweepReport


class SceneCard(Record, frozen=True):
    """The size of a model, and how fast the browser's engine runs it."""

    possible: int
    """Pairs of geoms between which MuJoCo looks for contact when they are near each other."""
    touched: int
    """Those that touched in any scenario, with the scene's own setting."""
    mjcf: int
    """Bytes of the MJCF with the files that it pulls in."""
    mjb: int
    """Bytes of the compiled model (an MJB file)."""
    browser: float | None
    """Simulated time over the time it takes in WebAssembly (V8), from where the first scenario
    begins; `None` where it was not measured."""


class SceneReport(Record, frozen=True):
    """Everything that was measured on a model."""

    model: str
    """Its file below `models/`, without suffix, POSIX."""
    digest: str
    """The digest of what the figures depend on in the course: the MJCF, its files and scenarios."""
    quick: bool
    """Whether only a part was measured, and in less time."""
    machine: Machine
    scenarios: tuple[ScenarioReport, ...]
    failures: tuple[PartFailure, ...] = ()
    """Scenarios and sweeps that were not measured."""
    card: SceneCard | None = None
    """`None` in a report that is about speed and error alone."""
    sweeps: tuple[SweepReport, ...] = ()


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


WORLDS = (1, 64, 4096)
"""How many worlds are simulated at once."""


class BatchCost(Record, frozen=True):
    """What a step costs among so many worlds."""

    worlds: int
    seconds: Interval | None = None
    """Time of a step over the number of worlds, s; `None` where it was not measured."""
    ratio: Interval | None = None
    """The same, relative to a step of MuJoCo in one world, which was timed in turn with it."""
    compile_seconds: float | None = None
    """What the first step took longer than the second."""
    remark: str = ""
    """Why it was not measured."""


class EngineRow(Errors, frozen=True):
    """An engine on a device, in one precision."""

    engine: str
    """As `--engines` takes it."""
    title: str
    versions: tuple[tuple[str, str], ...]
    """Of packages, by their names."""
    status: str
    """`ok`; `diverged`; `unsupported`, what the engine refuses; `failed`."""
    message: str = ""
    """Why it is not `ok`, in the words of the engine."""
    device: str = ""
    label: str = ""
    """What the device calls itself; empty for the processor."""
    bits: int = 0
    """Of its floating-point numbers; 0 where not even that was learnt."""
    threads: int = 0
    """0 where the engine decides itself."""
    compile_seconds: float | None = None
    """What the first step took longer than the second in one world, s."""
    apart: float | None = None
    """The largest distance from the motion in MuJoCo itself at the same setting, rad or relative to
    the model's extent."""
    energy_drift: float | None = None
    """Relative, with its sign; `None` where energy is not conserved."""
    costs: tuple[BatchCost, ...] = ()


class EngineScenario(Record, frozen=True):
    """All engines in a scenario."""

    name: str
    title: str
    duration: float
    """s."""
    horizon: float
    """s, to which errors count."""
    reference: str
    """`closed`, `ode` or `self`."""
    source: str
    floor: float
    """How far the reference may be off, m or rad; no error is given below ten times as much."""
    velocity_floor: float
    setting: MeasuredSetting
    """The model's own, which all engines get."""
    rows: tuple[EngineRow, ...]


class EngineReport(Record, frozen=True):
    """Everything that was measured on a model in other engines."""

    model: str
    digest: str
    """As of a `SceneReport`."""
    quick: bool
    machine: Machine
    load: float
    """The mean number of processes that wanted to run when it began; all of it is of others."""
    scenarios: tuple[EngineScenario, ...]
