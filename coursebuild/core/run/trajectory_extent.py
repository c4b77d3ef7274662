"""What a simulation with moved initial states has come through, for `initial_state_perturbation`.

Entry point: `TrajectoryExtent`, of an `MjData`.

From its beginning (new data, or the clock went back) to its end a simulation covers positions and
velocities: the largest are the sizes that its final state is compared by, since it may well end
near zero. What began at zero and was moved all the same counts as of size 1. And no velocity
matters that would not lead as far as the positions in the whole time: of a body at rest it is but
the trembling that moving it has left.
"""

from __future__ import annotations

import weakref
from typing import Any

_LOST = 1e10
"""Larger numbers, and none, are those of a simulation that is lost."""


class TrajectoryExtent:
    """What MuJoCo last computed from, or led to, and how far it came."""

    def __init__(self, data: Any, number: int) -> None:
        self.of: Any = weakref.ref(data)
        self.number = number
        """Data in the order in which they were first computed with."""
        self.time = float("inf")
        self.states: tuple[bytes, ...] = ()
        self.begin(0.0)

    def begin(self, time: float) -> None:
        """A simulation begins at this time."""
        self.begun = self.until = time
        self.largest = [0.0, 0.0]
        """The largest |qpos| and |qvel| since then."""
        self.from_zero = False
        """Whether coordinates that were zero have been moved."""

    def cover(self, data: Any) -> None:
        """Take in the state that the simulation has come to."""
        if data.time < self.until:  # MuJoCo has reset what diverged
            self.begin(data.time)
        self.until = data.time
        for i, array in enumerate((data.qpos, data.qvel)):
            if len(array):
                largest = float(max(array.max(), -array.min()))
                if self.largest[i] < largest < _LOST:
                    self.largest[i] = largest

    def sizes(self) -> tuple[float, float]:
        """What positions and velocities are compared by."""
        position, velocity = self.largest
        if self.from_zero:
            position = max(position, 1.0)
        time = self.until - self.begun
        return position, max(velocity, position / time if time > 0 else 0.0)
