"""What MuJoCo says about models, MJCF blocks and declared scenarios, at the right line.

A file that only other models include need not compile by itself.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from xml.parsers import expat

from msgspec import Struct

from coursebuild.core.model import (
    Course,
    Declarations,
    DeclaredScenario,
    FeatureBlock,
    Mjcf,
    MjcfModel,
    document_blocks,
    enclosure,
    find_blocks,
)
from coursebuild.core.model.results import CompileResult, ModelFacts
from coursebuild.core.model.scenarios import DURATION, MOST_STEPS, DeclaredSweep, is_multiple
from coursebuild.core.registry import features, kind_of_block
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Note,
    diagnose,
    did_you_mean,
)
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Source, Span

INCLUDED_ROOT = regex(r"\s*+(?>(?:<(?:\?.*?\?|!--.*?--)>\s*+)*)<mujocoinclude\b", re.DOTALL)
"""How a file begins that is meant to be included by others."""


_OPENING = regex(r"MISMATCHED_ELEMENT.*Line number=(\d+): XMLElement name=(\S+)")


class MjcfText(Struct, frozen=True):
    """A text to compile, and where it comes from."""

    block: Mjcf | FeatureBlock | MjcfModel
    code: Excerpt
    text: str
    lines_before: int = 0
    """Lines of `text` that are not the author's."""

    @property
    def subject(self) -> str:
        """What messages call it."""
        if isinstance(self.block, MjcfModel):
            return f"the model `{self.block.name}`"
        if isinstance(self.block, FeatureBlock):
            return f"the model in this {kind_of_block(self.block).name}"
        return "this block"

    @property
    def place(self) -> Span:
        if isinstance(self.block, MjcfModel):
            return self.block.source.span(0, 0)
        return self.block.span.first_line()

    def line_span(self, line: int | None) -> Span:
        """The span of a line that MuJoCo names."""
        return line_span(self.code, line, self.lines_before, self.place)

    def diagnose(
        self, message: str, place: Span, help: str = "", notes: Sequence[Note] = ()
    ) -> Diagnostic:
        """The diagnostic of what the compiler says of it."""
        rule = "model-error" if isinstance(self.block, MjcfModel) else "mjcf-error"
        return diagnose(rule, place, f"{self.subject} {message}", help=help, notes=notes)


def mjcf_texts(course: Course) -> tuple[MjcfText, ...]:
    """Every MJCF text in the lessons, in document order."""
    texts: list[MjcfText] = []
    for document in course.documents:
        for block in document_blocks(document):
            if isinstance(block, Mjcf) and (names := enclosure(block)):
                opening = "".join(f"<{name}>" for name in names)
                closing = "".join(f"</{name}>" for name in reversed(names))
                text = f"{opening}\n{block.code.text}\n{closing}"
                texts.append(MjcfText(block, block.code, text, 1))
            elif isinstance(block, Mjcf):
                texts.append(MjcfText(block, block.code, block.code.text))
            elif isinstance(block, FeatureBlock) and (code := block.mjcf()) is not None:
                texts.append(MjcfText(block, code, code.text))
    return tuple(texts)


def check_compiled(
    course: Course,
    models: Mapping[str, CompileResult],
    texts: Sequence[tuple[MjcfText, CompileResult]],
    readable: Callable[[str], str],
) -> tuple[Diagnostic, ...]:
    """Diagnostics of the models, of the MJCF texts, and of what features name in them.

    `readable` makes one line of a message of MuJoCo.
    """
    lesson_models = {
        name
        for document in course.documents
        for block in find_blocks(document, FeatureBlock)
        for name in block.models()
    }
    diagnostics: list[Diagnostic] = []
    paths = {path for result in models.values() for path in (result.facts or result).includes}
    included = {
        model.name
        for model in course.models
        if model.source.path in paths or INCLUDED_ROOT.match(model.source.text)
    } - lesson_models
    for model in course.models:
        result = models[model.name]
        if result.error and model.name not in included:
            diagnostics.append(diagnose_model(model, result, readable))
        elif not result.error:
            diagnostics += _find_fault(_text_of(model))
    facts: dict[tuple[str, int], ModelFacts] = {}
    for text, result in texts:
        diagnostics += _check_text(text, result, readable)
        if result.facts is not None:
            facts[text.place.path, text.place.start] = result.facts

    def find_facts(block: FeatureBlock) -> ModelFacts | None:
        names = (*block.models(), *block.mentioned_models())
        candidates = (models[name].facts for name in names if name in models)
        # Features may hold another object for the same block.
        return next(candidates, None) or facts.get((block.span.path, block.span.start))

    for feature in features():
        if feature.check_models is not None:
            diagnostics += feature.check_models(course, find_facts)
    for declarations in course.declarations:
        facts_of_model = models[declarations.model].facts
        if facts_of_model is not None:
            diagnostics += check_scenarios(declarations, facts_of_model)
    return tuple(diagnostics)


