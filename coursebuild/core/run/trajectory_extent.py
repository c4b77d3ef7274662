"""How far a simulation with moved initial states has come, for `initial_state_perturbation`.

Entry point: `TrajectoryExtent`, of an `MjData`.

The final state of a simulation is compared relative to the largest positions and velocities since
its beginning (new data, or the clock went back), since it may well end near zero. Coordinates that
began at zero and were moved all the same count as of size 1. Velocities are compared by at least
the velocity that would lead as far as the positions in the whole time: those of a body at rest are
only the trembling that moving it has left.
"""

from __future__ import annotations

import weakref
from typing import Any

_DIVERGENCE_SIZE = 1e10
"""Larger numbers are those of a simulation that is lost."""


class TrajectoryExtent:
    """The last state of an `MjData` that MuJoCo computed with, and how far it has come."""

    def __init__(self, data: Any, number: int) -> None:
        self.of: Any = weakref.ref(data)
        self.number = number
        """Its number in the order in which data were first computed with."""
        self.time = float("inf")
        self.states: tuple[bytes, ...] = ()
        self.begin(0.0)

    def begin(self, time: float) -> None:
        """A simulation begins at this time."""
        self.start_time = self.until = time
        self.largest = [0.0, 0.0]
        """The largest |qpos| and |qvel| since then."""
        self.from_zero = False
        """Whether coordinates that were zero have been moved."""

    def cover(self, data: Any) -> None:
        """Include the state that the simulation has come to."""
        if data.time < self.until:  # MuJoCo has reset what diverged
            self.begin(data.time)
        self.until = data.time
        for i, array in enumerate((data.qpos, data.qvel)):
            if len(array):
                largest = float(max(array.max(), -array.min()))
                if self.largest[i] < largest < _DIVERGENCE_SIZE:
                    self.largest[i] = largest

    def sizes(self) -> tuple[float, float]:
        """The sizes that positions and velocities are compared by."""
        position, velocity = self.largest
        if self.from_zero:
            position = max(position, 1.0)
        time = self.until - self.start_time
        return position, max(velocity, position / time if time > 0 else 0.0)
