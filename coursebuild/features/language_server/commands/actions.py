"""Edits that are offered at a place.

Entry point: `actions`: what diagnostics propose; "accept this output", as the preview offers it;
"bind this number", where a number in the text is one that the script above it printed.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from coursebuild.core.model import CodeSpan, NumberBinding, Text, document_inlines
from coursebuild.core.scripts.bindings import Printed
from coursebuild.core.scripts.bound_numbers import Shown
from coursebuild.core.scripts.numbers import scan_prose
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from coursebuild.core.text.source import Span
from coursebuild.features.language_server.commands.diagnosis import diagnoses
from coursebuild.features.language_server.commands.texts import OpenTexts
from coursebuild.preview.messages import new_output


class Action(Struct, frozen=True):
    """What an author may have done."""

    title: str
    edits: tuple[Edit, ...]
    mends: tuple[Diagnostic, ...] = ()
    """What is no longer wrong then."""


def actions(texts: OpenTexts, place: Span) -> Iterator[Action]:
    """What is offered for a stretch of a text."""
    found = [one for one in diagnoses(texts.session) if one.span.source == place.source]
    for one in found:
        if one.edits and _meet(one.span, place):
            title = one.help or f"write `{one.edits[0].text}`"
            yield Action(title[:1].upper() + title[1:], one.edits, (one,))
    yield from _outputs(texts, place, found)
    yield from _numbers(texts, place)


def _meet(one: Span, other: Span) -> bool:
    return one.start <= other.end and other.start <= one.end


def _outputs(texts: OpenTexts, place: Span, found: list[Diagnostic]) -> Iterator[Action]:
    library = texts.library
    for verdict in () if library is None else library.results.verdicts:
        span = verdict.recording.span
        if verdict.status != "drift" or span.source != place.source or not _meet(span, place):
            continue
        assert library is not None
        run = library.runs[verdict.recording.script or ""]
        edit = new_output(texts.session, library.course, verdict, run)
        if isinstance(edit, Edit):
            mends = tuple(d for d in found if d.rule == "output-drift" and span.contains(d.span))
            yield Action(f"Accept what `{run.path}` prints", (edit,), mends)


def _numbers(texts: OpenTexts, place: Span) -> Iterator[Action]:
    library, document = texts.library, texts.document(place.source)
    if library is None or document is None:
        return
    verdicts = library.results.verdicts
    printed = Printed(verdicts, library.results.runs, library.scripts)
    recorded = [one.recording.span for one in verdicts if one.recording.span.source == place.source]
    for inline in document_inlines(document):
        span = inline.span
        if not _meet(span, place) or any(output.contains(span) for output in recorded):
            continue
        if isinstance(inline, CodeSpan):
            yield from _bound(printed, span, inline.text, (span.end, span.end), "{out}")
        for number in scan_prose(span.text) if isinstance(inline, Text) else ():
            at = span.start + number.start, span.start + number.end
            if _meet(Span(span.source, *at), place):
                yield from _bound(printed, span, number.text, at, f"`{number.text}`{{out}}")


def _bound(
    printed: Printed, span: Span, text: str, at: tuple[int, int], written: str
) -> Iterator[Action]:
    shown, binding = Shown.of(text), NumberBinding(span, text, span, None)
    verdicts = printed.recorded(binding) if shown.numbers else []
    if any(shown.is_in(printed.lines(verdict)) for verdict in verdicts):
        title = f"Bind `{text}` to what `{verdicts[0].recording.script}` prints"
        yield Action(title, (Edit(Span(span.source, *at), written),))
