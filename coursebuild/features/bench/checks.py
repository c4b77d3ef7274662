"""Checks `bench` fences against the course: the model exists, has the scenario, and was measured.

Entry points: `check_benches`; `check_keyframes`, for models that declare no scenarios, whose
keyframes are known only once the model is compiled.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator

from coursebuild.core.model import Course, Document, FeatureBlock, find_blocks
from coursebuild.core.model.results import ModelFacts
from coursebuild.core.model.scenarios import keyframe_scenarios
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.features.bench.model import Bench, declared_scenarios


def check_benches(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Report mistakes of `bench` fences that the course alone shows."""
    for document in documents:
        for block in find_blocks(document, Bench):
            yield from _check(block, course)


def check_keyframes(
    course: Course, facts_of: Callable[[FeatureBlock], ModelFacts | None]
) -> Iterator[Diagnostic]:
    """Report unknown scenarios of models that declare none: there, keyframes are scenarios."""
    for document in course.documents:
        for block in find_blocks(document, Bench):
            if not declared_scenarios(course, block.model):
                facts = facts_of(block)
                if facts is not None:
                    yield from _check_scenario(block, keyframe_scenarios(facts.keyframes))


def _check(bench: Bench, course: Course) -> Iterator[Diagnostic]:
    from coursebuild.numerics.reports.records import BENCH  # late: most courses do not need it

    models = [model.name for model in course.models]
    if bench.model not in models:
        message, help = f"no model `{bench.model}` in models/", did_you_mean(bench.model, models)
        yield diagnose("bench-model", bench.model_span, message, help=help)
        return
    declarations = [d for d in course.declarations if d.model == bench.model]
    sweeps = [sweep.name for declaration in declarations for sweep in declaration.sweeps]
    if bench.sweep is not None and bench.sweep not in sweeps:
        message = f"the model `{bench.model}` has no sweep `{bench.sweep}`"
        help = did_you_mean(bench.sweep, sweeps)
        yield diagnose("bench-scenario", bench.sweep_span or bench.span, message, help=help)
    scenarios = declared_scenarios(course, bench.model)
    if scenarios:
        yield from _check_scenario(bench, scenarios)
    if BENCH.path(bench.model) not in course.files:
        message = f"nothing was recorded of the model `{bench.model}`, and the page says so"
        help = f"measure it with `{BENCH.command(bench.model)}`"
        yield diagnose("bench-unrecorded", bench.model_span, message, help=help)


def _check_scenario(bench: Bench, names: Collection[str]) -> Iterator[Diagnostic]:
    if bench.scenario is not None and bench.scenario not in names:
        message = f"the model `{bench.model}` has no scenario `{bench.scenario}`"
        help = did_you_mean(bench.scenario, names)
        yield diagnose("bench-scenario", bench.scenario_span or bench.span, message, help=help)
