"""Small lessons with recorded outputs, to compare and to update."""

from __future__ import annotations

from decimal import Decimal

from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.course import ENGLISH
from coursebuild.core.model.results import Change, DriftKind, Outcome, ScriptRun, Verdict
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import apply_edits, update_body
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from coursebuild.core.text.source import Source, Span
from support.made_courses import LESSON, with_documents

EXACT = model.Comparison()
DIGITS = model.Comparison(model.Mode.DIGITS)
VOLATILE = model.Comparison(model.Mode.VOLATILE)
ELLIPSIS = model.Comparison(ellipsis=True)
DIGITS_ELLIPSIS = model.Comparison(model.Mode.DIGITS, ellipsis=True)


def tolerance(rtol: str = "0", atol: str = "0") -> model.Comparison:
    return model.Comparison(model.Mode.TOLERANCE, Decimal(rtol), Decimal(atol))


# --- lessons


def document(
    text: str, path: str = "content/lessons/4.2-mass.md", words: model.Words = ENGLISH
) -> model.Document:
    return parse_document(Source(path, text), frozenset(), lesson=True, words=words).value


def recordings(document: model.Document) -> tuple[model.Recording, ...]:
    return tuple(model.find_blocks(document, model.Recording))


def recording(
    body: str, *, prefix: str = "", eol: str = "\n", fence: str = "```"
) -> model.Recording:
    """A lesson with one script and one recorded fence, its lines after `prefix`, ended by `eol`."""
    lines = ["```python file=examples/a.py", "print(1)", "```", "Output:", "", f"{fence}text"]
    lines += [*(body.split("\n") if body else ()), fence, "After.", ""]
    text = eol.join((prefix + line) if line else prefix.rstrip() for line in lines)
    return recordings(document(text))[0]


def table(rows: str, words: model.Words = ENGLISH) -> model.Recording:
    text = f"```python file=examples/a.py\nprint(1)\n```\n\nOutput:\n\n{rows}\n\nAfter.\n"
    return recordings(document(text, words=words))[0]


def course(
    *documents: model.Document,
    comparison: model.Comparison = EXACT,
    filters: tuple[model.Filter, ...] = (),
) -> model.Course:
    """A course of these lessons; ids are taken from the file names."""
    text = '[course]\ntitle = "T"\n[[level]]\nid = "1"\ntitle = "One"\n'
    for document in documents:
        id, _, slug = document.source.path.rpartition("/")[2].removesuffix(".md").partition("-")
        text += LESSON.format(id, slug, "complete")
    course_map = parse_course_map(Source("content/course.toml", text)).value
    assert course_map is not None
    pairs = zip(course_map.lessons, documents, strict=True)
    filled = with_documents(course_map, {lesson.id: document for lesson, document in pairs})
    return replace(filled, comparison=comparison, filters=filters)


def make_run(
    stdout: str = "",
    *,
    path: str = "examples/a.py",
    outcome: Outcome = Outcome.OK,
    status: int = 0,
    stderr: str = "",
) -> ScriptRun:
    return ScriptRun(path, outcome, status, stdout, stderr, 0.1)


def describe(diagnostic: Diagnostic) -> str:
    def place(span: Span | None) -> str:
        return "" if span is None else f" at {span.line}:{span.column} `{span.first_line().text}`"

    lines = [f"{diagnostic.rule}{place(diagnostic.span)}", f"  {diagnostic.message}"]
    if diagnostic.label:
        lines.append(f"  ^ {diagnostic.label}")
    for note in diagnostic.notes:
        first, *rest = note.message.split("\n")
        lines += [f"  note{place(note.span)}: {first}", *(f"    {line}".rstrip() for line in rest)]
    if diagnostic.help:
        lines.append(f"  help: {diagnostic.help}")
    return "\n".join(lines)


# --- verdicts


def verdict(
    recorded: str,
    printed: str,
    comparison: model.Comparison = EXACT,
    filters: tuple[model.Filter, ...] = (),
    **lesson: str,
) -> Verdict:
    comparison = replace(comparison, course_filters=filters)
    return compare(recording(recorded, **lesson), comparison, printed)


def matches(recorded: str, printed: str, comparison: model.Comparison = EXACT) -> bool:
    result = verdict(recorded, printed, comparison)
    assert result.status in ("verified", "drift")
    assert bool(result.changes) == (result.status == "drift")
    return result.status == "verified"


def change_values(change: Change) -> tuple[str, str, str]:
    """Class, recorded text, printed text; the span must hold what it names."""
    if change.kind in (DriftKind.ROUNDING, DriftKind.NUMERIC, DriftKind.TEXT):
        assert change.span.text == change.recorded
    return change.kind.value, change.recorded, change.printed


# --- updates


def update(
    lesson: model.Recording,
    printed: str,
    comparison: model.Comparison = EXACT,
    filters: tuple[model.Filter, ...] = (),
) -> model.Recording:
    """The recording after its update; a second update has nothing to do."""
    comparison = replace(comparison, course_filters=filters)
    edit = update_body(lesson, comparison, printed)
    assert isinstance(edit, Edit), edit
    source = lesson.span.source
    text = apply_edits(source.text, [edit])
    assert text[: edit.span.start] == source.text[: edit.span.start]
    assert text[edit.span.start + len(edit.text) :] == source.text[edit.span.end :]
    (new,) = recordings(document(text, source.path))
    assert update_body(new, comparison, printed) is None
    assert compare(new, comparison, printed).status in ("verified", "volatile")
    return new


def body(
    recorded: str,
    printed: str,
    comparison: model.Comparison = EXACT,
    filters: tuple[model.Filter, ...] = (),
    **lesson: str,
) -> str:
    return update(recording(recorded, **lesson), printed, comparison, filters).body_span.text


def refusal_text(recorded: str, printed: str, comparison: model.Comparison = EXACT) -> str:
    refusal = update_body(recording(recorded), comparison, printed)
    assert isinstance(refusal, Diagnostic), refusal
    return describe(refusal)
