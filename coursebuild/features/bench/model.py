"""A recorded report that a text shows, and the scenarios that models declare."""

from __future__ import annotations

from typing import Literal, TypeAlias

from coursebuild.core.model import Course, FeatureBlock
from coursebuild.core.text.source import Span

BenchPart: TypeAlias = Literal["plot", "stable", "orders", "table"]
"""What of a report is shown."""
PARTS: tuple[BenchPart, ...] = ("plot", "stable", "orders", "table")
"""In the order in which they are shown."""


class Bench(FeatureBlock, frozen=True):
    """What was recorded of a model in one of its scenarios."""

    model: str
    model_span: Span
    scenario: str | None
    """`None`: the first."""
    scenario_span: Span | None
    sweep: str | None
    """What is shown instead: parameters at other values."""
    sweep_span: Span | None
    shows: tuple[BenchPart, ...]
    """In the order in which it is shown."""

    def summary(self) -> Bench:
        """All of it."""
        return self

    def mentioned_models(self) -> tuple[str, ...]:
        """The one that was measured."""
        return (self.model,)


def declared_scenarios(course: Course, model: str) -> dict[str, str]:
    """The titles of the scenarios that stand beside a model, by name."""
    found = (one for one in course.declarations if one.model == model)
    return {one.name: one.title or one.name for each in found for one in each.scenarios}
