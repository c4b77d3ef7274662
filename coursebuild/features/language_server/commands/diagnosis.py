"""The diagnostics of a course while its texts are edited, and the edits that are offered.

Recorded outputs and bound numbers of a changed text are compared with what the scripts printed when
they last ran. All other diagnostics of the last run are about the texts as they were then. They are
shown at lines that are still the same, wherever these stand now.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from difflib import SequenceMatcher
from functools import lru_cache

from lsprotocol import types
from msgspec.structs import replace

from coursebuild.api import Diagnostic, Edit, Note, Source, Span
from coursebuild.core.model import CodeSpan, NumberBinding, Text, document_inlines
from coursebuild.core.scripts.bound_places import BoundNumber
from coursebuild.core.scripts.findings import output_findings
from coursebuild.core.text.numbers import scan_prose
from coursebuild.core.text.rules import Severity, rule_address
from coursebuild.features.language_server.commands.texts import OpenTexts, Places
from coursebuild.pipeline.check import judge
from coursebuild.pipeline.fix import choose_fixes, ways
from coursebuild.preview.messages import changes_of, new_output, printed_outputs
from coursebuild.preview.session import Session
from coursebuild.report.values import with_hints

_COMPARISON_RULES = (
    *("output-drift", "script-silent"),
    *("binding-mismatch", "binding-orphan", "binding-volatile", "output-ambiguous"),
)
"""The rules that are checked by a comparison alone, without a run."""


def current_diagnostics(session: Session) -> tuple[Diagnostic, ...]:
    """Return all diagnostics that are not silenced, for the texts as they are."""
    with session.condition:  # while it is held, the course may be newer than the version
        version = session.version
    return _diagnose(session, version)


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
            printed = printed_outputs(library)
            changed_documents = [
                (id, document)
                for id, document in course.shown_texts
                if document.source.path in changed_paths
            ]
            addresses = dict(session.runs.addresses)
            diagnostics += tuple(output_findings(course, changed_documents, printed, addresses))
        for diagnostic in last_run:
            span = _move_span(diagnostic.span, sources)
            if span is None:  # its lines have changed
                continue
            is_same = span is diagnostic.span
            notes = tuple(
                Note(
                    note.message,
                    note.span and _move_span(note.span, sources),
                    note.edits if is_same else (),
                )
                for note in diagnostic.notes
            )
            edits = diagnostic.edits if is_same else ()
            diagnostics += (replace(diagnostic, span=span, notes=notes, edits=edits),)
    return with_hints(judge(course, diagnostics))


# --- diagnostics of a text as it was


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


_SEVERITIES: dict[Severity, types.DiagnosticSeverity] = {
    "error": types.DiagnosticSeverity.Error,
    "warning": types.DiagnosticSeverity.Warning,
    "hint": types.DiagnosticSeverity.Hint,
}


def to_lsp(diagnostic: Diagnostic, places: Places) -> types.Diagnostic:
    """Return a diagnostic as the client reads it, with its notes and a link to its rule."""
    lines = [diagnostic.message, diagnostic.label, diagnostic.help and f"help: {diagnostic.help}"]
    lines += [f"note: {note.message}" for note in diagnostic.notes if note.span is None]
    address = rule_address(diagnostic.rule)
    return types.Diagnostic(
        places.range(diagnostic.span),
        "\n".join(filter(None, lines)),
        severity=_SEVERITIES[diagnostic.severity],
        code=diagnostic.rule,
        code_description=types.CodeDescription(address) if address else None,
        source="coursebuild",
        related_information=[
            types.DiagnosticRelatedInformation(places.location(note.span), note.message)
            for note in diagnostic.notes
            if note.span is not None
        ],
    )


def actions(
    texts: OpenTexts, source: Source, params: types.CodeActionParams
) -> list[types.CodeAction]:
    """Return the edits that are offered for a range of a text."""
    place = source.span(
        *(texts.places.offset(source, at) for at in (params.range.start, params.range.end))
    )
    diagnostics = [d for d in current_diagnostics(texts.session) if d.span.source == place.source]
    nearby = [d for d in diagnostics if _overlap(d.span, place)]
    actions = [
        _make_action(texts.places, way.help or f"write `{way.edits[0].text}`", way.edits, [d])
        for d in nearby
        for way in ways(d)
    ]
    fixable = (d for d in diagnostics if all(edit.span.source == place.source for edit in d.edits))
    if safe_fixes := choose_fixes(fixable):
        edits = [edit for diagnostic in safe_fixes for edit in diagnostic.edits]
        title = f"fix all in this file ({len(safe_fixes)})"
        fix_all = _make_action(texts.places, title, edits, safe_fixes)
        fix_all.kind = types.CodeActionKind.SourceFixAll
        actions.append(fix_all)
    for verdict in texts.library.results.verdicts:
        span = verdict.recording.span
        if verdict.status == "drift" and span.source == place.source and _overlap(span, place):
            course = texts.session.course
            assert course is not None  # it has been run
            new_edits = new_output(texts.session, texts.library, course, verdict)
            if isinstance(new_edits, tuple) and new_edits:
                drifts = (d for d in diagnostics if d.rule == "output-drift")
                solved = [d for d in drifts if span.contains(d.span)]
                title = f"accept what `{verdict.recording.script}` prints"
                action = _make_action(texts.places, title, new_edits, solved)
                texts_there = {edit.span.path for edit in new_edits}
                changes = changes_of(texts.session, new_edits)
                records = [change for change in changes if change.path not in texts_there]
                action.edit = texts.places.change_files(new_edits, records)
                actions.append(action)
    actions += _bind_numbers(texts, place)
    asked_kinds = tuple(str(getattr(kind, "value", kind)) for kind in params.context.only or ("",))
    kinds = [str(getattr(action.kind, "value", action.kind)) for action in actions]
    return [
        action
        for action, kind in zip(actions, kinds, strict=True)
        if any(not name or f"{kind}.".startswith(f"{name}.") for name in asked_kinds)
    ]


def _make_action(
    places: Places, title: str, edits: Iterable[Edit], solved: Sequence[Diagnostic] = ()
) -> types.CodeAction:
    """Return an action of these edits; `solved` are the diagnostics that they remove."""
    diagnostics = [to_lsp(diagnostic, places) for diagnostic in solved]
    kinds = types.CodeActionKind
    return types.CodeAction(
        title[:1].upper() + title[1:],
        kinds.QuickFix if diagnostics else kinds.RefactorRewrite,
        diagnostics,
        is_preferred=solved[0].safe if len(solved) == 1 else None,
        edit=types.WorkspaceEdit(places.changes(edits)),
    )


def _overlap(first: Span, second: Span) -> bool:
    return first.start <= second.end and second.start <= first.end


def _bind_numbers(texts: OpenTexts, place: Span) -> Iterator[types.CodeAction]:
    library, document = texts.library, texts.document(place.source)
    verdicts, printed = library.results.verdicts, printed_outputs(library)
    outputs = [v.recording.span for v in verdicts if v.recording.span.source == place.source]
    for inline in () if document is None else document_inlines(document):
        is_output = any(_overlap(output, inline.span) for output in outputs)
        if is_output or not _overlap(inline.span, place):
            continue
        candidates: list[tuple[str, Span, str]] = []
        if isinstance(inline, CodeSpan):
            candidates = [(inline.text, inline.span, inline.span.text)]
        elif isinstance(inline, Text):
            for number in scan_prose(inline.span.text):
                start, end = inline.span.start + number.start, inline.span.start + number.end
                candidates.append((number.text, Span(place.source, start, end), f"`{number.text}`"))
        for text, span, code in candidates:
            binding = NumberBinding(span, text, span, None)
            shown_text = BoundNumber(binding, printed).text
            sources = (
                printed.of_binding(binding) if shown_text.numbers and _overlap(span, place) else []
            )
            if any(shown_text.is_in([printed.text(verdict)]) for verdict in sources):
                title = f"bind `{text}` to what `{sources[0].recording.script}` prints"
                yield _make_action(texts.places, title, [Edit(span, f"{code}{{out}}")])
