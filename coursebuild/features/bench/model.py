"""A recorded report that a text shows, and the scenarios that models declare."""

from __future__ import annotations

from typing import Literal, TypeAlias

from coursebuild.core.model import Course, FeatureBlock
from coursebuild.core.text.source import Span

BenchPart: TypeAlias = Literal["plot", "stable", "orders", "table"]
"""A part of a report that can be shown."""
PARTS: tuple[BenchPart, ...] = ("plot", "stable", "orders", "table")
"""All parts, in the order in which they are shown."""


class Bench(FeatureBlock, frozen=True):
    """The recorded report on a model in one of its scenarios, or on a sweep."""

    model: str
    model_span: Span
    scenario: str | None
    """`None` for the first."""
    scenario_span: Span | None
    sweep: str | None
    """Shown instead of a scenario: parameters at other values."""
    sweep_span: Span | None
    shows: tuple[BenchPart, ...]
    """The parts to show, in order."""

    def summary(self) -> Bench:
        """The block itself."""
        return self

    def mentioned_models(self) -> tuple[str, ...]:
        """The model that was measured."""
        return (self.model,)


def declared_scenarios(course: Course, model: str) -> dict[str, str]:
    """Map the scenarios that the course declares for a model to their titles."""
    declarations = (d for d in course.declarations if d.model == model)
    scenarios = (scenario for declaration in declarations for scenario in declaration.scenarios)
    return {scenario.name: scenario.title or scenario.name for scenario in scenarios}
