"""Edits that are offered at a place.

Entry point: `actions`: what diagnostics propose; "accept this output", as the preview offers it;
"bind this number", where a number in the text is one that the script above it printed.
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
from coursebuild.features.language_server.commands.diagnosis import diagnoses, published
from coursebuild.features.language_server.commands.places import Places
from coursebuild.features.language_server.commands.texts import OpenTexts
from coursebuild.preview.messages import new_output


def actions(
    texts: OpenTexts, source: Source, asked: types.CodeActionParams
) -> list[types.CodeAction]:
    """What is offered for a stretch of a text."""
    place = source.span(
        *(texts.places.offset(source, at) for at in (asked.range.start, asked.range.end))
    )
    found = [one for one in diagnoses(texts.session) if one.span.source == place.source]
    offered = [
        _action(texts.places, one.help or f"write `{one.edits[0].text}`", one.edits, [one])
        for one in found
        if one.edits and _meet(one.span, place)
    ]
    return [*offered, *_outputs(texts, place, found), *_numbers(texts, place)]


def _action(
    places: Places, title: str, edits: Iterable[Edit], mended: Iterable[Diagnostic] = ()
) -> types.CodeAction:
    """`mended` is what is no longer wrong then."""
    diagnostics = [published(one, places) for one in mended]
    kinds = types.CodeActionKind
    return types.CodeAction(
        title[:1].upper() + title[1:],
        kinds.QuickFix if diagnostics else kinds.RefactorRewrite,
        diagnostics,
        edit=types.WorkspaceEdit(places.changes(edits)),
    )


def _meet(one: Span, other: Span) -> bool:
    return one.start <= other.end and other.start <= one.end


def _outputs(texts: OpenTexts, place: Span, found: list[Diagnostic]) -> Iterator[types.CodeAction]:
    library = texts.library
    for verdict in library.results.verdicts:
        span = verdict.recording.span
        if verdict.status == "drift" and span.source == place.source and _meet(span, place):
            edit = new_output(texts.session, library, verdict)
            if isinstance(edit, Edit):
                mended = [d for d in found if d.rule == "output-drift" and span.contains(d.span)]
                title = f"accept what `{verdict.recording.script}` prints"
                yield _action(texts.places, title, [edit], mended)


def _numbers(texts: OpenTexts, place: Span) -> Iterator[types.CodeAction]:
    library, document = texts.library, texts.document(place.source)
    verdicts = library.results.verdicts
    printed = PrintedOutputs(verdicts, library.results.runs, library.scripts)
    recorded = [v.recording.span for v in verdicts if v.recording.span.source == place.source]
    for inline in () if document is None else document_inlines(document):
        if not _meet(inline.span, place) or any(_meet(output, inline.span) for output in recorded):
            continue
        found: list[tuple[str, Span, str]] = []
        if isinstance(inline, CodeSpan):
            found = [(inline.text, inline.span, inline.span.text)]
        elif isinstance(inline, Text):
            for number in scan_prose(inline.span.text):
                start, end = inline.span.start + number.start, inline.span.start + number.end
                found.append((number.text, Span(place.source, start, end), f"`{number.text}`"))
        for text, span, code in found:
            shown, binding = BoundText.of(text), NumberBinding(span, text, span, None)
            above = printed.of_binding(binding) if shown.numbers and _meet(span, place) else []
            if any(shown.is_in(printed.lines(verdict)) for verdict in above):
                title = f"bind `{text}` to what `{above[0].recording.script}` prints"
                yield _action(texts.places, title, [Edit(span, f"{code}{{out}}")])
