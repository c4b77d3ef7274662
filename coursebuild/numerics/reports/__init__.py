"""What was measured, as values: it is kept, printed and drawn, and shown on pages.

Entry points: `Reports`, those that a course's pages may show. `bench`: speed against error of a
model; `sweep`: its parameters at other values; `cases`: the hard cases; `diet`: what a model can be
without. `records`: reports as files; `departures`: how two differ; `text`: what is shown, and in
which words; `plot` and `sweep_plot`: charts. Nothing here measures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from msgspec import Struct, field

if TYPE_CHECKING:  # a course without reports needs none of it
    from coursebuild.numerics.reports.bench import SceneReport
    from coursebuild.numerics.reports.cases import CaseReport
    from coursebuild.numerics.reports.diet import DietReport


class Record(Struct, frozen=True, forbid_unknown_fields=True):
    """A part of a report, which can be kept as JSON.

    No number is infinite or missing by a code of its own: `None` stands for what is not there, and
    a field beside it says why.
    """


class Interval(Record, frozen=True):
    """A figure that varies from measurement to measurement, and its 95 % interval."""

    value: float
    low: float
    high: float

    def scaled(self, factor: float) -> Interval:
        """In another unit."""
        return Interval(factor * self.value, factor * self.low, factor * self.high)

    @property
    def half_width(self) -> float:
        """Relative to the value; infinite where that is 0."""
        return (self.high - self.low) / (2 * self.value) if self.value else math.inf


class Reports(Struct, frozen=True):
    """What was recorded of a course, and fits it as it is."""

    scenes: Mapping[str, SceneReport] = field(default_factory=dict)
    """By the model's name, as `diets`."""
    diets: Mapping[str, DietReport] = field(default_factory=dict)
    cases: tuple[CaseReport, ...] = ()
