"""The edits that are offered at a place of a text.

Entry point: `actions`. There are three kinds: the edits that diagnostics propose; "accept this
output", as in the preview; "bind this number", for a number that the script above it printed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from lsprotocol import types

from coursebuild.core.model import CodeSpan, NumberBinding, Text, document_inlines
from coursebuild.core.scripts.bindings import PrintedOutputs
from coursebuild.core.scripts.bound_numbers import BoundText
from coursebuild.core.scripts.numbers import scan_prose
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from coursebuild.core.text.source import Source, Span
from coursebuild.features.language_server.commands.diagnosis import current_diagnostics, to_lsp
from coursebuild.features.language_server.commands.places import Places
from coursebuild.features.language_server.commands.texts import OpenTexts
from coursebuild.preview.messages import new_output


def actions(
    texts: OpenTexts, source: Source, params: types.CodeActionParams
) -> list[types.CodeAction]:
    """Return the edits that are offered for a range of a text."""
    place = source.span(
        *(texts.places.offset(source, at) for at in (params.range.start, params.range.end))
    )
    diagnostics = [d for d in current_diagnostics(texts.session) if d.span.source == place.source]
    fixes = [
        _make_action(texts.places, d.help or f"write `{d.edits[0].text}`", d.edits, [d])
        for d in diagnostics
        if d.edits and _overlap(d.span, place)
    ]
    return [*fixes, *_accept_outputs(texts, place, diagnostics), *_bind_numbers(texts, place)]


def _make_action(
    places: Places, title: str, edits: Iterable[Edit], solved: Iterable[Diagnostic] = ()
) -> types.CodeAction:
    """Return an action of these edits; `solved` are the diagnostics that they remove."""
    diagnostics = [to_lsp(diagnostic, places) for diagnostic in solved]
    kinds = types.CodeActionKind
    return types.CodeAction(
        title[:1].upper() + title[1:],
        kinds.QuickFix if diagnostics else kinds.RefactorRewrite,
        diagnostics,
        edit=types.WorkspaceEdit(places.changes(edits)),
    )


def _overlap(first: Span, second: Span) -> bool:
    return first.start <= second.end and second.start <= first.end


def _accept_outputs(
    texts: OpenTexts, place: Span, diagnostics: Iterable[Diagnostic]
) -> Iterator[types.CodeAction]:
    """Yield the actions that replace recorded outputs here by what was printed."""
    library = texts.library
    for verdict in library.results.verdicts:
        span = verdict.recording.span
        if verdict.status == "drift" and span.source == place.source and _overlap(span, place):
            edit = new_output(texts.session, library, verdict)
            if isinstance(edit, Edit):
                drifts = (d for d in diagnostics if d.rule == "output-drift")
                solved = [d for d in drifts if span.contains(d.span)]
                title = f"accept what `{verdict.recording.script}` prints"
                yield _make_action(texts.places, title, [edit], solved)


def _bind_numbers(texts: OpenTexts, place: Span) -> Iterator[types.CodeAction]:
    """Yield the actions that bind numbers here to what a script above them printed."""
    library, document = texts.library, texts.document(place.source)
    verdicts = library.results.verdicts
    printed = PrintedOutputs(verdicts, library.results.runs, library.scripts)
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
            shown_text, binding = BoundText.of(text), NumberBinding(span, text, span, None)
            sources = (
                printed.of_binding(binding) if shown_text.numbers and _overlap(span, place) else []
            )
            if any(shown_text.is_in(printed.lines(verdict)) for verdict in sources):
                title = f"bind `{text}` to what `{sources[0].recording.script}` prints"
                yield _make_action(texts.places, title, [Edit(span, f"{code}{{out}}")])
