"""What became of a script's numbers when initial states were moved, and timesteps halved.

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
HALVED = -1
"""The number of the run whose timesteps are halved."""
CHAOTIC = 1e8
"""A simulation is chaotic where its states at the end are more than this many times as far apart as
they were at the beginning: of the sixteen digits of a number fewer than eight are left."""


class Standing(enum.Enum):
    """Whether anything could be said of a script."""

    MEASURED = "measured"
    NO_MUJOCO = "without-mujoco"
    """It does not import MuJoCo."""
    NOT_MOVED = "not-moved"
    """MuJoCo computes nothing in it from an initial state that could be moved."""
    UNRECORDED = "unrecorded"
    """Nothing that it prints is recorded and compared."""
    DRIFTED = "drifted"
    """It does not print what is recorded, or does not run to its end."""
    FAILED = "failed"
    """It did not run to its end with moved states."""


class Doubt(Struct, frozen=True):
    """A recorded number of which not all printed digits repeat, or are converged."""

    span: Span
    printed: str
    digits: int
    """Significant digits printed."""
    repeat: int
    """How many of them are the same when initial states are moved."""
    converged: int | None
    """How many of them are those of ever smaller timesteps; `None` where that is not known."""
    least: str
    most: str
    """The smallest and the largest value that was printed in its place, initial states moved."""
    halved: str
    """What was printed in its place with half the timestep; empty where that is not known."""
    instead: str
    """The number with only the digits that do both; empty where none does, and of a count."""
    compared: bool
    """Whether the verification would take the difference for drift."""


class Flip(Struct, frozen=True):
    """Recorded text, beside numbers, that was printed otherwise, or not at all, or that came in."""

    span: Span
    printed: str
    other: str
    compared: bool


class Sensitivity(Struct, frozen=True):
    """A script."""

    path: str
    lesson: str
    """Id of the lesson or page that it is extracted from."""
    standing: Standing
    numbers: int = 0
    """Recorded numbers that were looked at."""
    amplification: float | None = None
    """How many times as far apart states were at the end as at the beginning, at most; `None`
    where no state at the end is known."""
    unhalved: str = ""
    """Why nothing is known of half the timestep; empty where it is."""
    doubts: tuple[Doubt, ...] = ()
    flips: tuple[Flip, ...] = ()

    @property
    def chaotic(self) -> bool:
        """Whether a simulation in it is chaotic."""
        return self.amplification is not None and self.amplification > CHAOTIC
