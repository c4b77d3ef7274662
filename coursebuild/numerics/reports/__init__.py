"""The results of measurements as values, to be recorded, printed, drawn, and shown on pages.

Entry points: `Reports`, those that a course's pages may show. `bench`: speed against error of a
model; `sweep`: its parameters at other values; `cases`: the hard cases; `diet`: what a model can be
without. `records`: reports as files; `departures`: how two differ; `text`: which errors are shown,
and texts; `plot` and `sweep_plot`: charts. Nothing here measures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from msgspec import Struct, field

if TYPE_CHECKING:  # a course without reports needs none of it
    from coursebuild.numerics.reports.cases import CaseReport
    from coursebuild.numerics.reports.diet import DietReport
    from coursebuild.numerics.reports.scene_report import SceneReport


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


class Reports(Struct, frozen=True):
    """The recorded reports of a course that fit its present state."""

    scenes: Mapping[str, SceneReport] = field(default_factory=dict)
    """By the model's name, as `diets`."""
    diets: Mapping[str, DietReport] = field(default_factory=dict)
    cases: tuple[CaseReport, ...] = ()
