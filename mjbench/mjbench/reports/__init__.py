"""The results of measurements as values, to be recorded, printed, drawn, and shown on pages."""

from __future__ import annotations

import math

from msgspec import Struct


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
