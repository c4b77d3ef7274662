"""A recorded report that a text shows: the `bench` fence, read and compared with the course.

The first word of a fence is the name of the model, as in a link (`%20` is a space). Keys:
`scenario=swing` (default: the first), `show="plot,table"` (see `PARTS`), or `sweep=softness`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Literal, TypeAlias
from urllib.parse import unquote

from coursebuild.api import (
    Course,
    Diagnostic,
    Document,
    FeatureBlock,
    Fence,
    ModelFacts,
    Parsed,
    Span,
    TextParser,
    diagnose,
    did_you_mean,
    find_blocks,
)
from coursebuild.core.model.report_files import BENCH, ENGINES
from coursebuild.core.model.scenarios import keyframe_scenarios
from coursebuild.core.syntax.fence import kind_of
from coursebuild.core.syntax.spans import trim

BenchPart: TypeAlias = Literal["plot", "stable", "orders", "table", "engines"]
"""A part of a report that can be shown."""
PARTS: tuple[BenchPart, ...] = ("plot", "stable", "orders", "table", "engines")
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


_DEFAULT: tuple[BenchPart, ...] = ("plot", "table")


def parse_bench(fence: Fence, _: TextParser) -> Parsed[Bench | None]:
    """Parse a `bench` fence; `None` if it has mistakes."""
    parsed_keys = fence.keys(values=("scenario", "sweep", "show"), has_name=True)
    keys, diagnostics = parsed_keys.value, list(parsed_keys.diagnostics)
    if keys.name is None:
        message = "a bench needs the name of a model"
        help = "write `bench NAME`, with the name of a file in models/, without `.xml`"
        diagnostics.append(diagnose("fence-info", kind_of(fence.info).span(), message, help=help))
    show = keys.get("show")
    shows = _DEFAULT
    if show is not None:
        parts = {part.text: part for part in reversed(show.parts()) if part.text}
        for name, part in parts.items():
            if name not in PARTS:
                message, help = f"nothing of a report is called `{name}`", did_you_mean(name, PARTS)
                diagnostics.append(diagnose("fence-key-value", part.span(), message, help=help))
        if not parts:
            message, help = "`show` names nothing", "for example `show=plot,table`"
            diagnostics.append(diagnose("fence-key-value", show.value_span, message, help=help))
        shows = tuple(name for name in PARTS if name in parts)
    body = trim(fence.body, " \t\n")
    if body.text:
        message = "a `bench` block shows a recorded report and takes no text"
        help = "write the text before or after it"
        diagnostics.append(diagnose("bench-text", body.span().first_line(), message, help=help))
    if keys.name is None or diagnostics:
        return Parsed(None, tuple(diagnostics))
    model, place = unquote(keys.name.key), keys.name.key_span
    scenario, scenario_place = keys.value("scenario"), keys.place("scenario")
    sweep, sweep_place = keys.value("sweep"), keys.place("sweep")
    bench = Bench(fence.span, model, place, scenario, scenario_place, sweep, sweep_place, shows)
    return Parsed(bench)


def check_benches(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Report mistakes of `bench` fences that the course alone shows."""
    benches = [bench for document in documents for bench in find_blocks(document, Bench)]
    if not benches:
        return
    models = [model.name for model in course.models]
    for bench in benches:
        if bench.model not in models:
            message = f"no model `{bench.model}` in models/"
            help = did_you_mean(bench.model, models)
            yield diagnose("bench-model", bench.model_span, message, help=help)
            continue
        declarations = [d for d in course.declarations if d.model == bench.model]
        sweeps = [sweep.name for declaration in declarations for sweep in declaration.sweeps]
        if bench.sweep is not None and bench.sweep not in sweeps:
            message = f"the model `{bench.model}` has no sweep `{bench.sweep}`"
            help = did_you_mean(bench.sweep, sweeps)
            yield diagnose("bench-scenario", bench.sweep_span or bench.span, message, help=help)
        scenarios = declared_scenarios(course, bench.model)
        if scenarios:
            yield from _check_scenario(bench, scenarios)
        commands: dict[str, str] = {}
        if bench.shows != ("engines",):
            commands[BENCH.path(bench.model)] = BENCH.command(bench.model)
        if "engines" in bench.shows:
            commands[ENGINES.path(bench.model)] = ENGINES.command(bench.model)
        for path, command in commands.items():
            if path not in course.files:
                message = f"no measurements of the model `{bench.model}` are recorded, "
                message += "and the page says so"
                help = f"measure it with `{command}`"
                yield diagnose("bench-unrecorded", bench.model_span, message, help=help)


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


def _check_scenario(bench: Bench, names: Collection[str]) -> Iterator[Diagnostic]:
    if bench.scenario is not None and bench.scenario not in names:
        message = f"the model `{bench.model}` has no scenario `{bench.scenario}`"
        help = did_you_mean(bench.scenario, names)
        yield diagnose("bench-scenario", bench.scenario_span or bench.span, message, help=help)