def diagnose_model(
    model: MjcfModel, result: CompileResult, readable: Callable[[str], str]
) -> Diagnostic:
    """The diagnostic of a model that does not compile."""
    return _diagnose_failure(_text_of(model), result, readable)


def _text_of(model: MjcfModel) -> MjcfText:
    return MjcfText(model, Excerpt.of_span(model.source.span()), model.source.text)


def _diagnose_failure(
    text: MjcfText, result: CompileResult, readable: Callable[[str], str], help: str = ""
) -> Diagnostic:
    if result.timeout:
        help = "make it smaller, or set `models` in `[limits]` of the map: seconds for all models"
        message = f"{text.subject} {result.error}"
        return diagnose("model-timeout", text.line_span(result.line), message, help=help)
    opening = _OPENING.search(result.error)
    notes = []
    if opening is not None:
        notes = [Note(f"<{opening[2]}> begins here", text.line_span(int(opening[1])))]
    message = f"does not compile: {readable(result.error)}"
    return text.diagnose(message, text.line_span(result.line), help, notes)


def diagnose_orphan_scenarios(source: Source, models: Collection[str]) -> Diagnostic:
    """The diagnostic of a file of scenarios without its model; `models` are the paths of all."""
    model = source.path.removesuffix(".toml") + ".xml"
    help = did_you_mean(model, models, most=0) or "put it beside its model"
    message = f"there is no model {model} to which these scenarios belong"
    return diagnose("scenario-model", source.span(0, 0), message, help=help)


def line_span(code: Excerpt, line: int | None, lines_before: int, fallback: Span) -> Span:
    """The span of a line that MuJoCo names; `lines_before` of them are not in `code`."""
    if line is None or not 1 <= line - lines_before <= code.text.count("\n") + 1:
        return fallback
    row = code.lines()[line - lines_before - 1]
    indent = len(row.text) - len(row.text.lstrip())
    return row.slice(indent, len(row.text.rstrip())).span() if row.text.strip() else row.span()


def _find_fault(text: MjcfText) -> Iterator[Diagnostic]:
    """Report where XML is broken or holds words between elements, which MuJoCo may pass over."""
    parser = expat.ParserCreate()
    faults = list[tuple[int, str]]()

    def read_words(words: str) -> None:
        if words.strip():
            extract = textwrap.shorten(words, 40, placeholder="…")
            faults.append((parser.CurrentLineNumber, f"`{extract}` outside any tag"))

    parser.CharacterDataHandler = read_words
    try:
        parser.Parse(text.text, True)
    except expat.ExpatError as error:
        faults.append((error.lineno, f"broken XML: {expat.ErrorString(error.code)}"))
    for line, fault in faults[:1]:
        place = line_span(text.code, line, text.lines_before, text.code.span())
        help = "write `<` before an element and `<!-- … -->` around a comment, or delete it"
        yield text.diagnose(f"holds {fault}", place, help)


def _check_text(
    text: MjcfText, result: CompileResult, readable: Callable[[str], str]
) -> Iterator[Diagnostic]:
    block, help = text.block, ""
    if isinstance(block, Mjcf) and block.error is not None and not result.timeout:
        place = block.error_span or text.place
        if not result.error:
            message = f"this block must fail with `{block.error}`, and it compiles"
            help = "fix the block, or remove `error=`"
            yield diagnose("mjcf-compiles", place, message, help=help)
        elif " ".join(block.error.split()) not in " ".join(result.error.split()):
            message = f"the message of the compiler does not contain `{block.error}`"
            note = Note(f"it says: {result.error}", text.line_span(result.line))
            yield diagnose("mjcf-message", place, message, notes=[note])
        else:
            yield from _find_fault(text)
    elif result.error:
        if isinstance(block, Mjcf) and block.fragment is None and "<mujoco" not in text.text:
            help = 'if it is a part of a model say so: `fragment="worldbody"`'
        yield _diagnose_failure(text, result, readable, help)
    else:
        yield from _find_fault(text)


