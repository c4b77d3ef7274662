"""What MuJoCo said about models and MJCF blocks, as diagnostics at the right line.

Entry points: `mjcf_texts(course)` (what to compile), `check_compiled(course, models, texts)`.

1. `mjcf_texts` gives each `mjcf` block, and each model that a block of a feature holds, as a whole
   model, with the number of lines put before it.
2. `check_compiled` holds what compiling gave against what the lesson says, and lets features check
   what they name. A file that only other models include need not compile by itself.
3. Scenarios that are declared for a model are held against it: what they name is there, states and
   commands have as many numbers as the model takes, and its timestep ends where the state is looked
   at and commands change.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

from msgspec import Struct

from coursebuild.core.model import (
    Course,
    Declarations,
    DeclaredScenario,
    FeatureBlock,
    Mjcf,
    MjcfModel,
    document_blocks,
)
from coursebuild.core.model.results import CompileResult, ModelFacts
from coursebuild.core.model.scenarios import DURATION, MOST_STEPS, DeclaredSweep
from coursebuild.core.registry import features, kind_of_block
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose, did_you_mean, nearest
from coursebuild.core.text.source import Excerpt, Source, Span

_PART = re.compile(r"\s*(?:<(?:\?.*?\?|!--.*?--)>\s*)*<mujocoinclude\b", re.DOTALL)


class MjcfText(Struct, frozen=True):
    """A text to compile, and where it comes from."""

    block: Mjcf | FeatureBlock
    code: Excerpt
    text: str
    lines_before: int
    """Lines of `text` that are not the author's."""


def mjcf_texts(course: Course) -> tuple[MjcfText, ...]:
    """Every MJCF text in the lessons, in document order."""
    texts: list[MjcfText] = []
    for document in course.documents:
        for block in document_blocks(document):
            if isinstance(block, Mjcf):
                texts.append(_whole(block))
            elif isinstance(block, FeatureBlock) and (code := block.mjcf()) is not None:
                texts.append(MjcfText(block, code, code.text, 0))
    return tuple(texts)


def _whole(block: Mjcf) -> MjcfText:
    """A fragment gets the elements around it.

    `fragment="worldbody/body"` names nested ones, from the outside.
    """
    if block.fragment is None:
        return MjcfText(block, block.code, block.code.text, 0)
    if block.fragment in ("", "mujoco"):
        return MjcfText(block, block.code, f"<mujoco>\n{block.code.text}\n</mujoco>", 1)
    path = block.fragment.split("/")
    opening = "<mujoco>" + "".join(f"<{name}>" for name in path)
    closing = "".join(f"</{name}>" for name in reversed(path)) + "</mujoco>"
    return MjcfText(block, block.code, f"{opening}\n{block.code.text}\n{closing}", 1)


def check_compiled(
    course: Course,
    models: Mapping[str, CompileResult],
    texts: Sequence[tuple[MjcfText, CompileResult]],
    readable: Callable[[str], str],
) -> tuple[Diagnostic, ...]:
    """Diagnostics of the models, of the MJCF texts, and of what features name in them.

    `readable` makes one line of a message of MuJoCo's.
    """
    blocks = (block for document in course.documents for block in document_blocks(document))
    shown = {n for block in blocks if isinstance(block, FeatureBlock) for n in block.models()}
    found: list[Diagnostic] = []
    parts = _parts(course, models) - shown
    for model in course.models:
        result = models[model.name]
        if result.error and model.name not in parts:
            found.append(broken_model(model, result, readable))
    facts: dict[tuple[str, int], ModelFacts] = {}
    for text, result in texts:
        found += _check_text(text, result, readable)
        if result.facts is not None:
            facts[_place(text.block)] = result.facts

    def known(block: FeatureBlock) -> ModelFacts | None:
        names = (*block.models(), *block.mentioned_models())
        named = (models[name].facts for name in names if name in models)
        return next(named, None) or facts.get(_place(block))

    for feature in features():
        if feature.check_models is not None:
            found += feature.check_models(course, known)
    for declared in course.declarations:
        facts_of_model = models[declared.model].facts
        if facts_of_model is not None:
            found += check_scenarios(declared, facts_of_model)
    return tuple(found)


