"""What a `Reader` is asked for and what it answers, with keys and fingerprints.

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

from coursebuild.core.engine.tool import step_key, tool_digest
from coursebuild.core.model import (
    Course,
    Document,
    HtmlBlock,
    RawInline,
    document_blocks,
    document_inlines,
)
from coursebuild.core.model.course import Words
from coursebuild.core.model.results import Reports, Results
from coursebuild.core.pages.context import Mistakes, PageHead, PageInputs, PageRecord
from coursebuild.core.pages.renderer import Texts
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.core.values import decode, encode, fingerprint


class SourceText(Struct, frozen=True):
    """The text of a document, and how it is parsed."""

    source: Source
    callouts: frozenset[str]
    lesson: bool
    words: Words
    key: str
    """A hash of all that its summary depends on."""

    @classmethod
    def of(
        cls, source: Source, callouts: frozenset[str], *, lesson: bool, words: Words
    ) -> SourceText:
        """A text with its key."""
        key = step_key("summary", lesson, callouts, encode(words), source.path, source.digest)
        return cls(source, callouts, lesson, words, key)

    def parse(self) -> Parsed[Document]:
        """Return the document that the text holds, and what is wrong in it."""
        return parse_document(self.source, self.callouts, lesson=self.lesson, words=self.words)


class DocumentSummary(Struct, frozen=True):
    """What is known of a document beyond its own page, and what is wrong in it."""

    document: Document
    """Without its prose; see `core.model.walk`."""
    diagnostics: tuple[Diagnostic, ...]
    """With those of its formulas."""
    imports: tuple[tuple[str, tuple[str, ...]], ...]
    """Paths of scripts, each with the modules that it imports."""
    fingerprint: str
    """A hash of what other pages can see of it; see `document_fingerprint`."""
    notes_fingerprint: str
    """The same of what features note of it (`Feature.summary`)."""

    def to_bytes(self) -> bytes:
        """The summary as it is stored; each note is packed for itself."""
        notes = {name: encode(note) for name, note in (self.document.summaries or {}).items()}
        return encode((replace(self, document=replace(self.document, summaries=None)), notes))

    @classmethod
    def from_bytes(cls, data: bytes, source: Source) -> DocumentSummary | None:
        """The summary of a text that was stored; `None` where the data is damaged."""
        content = decode(data, tuple[DocumentSummary, dict[str, bytes]], source)
        if content is None:
            return None
        summary, notes = content
        document = replace(summary.document, summaries=_Notes(notes, source))
        return replace(summary, document=document)


class _Notes(Mapping[str, Struct]):
    """What features note of a document, decoded on demand: after an edit few notes are needed."""

    def __init__(self, encoded_notes: Mapping[str, bytes], source: Source) -> None:
        self._encoded_notes = encoded_notes
        self._source = source
        self._notes: dict[str, Struct] = {}

    def __getitem__(self, feature: str) -> Struct:
        if feature not in self._notes:
            note = decode(self._encoded_notes[feature], Struct, self._source)
            assert note is not None, "what was just encoded can be decoded"
            self._notes[feature] = note
        return self._notes[feature]

    def __iter__(self) -> Iterator[str]:
        return iter(self._encoded_notes)

    def __len__(self) -> int:
        return len(self._encoded_notes)


class PageRequest(Struct, frozen=True):
    """A page to be drawn."""

    inputs: PageInputs
    text: SourceText | None
    """The text of its document, if it has one."""
    language: str
    """Of the interface."""
    base_url: str
    templates: Texts
    """The course's own templates."""
    is_manual: bool
    """See `Course.is_manual`."""
    mistakes: Mistakes
    """Those of its document, where it is drawn all the same: in a preview."""
    key: str
    """The key under which it is stored: a hash of all the others, and of the tool."""

    @classmethod
    def of(
        cls,
        inputs: PageInputs,
        text: SourceText | None,
        language: str,
        base_url: str,
        templates: Texts,
        *,
        is_manual: bool = False,
        mistakes: Mistakes = (),
    ) -> PageRequest:
        """A request with its key."""
        text_key = "" if text is None else text.key
        parts = (language, base_url, templates, is_manual, mistakes, inputs, text_key)
        return cls(inputs, text, *parts[:5], step_key("page", *parts))


class DrawnPage(Struct, frozen=True):
    """A page as it is stored."""

    head: PageHead
    record: PageRecord
    """What the site must know of it."""
    notes: dict[str, bytes]
    """See `page_notes`."""
    body: bytes
    """UTF-8."""


# --- fingerprints

_WITHOUT_PLACES: dict[type, Callable[[Any], object]] = {
    Span: lambda span: None,
    Excerpt: lambda excerpt: excerpt.text,
    Source: lambda source: (source.path, source.text),
}
"""What is hashed in the place of values that hold a place in a file."""


def document_fingerprint(document: Document) -> str:
    """The fingerprint of a document's summary, without what features note of it."""
    # Links are looked for in raw HTML, too, whose span alone has the text.
    html = [node.span.text for node in document_blocks(document) if isinstance(node, HtmlBlock)]
    html += [n.span.text for n in document_inlines(document) if isinstance(n, RawInline)]
    return fingerprint(
        (document.blocks, document.footnotes, document.numbered_items, html), _WITHOUT_PLACES
    )


def notes_fingerprint(notes: Mapping[str, Struct]) -> str:
    """The fingerprint of what features note of a document (`Feature.summary`)."""
    return fingerprint(dict(notes), _WITHOUT_PLACES)


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
