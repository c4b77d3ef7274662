"""Reports of a course that its pages may show: those that fit the course as it is.

Entry point: `Reports`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from msgspec import Struct, field

if TYPE_CHECKING:  # a course without reports needs none of it
    from coursebuild.numerics.reports.bench import SceneReport
    from coursebuild.numerics.reports.cases import CaseReport
    from coursebuild.numerics.reports.diet import DietReport


class Reports(Struct, frozen=True):
    """What was recorded."""

    scenes: Mapping[str, SceneReport] = field(default_factory=dict)
    """By the model's name, as `diets`."""
    diets: Mapping[str, DietReport] = field(default_factory=dict)
    cases: tuple[CaseReport, ...] = ()
