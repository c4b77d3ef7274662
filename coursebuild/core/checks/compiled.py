"""What MuJoCo says about models and MJCF blocks, as diagnostics at the right line.

Entry points: `mjcf_texts(course)` (what to compile), `check_compiled(course, models, texts)`.

1. `mjcf_texts` makes a whole model of each `mjcf` block and of each block of a feature that holds
   a model, and counts the lines put before the author's.
2. `check_compiled` compares the results of the compiler with what the lesson says, and lets
   features check the names that they use. A file that only other models include need not compile
   by itself.
3. The scenarios declared for a model are compared with it: the model has what they name, states and
   commands have as many numbers as it takes, and its timestep divides the times at which the state
   is sampled and commands change.
"""

from __future__ import annotations

import contextlib
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
    find_blocks,
)
from coursebuild.core.model.results import CompileResult, ModelFacts
from coursebuild.core.model.scenarios import DURATION, MOST_STEPS, DeclaredSweep
from coursebuild.core.registry import features, kind_of_block
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Edit,
    Fix,
    Note,
    diagnose,
    did_you_mean,
    nearest,
    propose,
)
from coursebuild.core.text.source import Excerpt, Source, Span

INCLUDED_ROOT = re.compile(r"\s*+(?:<(?:\?.*?\?|!--.*?--)>\s*+)*+<mujocoinclude\b", re.DOTALL)
"""How a file begins that is meant to be included by others."""


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
            if isinstance(block, Mjcf) and block.fragment is not None:
                # `fragment="worldbody/body"` names nested elements, from the outside.
                path = ["mujoco"]
                if block.fragment not in ("", "mujoco"):
                    path += block.fragment.split("/")
                opening = "".join(f"<{name}>" for name in path)
                closing = "".join(f"</{name}>" for name in reversed(path))
                text = f"{opening}\n{block.code.text}\n{closing}"
                texts.append(MjcfText(block, block.code, text, 1))
            elif isinstance(block, Mjcf):
                texts.append(MjcfText(block, block.code, block.code.text, 0))
            elif isinstance(block, FeatureBlock) and (code := block.mjcf()) is not None:
                texts.append(MjcfText(block, code, code.text, 0))
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
    paths = {path for result in models.values() if result.facts for path in result.facts.includes}
    included = {
        model.name
        for model in course.models
        if model.source.path in paths or INCLUDED_ROOT.match(model.source.text)
    } - lesson_models
    for model in course.models:
        result = models[model.name]
        if result.error and model.name not in included:
            diagnostics.append(diagnose_model(model, result, readable, course.models))
        elif not result.error and (fault := _find_fault(model.source.excerpt(), 0)) is not None:
            message = f"the model `{model.name}` holds {fault[1]}"
            diagnostics.append(diagnose("model-error", fault[0], message, help=_FAULT_HELP))
    facts: dict[tuple[str, int], ModelFacts] = {}
    for text, result in texts:
        diagnostics += _check_text(text, result, readable, course.models)
        if result.facts is not None:
            facts[_block_key(text.block)] = result.facts

    def find_facts(block: FeatureBlock) -> ModelFacts | None:
        names = (*block.models(), *block.mentioned_models())
        candidates = (models[name].facts for name in names if name in models)
        return next(candidates, None) or facts.get(_block_key(block))

    for feature in features():
        if feature.check_models is not None:
            diagnostics += feature.check_models(course, find_facts)
    for declarations in course.declarations:
        facts_of_model = models[declarations.model].facts
        if facts_of_model is not None:
            diagnostics += check_scenarios(declarations, facts_of_model)
    return tuple(diagnostics)


def diagnose_model(
    model: MjcfModel,
    result: CompileResult,
    readable: Callable[[str], str],
    models: Sequence[MjcfModel] = (),
) -> Diagnostic:
    """The diagnostic of a model that does not compile; `models` may be included by it."""
    span = line_span(model.source.excerpt(), result.line, 0, model.source.span(0, 0))
    if result.timeout:
        return _diagnose_timeout(span, f"the model `{model.name}`", result)
    message = f"the model `{model.name}` does not compile: {readable(result.error)}"
    notes, help = _note_opening(model.source.excerpt(), 0, result.error), ""
    text, closing = model.source.text, "</mujoco>\n"
    if closing.rstrip() not in text:
        with contextlib.suppress(expat.ExpatError):
            closing = closing if text.endswith("\n") else f"\n{closing}"
            expat.ParserCreate().Parse(f"{text}{closing}".encode(), True)
            edit = Edit(model.source.span(len(text), len(text)), closing)
            help = Fix("end it with `</mujoco>`", edits=(edit,), safe=True)
    span, help = _propose_name(result, Excerpt.of_span(model.source.span()), 0, models) or (
        span,
        help,
    )
    return diagnose("model-error", span, message, help=help, notes=notes)


