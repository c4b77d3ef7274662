"""The diagnostics of a course while its texts are edited.

Entry points: `current_diagnostics`; `to_lsp`, which converts one for the client.

1. Reading and checking is repeated at each change.
2. Recorded outputs and bound numbers of a changed text are compared with what the scripts printed
   when they last ran.
3. All other diagnostics of the last run are about the texts as they were then. They are shown at
   lines that are still the same, wherever these stand now.
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

_COMPARISON_RULES = (
    *("output-drift", "script-silent"),
    *("binding-mismatch", "binding-orphan", "binding-volatile"),
)
"""The rules that are checked by a comparison alone, without a run."""


def current_diagnostics(session: Session) -> tuple[Diagnostic, ...]:
    """Return all diagnostics that are not silenced, for the texts as they are."""
    return _diagnose(session, session.version)


@lru_cache(maxsize=1)
def _diagnose(session: Session, version: int) -> tuple[Diagnostic, ...]:
    """Cached, since an editor asks with each move of its cursor."""
    with session.condition:
        course, library, verified = session.course, session.library, session.runs.course
        diagnostics, last_run = session.reading_diagnostics, session.runs.diagnostics
    if course is not None and library is not None and verified is not None:
        sources, old_sources = ({s.path: s for s in c.sources} for c in (course, verified))
        changed_paths = {path for path, s in sources.items() if s != old_sources.get(path)}
        if changed_paths:
            last_run = tuple(
                diagnostic
                for diagnostic in last_run
                if diagnostic.span.path not in changed_paths
                or diagnostic.rule not in _COMPARISON_RULES
            )
            printed = PrintedOutputs(
                library.results.verdicts, library.results.runs, library.scripts
            )
            changed_documents = [
                (owner, document)
                for owner, document in course.owned_documents
                if document.source.path in changed_paths
            ]
            diagnostics += tuple(output_findings(course, changed_documents, printed))
        at_new_lines = (_move_diagnostic(diagnostic, sources) for diagnostic in last_run)
        diagnostics += tuple(diagnostic for diagnostic in at_new_lines if diagnostic is not None)
    return judge(course, diagnostics).diagnostics


# --- diagnostics of a text as it was


def _move_diagnostic(diagnostic: Diagnostic, sources: dict[str, Source]) -> Diagnostic | None:
    """Return a diagnostic for the text as it is now; `None` where its lines have changed."""
    span = _move_span(diagnostic.span, sources)
    if span is None:
        return None
    notes = [
        Note(note.message, note.span and _move_span(note.span, sources))
        for note in diagnostic.notes
    ]
    edits = diagnostic.edits if span is diagnostic.span else ()
    return replace(diagnostic, span=span, notes=tuple(notes), edits=edits)


def _move_span(span: Span, sources: dict[str, Source]) -> Span | None:
    source = sources.get(span.path, span.source)
    if source == span.source:
        return span
    shifts_by_line = _line_shifts(span.source, source)
    shifts = {shifts_by_line.get(line) for line in range(span.line, span.end_line + 1)}
    shift = shifts.pop() if len(shifts) == 1 else None
    if shift is None:
        return None
    first_start = source.line_starts[span.line + shift - 1]
    last_start = source.line_starts[span.end_line + shift - 1]
    return Span(source, first_start + span.column - 1, last_start + span.end_column - 1)


@lru_cache(maxsize=16)
def _line_shifts(old: Source, new: Source) -> dict[int, int]:
    """Return by how many lines each line that both texts have has moved down, by its old number."""
    lines, new_lines = (
        [source.line_text(number + 1) for number in range(len(source.line_starts))]
        for source in (old, new)
    )
    blocks = SequenceMatcher(None, lines, new_lines).get_matching_blocks()
    return {block.a + n: block.b - block.a for block in blocks for n in range(1, block.size + 1)}


# --- for a client


def to_lsp(diagnostic: Diagnostic, places: Places) -> types.Diagnostic:
    """Return a diagnostic as the client reads it, with its notes and a link to its rule."""
    is_error = diagnostic.is_error
    lines = [diagnostic.message, diagnostic.label, diagnostic.help and f"help: {diagnostic.help}"]
    lines += [f"note: {note.message}" for note in diagnostic.notes if note.span is None]
    return types.Diagnostic(
        places.range(diagnostic.span),
        "\n".join(filter(None, lines)),
        severity=types.DiagnosticSeverity.Error if is_error else types.DiagnosticSeverity.Warning,
        code=diagnostic.rule,
        code_description=types.CodeDescription(HELP.format(diagnostic.rule)),
        source="coursebuild",
        related_information=[
            types.DiagnosticRelatedInformation(places.location(note.span), note.message)
            for note in diagnostic.notes
            if note.span is not None
        ],
    )
