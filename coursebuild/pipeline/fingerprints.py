"""Fingerprints of what other pages can see of a document, a course or its results.

Entry points: `document_fingerprint` and `notes_fingerprint`, `course_fingerprint`,
`results_fingerprint`; each returns a hash.

A sentence added to a document moves all that follows it, but other pages do not show where in a
file something stands. So a value is hashed without its spans, and with the text of its excerpts.
Where its hash is unchanged, so is whatever other pages made from it, and a course in which nothing
was wrong is still free of mistakes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from msgspec import Struct
from msgspec.structs import asdict, replace

from coursebuild.core.engine.tool import tool_digest
from coursebuild.core.model import (
    Course,
    Document,
    HtmlBlock,
    RawInline,
    block_inlines,
    document_blocks,
    walk_inlines,
)
from coursebuild.core.model.results import Reports, Results
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.core.values import fingerprint

_WITHOUT_PLACES: dict[type, Callable[[Any], object]] = {
    Span: lambda span: None,
    Excerpt: lambda excerpt: excerpt.text,
    Source: lambda source: (source.path, source.text),
}
"""What is hashed in the place of values that hold a place in a file."""


def document_fingerprint(document: Document) -> str:
    """The fingerprint of a document's summary, without what features note of it."""
    html = tuple(_raw_html(document))
    return fingerprint(
        (document.blocks, document.footnotes, document.equations, html), _WITHOUT_PLACES
    )


def notes_fingerprint(notes: Mapping[str, Struct]) -> str:
    """The fingerprint of what features note of a document (`Feature.summary`)."""
    return fingerprint(dict(notes), _WITHOUT_PLACES)


def _raw_html(document: Document) -> Iterator[str]:
    """The raw HTML of a document, in which links are looked for: only its span has the text."""
    for block in document_blocks(document):
        if isinstance(block, HtmlBlock):
            yield block.span.text
        for inline in walk_inlines(block_inlines(block)):
            if isinstance(inline, RawInline):
                yield inline.span.text


def course_fingerprint(course: Course, documents: Iterable[tuple[Document, str]]) -> str | None:
    """The fingerprint of a course, from its documents'; `None` where one of these is missing."""
    fingerprints = {id(document): hashed for document, hashed in documents}
    if not all(fingerprints.get(id(document)) for document in course.documents):
        return None

    def replace_document(document: Document) -> object:
        return document.source.path, fingerprints[id(document)]

    return fingerprint((tool_digest(), course), {**_WITHOUT_PLACES, Document: replace_document})


def results_fingerprint(results: Results, reports: Reports) -> str:
    """The fingerprint of results, without what no page shows, such as times.

    Only what is left out is named here: a new field counts.
    """
    runs = tuple(
        replace(run, stderr="", seconds=0.0, cached=False, trace=None) for run in results.runs
    )
    verdicts = tuple(
        asdict(verdict) | {"recording": (verdict.recording.span.path, verdict.recording.script)}
        for verdict in results.verdicts
    )
    trials = tuple(
        (
            t.span.path,
            replace(t, line=replace(t.line, seconds=0.0, steps_per_second=None, cached=False)),
        )
        for t in results.trials
    )
    parts = asdict(results) | {"runs": runs, "verdicts": verdicts, "trials": trials}
    return fingerprint((tool_digest(), parts, reports), _WITHOUT_PLACES)
