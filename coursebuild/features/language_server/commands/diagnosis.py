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

from coursebuild.core.scripts.bindings import PrintedOutputs
from coursebuild.core.scripts.findings import output_findings
from coursebuild.core.text.diagnostics import Diagnostic, Note
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
    return _diagnoses(session, session.version)


@lru_cache(maxsize=1)
def _diagnoses(session: Session, version: int) -> tuple[Diagnostic, ...]:
    """Remembered: an editor asks for it with each move of its cursor."""
    with session.changed:
        course, library, verified = session.course, session.library, session.verified
        found, last = session.found_by_reading, session.found_by_running
    if course is not None and library is not None and verified is not None:
        now, then = ({s.path: s for s in one.sources} for one in (course, verified))
        changed = {path for path, source in now.items() if source != then.get(path)}
        if changed:
            last = tuple(d for d in last if d.span.path not in changed or d.rule not in _COMPARED)
            printed = PrintedOutputs(
                library.results.verdicts, library.results.runs, library.scripts
            )
            edited = [one for one in course.owned_documents if one[1].source.path in changed]
            found += tuple(output_findings(course, edited, printed))
        found += tuple(d for one in last if (d := _moved(one, now)) is not None)
    return judge(course, found).diagnostics


# --- what is known of a text as it was


def _moved(diagnostic: Diagnostic, now: dict[str, Source]) -> Diagnostic | None:
    """A diagnostic where its lines stand now; `None` where they are others."""
    span = _moved_span(diagnostic.span, now)
    if span is None:
        return None
    notes = [Note(one.message, one.span and _moved_span(one.span, now)) for one in diagnostic.notes]
    edits = diagnostic.edits if span is diagnostic.span else ()
    return replace(diagnostic, span=span, notes=tuple(notes), edits=edits)


def _moved_span(span: Span, now: dict[str, Source]) -> Span | None:
    source = now.get(span.path, span.source)
    if source == span.source:
        return span
    known = _moves(span.source, source)
    moves = {known.get(line) for line in range(span.line, span.end_line + 1)}
    by = moves.pop() if len(moves) == 1 else None
    if by is None:
        return None
    starts = source.line_starts[span.line + by - 1], source.line_starts[span.end_line + by - 1]
    return Span(source, starts[0] + span.column - 1, starts[1] + span.end_column - 1)


@lru_cache(maxsize=16)
def _moves(old: Source, new: Source) -> dict[int, int]:
    """The lines of a text that another has as well, and how far down they are there."""
    lines, new_lines = (
        [source.line_text(number + 1) for number in range(len(source.line_starts))]
        for source in (old, new)
    )
    same = SequenceMatcher(None, lines, new_lines).get_matching_blocks()
    return {one.a + n: one.b - one.a for one in same for n in range(1, one.size + 1)}


# --- for a client


def published(diagnostic: Diagnostic, places: Places) -> types.Diagnostic:
    """A diagnostic with its notes, and where its rule is explained."""
    error = diagnostic.is_error
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
            types.DiagnosticRelatedInformation(places.location(note.span), note.message)
            for note in diagnostic.notes
            if note.span is not None
        ],
    )