def broken_model(
    model: MjcfModel, result: CompileResult, readable: Callable[[str], str]
) -> Diagnostic:
    """Why a model does not compile."""
    span = line_span(model.source.excerpt(), result.line, 0, model.source.span(0, 0))
    message = f"the model `{model.name}` does not compile: {readable(result.error)}"
    return diagnose("model-error", span, message)


def scenarios_of_no_model(source: Source, models: Collection[str]) -> Diagnostic:
    """Of a file of scenarios beside which there is none of the models, given by their paths."""
    model = source.path.removesuffix(".toml") + ".xml"
    near = nearest(model, models)
    help = f"is it `{near}`?" if near is not None else "put it beside its model"
    message = f"there is no model {model} to which these scenarios belong"
    return diagnose("scenario-model", source.span(0, 0), message, help=help)


def _place(block: Mjcf | FeatureBlock) -> tuple[str, int]:
    """What a block is found by: it may be another object the next time."""
    return block.span.path, block.span.start


def _parts(course: Course, models: Mapping[str, CompileResult]) -> set[str]:
    """Names of the files in models/ that are there to be included by others."""
    included = {
        path for result in models.values() if result.facts for path in result.facts.includes
    }
    return {
        model.name
        for model in course.models
        if model.source.path in included or _PART.match(model.source.text)
    }


def line_span(code: Excerpt, line: int | None, before: int, otherwise: Span) -> Span:
    """A line of a model, from 1, which has `before` more lines in front when it is compiled."""
    if line is None or not 1 <= line - before <= code.text.count("\n") + 1:
        return otherwise
    row = code.lines()[line - before - 1]
    indent = len(row.text) - len(row.text.lstrip())
    return row.slice(indent, len(row.text.rstrip())).span() if row.text.strip() else row.span()


def _check_text(
    text: MjcfText, result: CompileResult, readable: Callable[[str], str]
) -> Iterator[Diagnostic]:
    block = text.block
    if isinstance(block, Mjcf) and block.error is not None:
        span = block.error_span or block.span.first_line()
        if not result.error:
            yield diagnose(
                "mjcf-compiles",
                span,
                f"this block must fail with `{block.error}`, and it compiles",
                help="mend the block, or drop `error=`",
            )
        elif _folded(block.error) not in _folded(result.error):
            yield diagnose(
                "mjcf-message",
                span,
                f"the message of the compiler does not contain `{block.error}`",
                notes=[Note(f"it says: {result.error}")],
            )
        return
    if result.error:
        span = line_span(text.code, result.line, text.lines_before, block.span.first_line())
        what, help = "this block", ""
        if isinstance(block, FeatureBlock):
            what = f"the model in this {kind_of_block(block).name}"
        elif block.fragment is None and "<mujoco" not in text.text:
            help = 'if it is a part of a model say so: `fragment="worldbody"`'
        message = f"{what} does not compile: {readable(result.error)}"
        yield diagnose("mjcf-error", span, message, help=help)


def _folded(text: str) -> str:
    return " ".join(text.split())


_RULE = "scenario-model"


def check_scenarios(declared: Declarations, facts: ModelFacts) -> Iterator[Diagnostic]:
    """Everything in which the scenarios do not fit the model."""
    for scenario in declared.scenarios:
        yield from _check_keyframe(scenario, facts)
        yield from _check_lengths(scenario, facts)
        yield from _check_measured(scenario, facts)
        yield from _check_timestep(scenario, facts)
    for sweep in declared.sweeps:
        yield from _check_sweep(sweep, declared.scenarios, facts)


