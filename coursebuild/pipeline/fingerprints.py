"""What of a document, a course or its results can be seen from elsewhere, without its places.

Entry points: `document_fingerprint` and `notes_fingerprint`, `course_fingerprint`,
`results_fingerprint`; each is a hash.

A sentence that is added moves all that follows it, and nothing else in the course: no page but the
document's own shows where in its file something stands. So a value is hashed with its spans left
out, and with the text of its excerpts; where the hash is that of before, whatever was made from it
for other pages is that of before, and where nothing was found wrong nothing is wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

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
from coursebuild.core.model.results import Results
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.core.values import fingerprint
from coursebuild.numerics.reports import Reports

_SHOWN: dict[type, Callable[[Any], object]] = {
    Span: lambda span: None,
    Excerpt: lambda excerpt: excerpt.text,
    Source: lambda source: (source.path, source.text),
}
"""What can be seen of places from elsewhere."""


def document_fingerprint(document: Document) -> str:
    """That of a document, by its summary; without what features note of it."""
    raw = tuple(_raw(document))
    return fingerprint((document.blocks, document.footnotes, document.equations, raw), _SHOWN)


def notes_fingerprint(notes: Mapping[str, Struct]) -> str:
    """That of what features note of a document (`Feature.summary`)."""
    return fingerprint(dict(notes), _SHOWN)


def _raw(document: Document) -> Iterator[str]:
    """HTML as its author wrote it, in which links are looked for: its span is where the text is."""
    for block in document_blocks(document):
        if isinstance(block, HtmlBlock):
            yield block.span.text
        for inline in walk_inlines(block_inlines(block)):
            if isinstance(inline, RawInline):
                yield inline.span.text


def course_fingerprint(course: Course, documents: Iterable[tuple[Document, str]]) -> str | None:
    """That of a course, given those of its documents; `None` where one of them is missing."""
    known = {id(document): found for document, found in documents}
    if not all(known.get(id(document)) for document in course.documents):
        return None

    def shown(document: Document) -> object:
        return document.source.path, known[id(document)]

    return fingerprint((tool_digest(), course), {**_SHOWN, Document: shown})


def results_fingerprint(results: Results, reports: Reports) -> str:
    """That of what was found, without how long it took and what nothing is made from."""
    runs = tuple((r.path, r.outcome, r.status, r.stdout, r.missing) for r in results.runs)
    verdicts = tuple(
        (v.recording.span.path, v.recording.script, v.status, v.comparison)
        for v in results.verdicts
    )
    trials = tuple(
        (t.span.path, replace(t.line, seconds=0.0, steps_per_second=None, cached=False), t.output)
        for t in results.trials
    )
    rest = results.formulas, results.models, results.python, results.engine
    return fingerprint((tool_digest(), runs, verdicts, trials, rest, reports), _SHOWN)
