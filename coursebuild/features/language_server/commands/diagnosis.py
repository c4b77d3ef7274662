"""What is wrong in a course whose texts are being written.

Entry points: `diagnoses(session)`; `published`, a diagnostic as a client has it.

1. What reading and checking finds is found anew at each change.
2. Recorded outputs and bound numbers of a text that has changed since are compared with what
   scripts printed when they last ran.
3. All else that running the course found is about the texts as they were then. It is said of the
   lines that are still the same, wherever they stand now.
"""

from __future__ import annotations

from difflib import SequenceMatcher
from functools import lru_cache

from lsprotocol import types
from msgspec.structs import replace

from coursebuild.core.model import Course
from coursebuild.core.scripts.findings import script_findings
from coursebuild.core.text.diagnostics import Diagnostic, Edit, Note, Severity
from coursebuild.core.text.rules import HELP
from coursebuild.core.text.source import Source, Span
from coursebuild.features.language_server.commands.places import Places
from coursebuild.pipeline.judge import judge
from coursebuild.preview.session import Session

_COMPARED = (
    *("output-drift", "script-silent"),
    *("binding-mismatch", "binding-orphan", "binding-volatile"),
)
"""Rules of what is compared without running anything."""


def diagnoses(session: Session) -> tuple[Diagnostic, ...]:
    """All that is wrong and not silenced, in the texts as they are."""
    with session.changed:
        course, library, verified = session.course, session.library, session.verified
        found, last = session.found_by_reading, session.found_by_running
    if course is not None and library is not None and verified is not None:
        now, then = _sources(course), _sources(verified)
        changed = {path for path, source in now.items() if source != then.get(path)}
        if changed:
            last = tuple(d for d in last if d.span.path not in changed or d.rule not in _COMPARED)
            runs, verdicts = library.results.runs, library.results.verdicts
            compared = script_findings(course, (), runs, verdicts)
            found += tuple(d for d in compared if d.span.path in changed)
        found += tuple(d for one in last if (d := _moved(one, now)) is not None)
    return judge(course, found).diagnostics


def _sources(course: Course) -> dict[str, Source]:
    sources = [course.map, *(document.source for document in course.documents)]
    sources += [model.source for model in course.models]
    sources += [declared.source for declared in course.declarations]
    return {source.path: source for source in sources}


# --- what is known of a text as it was


def _moved(diagnostic: Diagnostic, now: dict[str, Source]) -> Diagnostic | None:
    """A diagnostic where its lines stand now; `None` where they are others."""
    span = _moved_span(diagnostic.span, now)
    if span is None or span is diagnostic.span:
        return diagnostic if span is not None else None
    notes = [Note(one.message, one.span and _moved_span(one.span, now)) for one in diagnostic.notes]
    edits = [(_moved_span(edit.span, now), edit.text) for edit in diagnostic.edits]
    kept = tuple(Edit(place, text) for place, text in edits if place is not None)
    whole = kept if len(kept) == len(edits) else ()
    return replace(diagnostic, span=span, notes=tuple(notes), edits=whole)


def _moved_span(span: Span, now: dict[str, Source]) -> Span | None:
    source = now.get(span.path, span.source)
    if source == span.source:
        return span
    for start, new_start, length in _same_lines(span.source, source):
        if start <= span.start and span.end <= start + length:
            return Span(source, span.start - start + new_start, span.end - start + new_start)
    return None


@lru_cache(maxsize=16)
def _same_lines(old: Source, new: Source) -> tuple[tuple[int, int, int], ...]:
    """Stretches of lines that both have: offsets in the one and the other, and their length."""
    lines, new_lines = (
        [source.text[a:b] for a, b in zip(source.line_starts, _ends(source), strict=True)]
        for source in (old, new)
    )
    starts, new_starts = [*old.line_starts, len(old.text)], [*new.line_starts, len(new.text)]
    return tuple(
        (starts[one.a], new_starts[one.b], starts[one.a + one.size] - starts[one.a])
        for one in SequenceMatcher(None, lines, new_lines, autojunk=False).get_matching_blocks()
    )


def _ends(source: Source) -> list[int]:
    return [*source.line_starts[1:], len(source.text)]


# --- for a client


def published(diagnostic: Diagnostic, places: Places) -> types.Diagnostic:
    """A diagnostic with its notes, and where its rule is explained."""
    error = diagnostic.severity is Severity.ERROR
    said = [diagnostic.message, diagnostic.label, diagnostic.help and f"help: {diagnostic.help}"]
    said += [f"note: {note.message}" for note in diagnostic.notes if note.span is None]
    return types.Diagnostic(
        places.range(diagnostic.span),
        "\n".join(filter(None, said)),
        severity=types.DiagnosticSeverity.Error if error else types.DiagnosticSeverity.Warning,
        code=diagnostic.rule,
        code_description=types.CodeDescription(HELP.format(diagnostic.rule)),
        source="coursebuild",
        related_information=[
            _related(note, note.span, places) for note in diagnostic.notes if note.span
        ],
    )


def _related(note: Note, span: Span, places: Places) -> types.DiagnosticRelatedInformation:
    return types.DiagnosticRelatedInformation(places.location(span), note.message)