_RULE = "scenario-model"


def check_scenarios(declarations: Declarations, facts: ModelFacts) -> Iterator[Diagnostic]:
    """Yield everything in which the scenarios do not fit the model."""
    for scenario in declarations.scenarios:
        keyframe, place = scenario.keyframe, scenario.place("keyframe")
        count = len(facts.keyframes)
        if isinstance(keyframe, int) and keyframe >= count:
            have = f"it has {count}" if count else "it has none"
            message = f"the model has no keyframe {keyframe}: {have}, counted from 0"
            yield diagnose(_RULE, place, message)
        if isinstance(keyframe, str) and keyframe not in facts.keyframes:
            names = [name for name in facts.keyframes if name]
            message = f"the model has no keyframe `{keyframe}`"
            yield diagnose(_RULE, place, message, help=did_you_mean(keyframe, names))
        command = next(iter(scenario.controls), None)
        rows = (
            ("qpos", "`qpos`", scenario.qpos or None, facts.nq, "positions (`nq`)"),
            ("qvel", "`qvel`", scenario.qvel or None, facts.nv, "velocities (`nv`)"),
            ("controls", "a command", command, facts.nu, "controls (`nu`)"),
        )
        for name, subject, values, count, noun in rows:
            if values is not None and len(values) != count:
                message = f"{subject} has {len(values)} numbers, and the model has {count} {noun}"
                yield diagnose(_RULE, scenario.place(name), message)
        if (measure := scenario.observable) is not None:
            kinds = {"body": facts.body_names, "site": facts.sites, "sensor": facts.sensors}
            if measure.name not in (model_names := kinds[measure.kind]):
                message = f"the model has no {measure.kind} `{measure.name}`"
                help = did_you_mean(measure.name, [name for name in model_names if name])
                yield diagnose(_RULE, scenario.place("measure"), message, help=help)
        place, sizes = scenario.place("horizon_error"), facts.sizes
        for unit, error in scenario.horizon_error.items():
            if unit not in sizes:
                message = f"no coordinate of the model is in {unit}"
                yield diagnose(_RULE, place, message, help="leave it out")
            elif not _LEAST_ERROR * (size := sizes[unit]) <= error <= size:
                message = f"an error of {error:g} {unit} is no horizon of this model"
                help = f"state one from {_LEAST_ERROR * size:.3g} to {size:.3g} {unit}"
                yield diagnose(_RULE, place, message, help=help)
        step = facts.timestep  # which may be 0 or not a number
        lengths = ((name, getattr(scenario, name)) for name in ("sample", "hold", "duration"))
        for name, length in [pair for pair in lengths if pair[1] is not None][:1]:
            if not (step > 0 and is_multiple(length, step)):
                message = f"the model's timestep, {step:g} s, does not divide"
                message += f" `{name}` ({length:g} s)"
                yield diagnose(_RULE, scenario.place(name), message)
    for sweep in declarations.sweeps:
        yield from _check_sweep(sweep, declarations.scenarios, facts)


_LEAST_ERROR = 1e-8
"""Of a difference of coordinates: whether a motion is chaotic is seen by differences of 1e-10."""


MAX_SWEEP_STEPS = 2_000_000
"""Steps of all runs of a sweep together; so many take minutes, as each is looked at."""


def _check_sweep(
    sweep: DeclaredSweep, scenarios: Sequence[DeclaredScenario], facts: ModelFacts
) -> Iterator[Diagnostic]:
    timestep, total = facts.timestep, 0.0
    duration = min(DURATION, MOST_STEPS * timestep)
    for scenario in [s for s in scenarios if sweep.scenario in (None, s.name)][:1]:
        command_seconds = len(scenario.controls) * (scenario.hold or 0.0)
        duration = scenario.duration or max(command_seconds, duration)
    for variation in sweep.variations:
        timed = variation.parameter == "option.timestep"
        for value in variation.values:
            step = timestep
            if timed and isinstance(value, float | int):
                step = timestep * value if variation.relative else value
            if step <= 0:
                yield diagnose(_RULE, variation.span, f"a timestep cannot be {step:g} s")
                return
            total += duration / step
        if total > MAX_SWEEP_STEPS:
            message = f"with `{variation.parameter}` the sweep makes {total:.2g} steps"
            help = f"{MAX_SWEEP_STEPS:,} are the most: take fewer values, or a shorter scenario"
            yield diagnose(_RULE, variation.span, message, help=help)
            return