def _check_keyframe(scenario: DeclaredScenario, facts: ModelFacts) -> Iterator[Diagnostic]:
    wanted, place = scenario.keyframe, scenario.place("keyframe")
    count = len(facts.keyframes)
    if isinstance(wanted, int) and wanted >= count:
        have = f"it has {count}" if count else "it has none"
        message = f"the model has no keyframe {wanted}: {have}, counted from 0"
        yield diagnose(_RULE, place, message)
    if isinstance(wanted, str) and wanted not in facts.keyframes:
        names = [name for name in facts.keyframes if name]
        message = f"the model has no keyframe `{wanted}`"
        yield diagnose(_RULE, place, message, help=did_you_mean(wanted, names))


def _check_lengths(scenario: DeclaredScenario, facts: ModelFacts) -> Iterator[Diagnostic]:
    for name, given, count, what in (
        ("qpos", scenario.qpos, facts.nq, "positions (`nq`)"),
        ("qvel", scenario.qvel, facts.nv, "velocities (`nv`)"),
        ("controls", scenario.controls[0] if scenario.controls else (), facts.nu, "actuators"),
    ):
        if name == "controls" and scenario.controls:
            wrong = len(given) != count
            message = f"a command has {len(given)} numbers, and the model has {count} {what}"
        else:
            wrong = bool(given) and len(given) != count
            message = f"`{name}` has {len(given)} numbers, and the model has {count} {what}"
        if wrong:
            yield diagnose(_RULE, scenario.place(name), message)


def _check_measured(scenario: DeclaredScenario, facts: ModelFacts) -> Iterator[Diagnostic]:
    measure = scenario.measured
    if measure is None:
        return
    known = {"body": facts.body_names, "site": facts.sites, "sensor": facts.sensors}[measure.kind]
    if measure.name not in known:
        message = f"the model has no {measure.kind} `{measure.name}`"
        help = did_you_mean(measure.name, [name for name in known if name])
        yield diagnose(_RULE, scenario.place("measure"), message, help=help)


def _check_timestep(scenario: DeclaredScenario, facts: ModelFacts) -> Iterator[Diagnostic]:
    step = facts.timestep
    given = (
        ("sample", scenario.sample),
        ("hold", scenario.hold),
        ("duration", scenario.duration),
    )
    for name, length in given:
        if length is not None:
            count = round(length / step)
            if abs(count * step - length) > 1e-9 * length:
                message = f"the model's timestep, {step:g} s, does not divide `{name}`"
                message += f" ({length:g} s)"
                help = f"a multiple near it is {max(count, 1) * step:.12g}"
                yield diagnose(_RULE, scenario.place(name), message, help=help)
            return


MOST_SWEPT = 2_000_000
"""Steps of all runs of a sweep together: each is looked at, so that these take minutes."""


def _check_sweep(
    sweep: DeclaredSweep, scenarios: Sequence[DeclaredScenario], facts: ModelFacts
) -> Iterator[Diagnostic]:
    own, total = facts.timestep, 0.0
    run = next((one for one in scenarios if sweep.scenario in (None, one.name)), None)
    duration = None if run is None else run.duration
    if duration is None:
        held = 0.0 if run is None else len(run.controls) * (run.hold or 0.0)
        duration = max(held, min(DURATION, MOST_STEPS * own))
    for part in sweep.variations:
        timed = part.parameter == "option.timestep"
        for value in part.values:
            step = own
            if timed and isinstance(value, float | int):
                step = own * value if part.relative else value
            if step <= 0:
                yield diagnose(_RULE, part.span, f"a timestep cannot be {step:g} s")
                return
            total += duration / step
        if total > MOST_SWEPT:
            message = f"with `{part.parameter}` the sweep makes {total:.2g} steps"
            help = f"{MOST_SWEPT:,} are the most: take fewer values, or a shorter scenario"
            yield diagnose(_RULE, part.span, message, help=help)
            return
