"""Recordings after their update."""

from __future__ import annotations

from coursebuild.core.model import Comparison, Filter, Recording
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import apply_edits, updated_body
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from support.sample_lessons import EXACT, document, recording, recordings, told


def edited(
    lesson: Recording,
    printed: str,
    comparison: Comparison = EXACT,
    filters: tuple[Filter, ...] = (),
    again: str | None = None,
) -> Recording:
    """The recording after its update; a second update has nothing to do."""
    edit = updated_body(lesson, comparison, filters, printed, printed if again is None else again)
    assert isinstance(edit, Edit), edit
    source = lesson.span.source
    text = apply_edits(source.text, [edit])
    assert text[: edit.span.start] == source.text[: edit.span.start]
    assert text[edit.span.start + len(edit.text) :] == source.text[edit.span.end :]
    (new,) = recordings(document(text, source.path, lesson.prefix))
    assert updated_body(new, comparison, filters, printed, printed) is None
    verdict = compare(new, comparison, filters, printed)
    assert verdict.status in ("verified", "volatile")
    return new


def body(
    recorded: str,
    printed: str,
    comparison: Comparison = EXACT,
    filters: tuple[Filter, ...] = (),
    **lesson: str,
) -> str:
    new = edited(recording(recorded, **lesson), printed, comparison, filters)
    start, end = new.body_span.start, new.body_span.end
    return new.span.source.text[start:end]


def refused(
    recorded: str,
    printed: str,
    comparison: Comparison = EXACT,
    again: str | None = None,
    **lesson: str,
) -> str:
    found = updated_body(
        recording(recorded, **lesson), comparison, (), printed, printed if again is None else again
    )
    assert isinstance(found, Diagnostic), found
    return told(found)