def _propose_name(
    result: CompileResult, code: Excerpt, offset: int, models: Sequence[MjcfModel]
) -> tuple[Span, Fix] | None:
    """Where a name is misspelt that the compiler does not know, and the fix.

    `code` begins at this offset of the text that was compiled; the name may also be in a model that
    it includes.
    """
    if (misspelling := result.misspelling) is None:
        return None
    if misspelling.path:
        sources = (m.source for m in models if m.source.path == misspelling.path)
        code, offset = next((Excerpt.of_span(s.span()) for s in sources), code), 0
    word, likely = misspelling.word, misspelling.candidates[0]
    parts = [code.slice(a - offset, b - offset) for a, b in misspelling.places if a >= offset]
    if len(parts) < len(misspelling.places) or any(part.text != word for part in parts):
        return None
    place, *copies = (part.span() for part in parts)
    fix = propose(word, likely, misspelling.candidates)
    if fix.new is not None:
        edits = tuple(Edit(span, likely) for span in copies)
        fix = Fix(fix, fix.new, fix.old, edits=edits, safe=fix.safe)
    return place, fix


def _diagnose_timeout(span: Span, subject: str, result: CompileResult) -> Diagnostic:
    help = "make it smaller, or set `models` in `[limits]` of the map: seconds for all models"
    return diagnose("model-timeout", span, f"{subject} {result.error}", help=help)


def diagnose_orphan_scenarios(source: Source, models: Collection[str]) -> Diagnostic:
    """The diagnostic of a file of scenarios without its model; `models` are the paths of all."""
    model = source.path.removesuffix(".toml") + ".xml"
    likely = nearest(model, models)
    help = f"is it `{likely}`?" if likely is not None else "put it beside its model"
    message = f"there is no model {model} to which these scenarios belong"
    return diagnose("scenario-model", source.span(0, 0), message, help=help)


def _block_key(block: Mjcf | FeatureBlock) -> tuple[str, int]:
    """A key for a block: features may hold another object for the same one."""
    return block.span.path, block.span.start


def line_span(code: Excerpt, line: int | None, lines_before: int, fallback: Span) -> Span:
    """The span of a line that MuJoCo names; `lines_before` of them are not in `code`."""
    if line is None or not 1 <= line - lines_before <= code.text.count("\n") + 1:
        return fallback
    row = code.lines()[line - lines_before - 1]
    indent = len(row.text) - len(row.text.lstrip())
    return row.slice(indent, len(row.text.rstrip())).span() if row.text.strip() else row.span()


_FAULT_HELP = "write `<` before an element and `<!-- … -->` around a comment, or delete it"


def _find_fault(code: Excerpt, lines_before: int, text: str = "") -> tuple[Span, str] | None:
    """Where XML is broken or holds words between elements, which MuJoCo may pass over."""
    parser = expat.ParserCreate()
    faults = list[tuple[int, str]]()

    def read_words(words: str) -> None:
        if words.strip() and not faults:
            extract = textwrap.shorten(words, 40, placeholder="…")
            faults.append((parser.CurrentLineNumber, f"`{extract}` outside any tag"))

    parser.CharacterDataHandler = read_words
    try:
        parser.Parse(text or code.text, True)
    except expat.ExpatError as error:
        faults.append((error.lineno, f"broken XML: {expat.ErrorString(error.code)}"))
    if not faults:
        return None
    line, message = faults[0]
    return line_span(code, line, lines_before, code.span()), message


def _note_opening(code: Excerpt, lines_before: int, error: str) -> tuple[Note, ...]:
    """Where the element begins that MuJoCo says is not closed."""
    match = re.search(r"MISMATCHED_ELEMENT.*Line number=(\d+): XMLElement name=(\S+)", error)
    if match is None:
        return ()
    place = line_span(code, int(match[1]), lines_before, code.span())
    return (Note(f"<{match[2]}> begins here", place),)


