"""The report on a model: all of its scenarios and sweeps."""

from __future__ import annotations

from mjbench.machine import Machine
from mjbench.reports import PartFailure, Record
from mjbench.reports.scene_report import ScenarioReport, SweepReport


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
