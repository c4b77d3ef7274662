"""The report on a model in other engines: error, drift, and cost of a step by number of worlds."""

from __future__ import annotations

from mjbench.machine import Machine
from mjbench.reports import Interval, Record
from mjbench.reports.scene_report import Errors, MeasuredSetting

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