def _check_text(
    text: MjcfText,
    result: CompileResult,
    readable: Callable[[str], str],
    models: Sequence[MjcfModel],
) -> Iterator[Diagnostic]:
    block = text.block
    subject = "this block"
    if isinstance(block, FeatureBlock):
        subject = f"the model in this {kind_of_block(block).name}"
    if result.timeout:
        yield _diagnose_timeout(block.span.first_line(), subject, result)
        return
    if isinstance(block, Mjcf) and block.error is not None:
        span = block.error_span or block.span.first_line()
        place = line_span(text.code, result.line, text.lines_before, block.span.first_line())
        if not result.error:
            message = f"this block must fail with `{block.error}`, and it compiles"
            help = "fix the block, or remove `error=`"
            yield diagnose("mjcf-compiles", span, message, help=help)
        elif " ".join(block.error.split()) not in " ".join(result.error.split()):
            message = f"the message of the compiler does not contain `{block.error}`"
            note = Note(f"it says: {result.error}", place)
            yield diagnose("mjcf-message", span, message, notes=[note])
        elif (fault := _find_fault(text.code, text.lines_before, text.text)) is not None:
            message = f"{subject} holds {fault[1]}"
            yield diagnose("mjcf-error", fault[0], message, help=_FAULT_HELP)
        return
    if result.error:
        span = line_span(text.code, result.line, text.lines_before, block.span.first_line())
        help = ""
        if isinstance(block, Mjcf) and block.fragment is None and "<mujoco" not in text.text:
            help = 'if it is a part of a model say so: `fragment="worldbody"`'
        offset = text.text.index("\n") + 1 if text.lines_before else 0
        span, help = _propose_name(result, text.code, offset, models) or (span, help)
        message = f"{subject} does not compile: {readable(result.error)}"
        notes = _note_opening(text.code, text.lines_before, result.error)
        yield diagnose("mjcf-error", span, message, help=help, notes=notes)
    elif (fault := _find_fault(text.code, text.lines_before, text.text)) is not None:
        message = f"{subject} holds {fault[1]}"
        yield diagnose("mjcf-error", fault[0], message, help=_FAULT_HELP)


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
        rows = (
            ("qpos", "`qpos`", scenario.qpos or None, facts.nq, "positions (`nq`)"),
            ("qvel", "`qvel`", scenario.qvel or None, facts.nv, "velocities (`nv`)"),
            (
                "controls",
                "a command",
                next(iter(scenario.controls), None),
                facts.nu,
                "controls (`nu`)",
            ),
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
        yield from _check_horizon_error(scenario, facts.sizes)
        yield from _check_timestep(scenario, facts)
    for sweep in declarations.sweeps:
        yield from _check_sweep(sweep, declarations.scenarios, facts)


_LEAST_ERROR = 1e-8
"""Of a difference of coordinates: whether a motion is chaotic is seen by differences of 1e-10."""


def _check_horizon_error(
    scenario: DeclaredScenario, sizes: Mapping[str, float]
) -> Iterator[Diagnostic]:
    place = scenario.place("horizon_error")
    kinds = {"rad": "hinge, ball or free joint", "m": "slide or free joint"}
    for unit, error in scenario.horizon_error.items():
        if unit not in sizes:
            message = f"no coordinate of the model is in {unit}: it has no {kinds[unit]}"
            help = f"state an error in {next(iter(sizes))}" if sizes else "leave it out"
            yield diagnose(_RULE, place, message, help=help)
        elif not _LEAST_ERROR * sizes[unit] <= error <= sizes[unit]:
            least, most = f"{_LEAST_ERROR * sizes[unit]:.3g}", f"{sizes[unit]:.3g} {unit}"
            message = (
                f"an error of {error:g} {unit} is too {'small' if error < sizes[unit] else 'large'}"
            )
            help = f"state one from {least} to {most}"
            yield diagnose(_RULE, place, message, help=help)


def _check_timestep(scenario: DeclaredScenario, facts: ModelFacts) -> Iterator[Diagnostic]:
    step = facts.timestep
    lengths = (
        ("sample", scenario.sample),
        ("hold", scenario.hold),
        ("duration", scenario.duration),
    )
    for name, length in lengths:
        if length is not None:
            count = round(length / step)
            if abs(count * step - length) > 1e-9 * length:
                message = f"the model's timestep, {step:g} s, does not divide `{name}`"
                message += f" ({length:g} s)"
                help = f"a multiple near it is {max(count, 1) * step:.12g}"
                yield diagnose(_RULE, scenario.place(name), message, help=help)
            return


MAX_SWEEP_STEPS = 2_000_000
"""Steps of all runs of a sweep together; so many take minutes, as each is looked at."""


def _check_sweep(
    sweep: DeclaredSweep, scenarios: Sequence[DeclaredScenario], facts: ModelFacts
) -> Iterator[Diagnostic]:
    timestep, total = facts.timestep, 0.0
    scenario = next((s for s in scenarios if sweep.scenario in (None, s.name)), None)
    duration = None if scenario is None else scenario.duration
    if duration is None:
        command_seconds = (
            0.0 if scenario is None else len(scenario.controls) * (scenario.hold or 0.0)
        )
        duration = max(command_seconds, min(DURATION, MOST_STEPS * timestep))
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
