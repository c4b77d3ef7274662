"""The results of measurements as values, to be recorded, printed, drawn, and shown on pages."""

from __future__ import annotations

import math
from typing import Literal, TypeAlias

from msgspec import Struct

Reach: TypeAlias = float | Literal["all", "none"]
"""The largest timestep at which something holds, s: or it holds at all of them, or at none."""


def reach(timestep: float) -> Reach:
    """The same of an extended number: infinite for all timesteps, 0 for none."""
    if math.isinf(timestep):
        return "all"
    return timestep or "none"


def reach_bound(limit: Reach) -> float:
    """The number again, which limits are compared by."""
    if isinstance(limit, float | int):
        return float(limit)
    return math.inf if limit == "all" else 0.0


class PartFailure(Struct, frozen=True, forbid_unknown_fields=True):
    """A part of a measurement that there is not, and why."""

    part: str
    reason: str


class Record(Struct, frozen=True, forbid_unknown_fields=True):
    """A part of a report, which can be stored as JSON.

    No number is infinite or NaN: `None` stands for a missing value, and a field beside it says why.
    """


class Interval(Record, frozen=True):
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
