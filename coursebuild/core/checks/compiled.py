"""What MuJoCo said about models and MJCF blocks, as diagnostics at the right line.

Entry points: `mjcf_texts(course)` (what to compile), `check_compiled(course, models, texts)`.

1. `mjcf_texts` gives each `mjcf` block and each lab's inline `xml` as a whole model, with the
   number of lines put before it.
2. `check_compiled` holds what compiling gave against what the lesson says, and a lab's names
   against its model. A file that only other models include need not compile by itself.
3. Scenarios that are declared for a model are held against it; of a model that declares none, the
   scenarios that texts name.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence

from msgspec import Struct

from coursebuild.core.checks.benches import check_keyframes, declared_scenarios
from coursebuild.core.checks.scenarios import check_scenarios
from coursebuild.core.model import Bench, Course, Lab, Mjcf, document_blocks, document_has
from coursebuild.core.model.results import CompileResult, ModelFacts
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose, did_you_mean
from coursebuild.core.text.patterns import pattern
from coursebuild.core.text.source import Excerpt, Span

_PART = pattern(r"\s*(?:<(?:\?.*?\?|!--.*?--)>\s*)*<mujocoinclude\b", re.DOTALL)


class MjcfText(Struct, frozen=True):
    """A text to compile, and where it comes from."""

    block: Mjcf | Lab
    code: Excerpt
    text: str
    lines_before: int
    """Lines of `text` that are not the author's."""


def mjcf_texts(course: Course) -> tuple[MjcfText, ...]:
    """Every MJCF text in the lessons, in document order."""
    texts: list[MjcfText] = []
    for document in course.documents:
        if not document_has(document, Mjcf, Lab):
            continue
        for block in document_blocks(document):
            if isinstance(block, Mjcf):
                texts.append(_whole(block))
            elif isinstance(block, Lab) and block.xml is not None:
                texts.append(MjcfText(block, block.xml, block.xml.text, 0))
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
    """Diagnostics of the models, of the MJCF texts, and of the names that labs use.

    `readable` makes one line of a message of MuJoCo's.
    """
    blocks = (block for document in course.documents for block in document_blocks(document))
    using = [block for block in blocks if isinstance(block, Lab | Bench)]
    labs = [block for block in using if isinstance(block, Lab)]
    found: list[Diagnostic] = []
    parts = _parts(course, models) - {lab.model for lab in labs}
    for model in course.models:
        result = models[model.name]
        if result.error and model.name not in parts:
            span = _line(model.source.excerpt(), result.line, 0, model.source.span(0, 0))
            message = f"the model `{model.name}` does not compile: {readable(result.error)}"
            found.append(diagnose("model-error", span, message))
    facts: dict[tuple[str, int], ModelFacts] = {}
    for text, result in texts:
        found += _check_text(text, result, readable)
        if result.facts is not None:
            facts[_place(text.block)] = result.facts
    for lab in labs:
        compiled = models.get(lab.model) if lab.model is not None else None
        known = compiled.facts if compiled is not None else facts.get(_place(lab))
        if known is not None:
            found += _check_names(lab, known)
    for bench in (block for block in using if isinstance(block, Bench)):
        compiled = models.get(bench.model)
        undeclared = not declared_scenarios(course, bench.model)
        if undeclared and compiled is not None and compiled.facts is not None:
            found += check_keyframes(bench, compiled.facts)
    for declared in course.declarations:
        facts_of_model = models[declared.model].facts
        if facts_of_model is not None:
            found += check_scenarios(declared, facts_of_model)
    return tuple(found)


def _place(block: Mjcf | Lab) -> tuple[str, int]:
    """What a block is found by: it may be another object the next time."""
    return block.span.path, block.span.start


def _parts(course: Course, models: Mapping[str, CompileResult]) -> set[str | None]:
    """Names of the files in models/ that are there to be included by others."""
    included = {
        path for result in models.values() if result.facts for path in result.facts.includes
    }
    return {
        model.name
        for model in course.models
        if model.source.path in included or _PART.match(model.source.text)
    }


def _line(code: Excerpt, line: int | None, before: int, otherwise: Span) -> Span:
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
        span = _line(text.code, result.line, text.lines_before, block.span.first_line())
        what = "the lab's `xml`" if isinstance(block, Lab) else "this block"
        whole = isinstance(block, Lab) or block.fragment is not None or "<mujoco" in text.text
        help = "" if whole else 'if it is a part of a model say so: `fragment="worldbody"`'
        message = f"{what} does not compile: {readable(result.error)}"
        yield diagnose("mjcf-error", span, message, help=help)


def _folded(text: str) -> str:
    return " ".join(text.split())


def _check_names(lab: Lab, facts: ModelFacts) -> Iterator[Diagnostic]:
    span = lab.key_span or lab.span.first_line()
    if isinstance(lab.key, int) and not 0 <= lab.key < len(facts.keyframes):
        have = f"it has {len(facts.keyframes)}" if facts.keyframes else "it has none"
        yield diagnose(
            "lab-name", span, f"the model has no keyframe {lab.key}: {have}, counted from 0"
        )
    names = [name for name in facts.keyframes if name]
    if isinstance(lab.key, str) and lab.key not in names:
        yield diagnose(
            "lab-name",
            span,
            f"the model has no keyframe `{lab.key}`",
            help=did_you_mean(lab.key, names),
        )
    if lab.trail is not None and lab.trail not in facts.sites:
        yield diagnose(
            "lab-name",
            lab.trail_span or lab.span.first_line(),
            f"the model has no site `{lab.trail}`",
            help=did_you_mean(lab.trail, facts.sites),
        )
