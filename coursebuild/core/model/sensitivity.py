"""How a script's numbers react to perturbed initial states and shorter timesteps.

Entry point: `Sensitivity`.
"""

from __future__ import annotations

import enum

from msgspec import Struct

from coursebuild.core.text.source import Span

PERTURBATION = 1e-12
"""How far initial states are moved, relative."""
RUNS = 4
"""Runs with moved states of each script: two pairs in opposite directions, the second pair half as
far away."""
FINER_RUNS = (-1, -2)
"""The numbers of the runs in which each step is made as 2 and as 4: two raised to the number less
its sign."""
CHAOTIC = 1e8
"""A simulation is chaotic if its states are more than this many times as far apart at the end as at
the beginning: fewer than eight of a number's sixteen digits are left."""


class Standing(enum.Enum):
    """Whether the sensitivity of a script could be measured, and if not, why."""

    MEASURED = "measured"
    NO_MUJOCO = "without-mujoco"
    """It does not import MuJoCo."""
    NOT_MOVED = "not-moved"
    """No initial state in it could be moved."""
    UNRECORDED = "unrecorded"
    """None of its output is recorded and compared."""
    DRIFTED = "drifted"
    """It prints something other than recorded, or does not run to its end."""
    FAILED = "failed"
    """It did not run to its end with moved states."""


class Doubt(Struct, frozen=True):
    """A recorded number with digits that do not repeat, or have not converged."""

    span: Span
    printed: str
    digits: int
    """Significant digits printed."""
    repeat: int
    """How many of them stay the same when initial states are moved."""
    converged: int | None
    """How many of them are those of ever smaller timesteps; `None` where not known."""
    least: str
    most: str
    """The smallest and the largest value printed in its place with moved initial states."""
    halved: str
    """The text printed in its place with half the timestep; empty where not known."""
    quartered: str
    """The same with a quarter of the timestep."""
    instead: str
    """The number with only the digits that repeat and converge; empty if none does, or a count."""
    compared: bool
    """Whether verification would report the difference as drift."""


class Flip(Struct, frozen=True):
    """Text between numbers that changed, disappeared or was added when states were moved."""

    span: Span
    printed: str
    other: str
    compared: bool


class Sensitivity(Struct, frozen=True):
    """The sensitivity of a script."""

    path: str
    lesson: str
    """Id of the lesson or page that it is extracted from."""
    standing: Standing
    numbers: int = 0
    """How many recorded numbers were examined."""
    amplification: float | None = None
    """The largest growth of the distance between states from beginning to end; `None` where no
    final state is known."""
    unhalved: str = ""
    """Why nothing is known about shorter timesteps; empty where something is."""
    doubts: tuple[Doubt, ...] = ()
    flips: tuple[Flip, ...] = ()

    @property
    def chaotic(self) -> bool:
        return self.amplification is not None and self.amplification > CHAOTIC
