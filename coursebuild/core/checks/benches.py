"""Shown reports against the course: the model exists, has the scenario, and was measured.

Entry points: `bench_findings`, for some blocks; `check_keyframes`, for the scenarios of models that
declare none, which are known where the compiled model is.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from coursebuild.core.model import Bench, Block, Course
from coursebuild.core.model.results import ModelFacts
from coursebuild.core.model.scenarios import keyframe_scenarios
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean


def bench_findings(blocks: Iterable[Block], course: Course) -> tuple[Diagnostic, ...]:
    """What is wrong with the reports that some blocks show, as far as the course tells."""
    found: list[Diagnostic] = []
    for bench in (block for block in blocks if isinstance(block, Bench)):
        found += _findings(bench, course)
    return tuple(found)


def _findings(bench: Bench, course: Course) -> Iterator[Diagnostic]:
    from coursebuild.numerics.reports.records import BENCH  # which most courses do not need

    models = [model.name for model in course.models]
    if bench.model not in models:
        message, help = f"no model `{bench.model}` in models/", did_you_mean(bench.model, models)
        yield diagnose("bench-model", bench.model_span, message, help=help)
        return
    declared = declared_scenarios(course, bench.model)
    if declared:
        yield from _scenario(bench, declared)
    if BENCH.path(bench.model) not in course.files:
        message = f"nothing was recorded of the model `{bench.model}`, so the page says so"
        help = f"measure it with `coursebuild bench {bench.model} --record`"
        yield diagnose("bench-unrecorded", bench.model_span, message, help=help)


def declared_scenarios(course: Course, model: str) -> tuple[str, ...]:
    """The scenarios that stand beside a model, by name."""
    found = (one for one in course.declarations if one.model == model)
    return tuple(scenario.name for one in found for scenario in one.scenarios)


def check_keyframes(bench: Bench, facts: ModelFacts) -> Iterator[Diagnostic]:
    """What is wrong with a scenario of a model that declares none: its keyframes are scenarios."""
    yield from _scenario(bench, keyframe_scenarios(facts.keyframes))


def _scenario(bench: Bench, names: Collection[str]) -> Iterator[Diagnostic]:
    if bench.scenario is not None and bench.scenario not in names:
        message = f"the model `{bench.model}` has no scenario `{bench.scenario}`"
        help = did_you_mean(bench.scenario, names)
        yield diagnose("bench-scenario", bench.scenario_span or bench.span, message, help=help)
