"""The documents of a course from what is kept, and by work spread over the cores where it is not.

Entry point: `Documents`, a context manager and the `Parser` of a course, which gives summaries
(`document`) and draws pages (`draw`).

1. `ahead` is told which texts there are. The summaries of texts that were read before come from the
   store; the others are read, in copies of this process where there are many.
2. `draw` draws pages: each in the copy that has read its document, which has it still.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from itertools import chain, islice
from typing import TYPE_CHECKING, Self, TypeAlias, TypeVar

from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.tool import step_key
from coursebuild.core.model import Course, Declarations, Document
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.source import Source, key_of
from coursebuild.core.values import decode, encode
from coursebuild.pipeline.fingerprints import course_fingerprint
from coursebuild.pipeline.load import Parser
from coursebuild.pipeline.reading import (
    PAGES,
    SUMMARIES,
    DocumentSummary,
    DrawnPage,
    PageReader,
    PageRequest,
    SourceText,
    prepare_to_read,
)

if TYPE_CHECKING:
    from coursebuild.core.engine.workers import Workers
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.pages.page_inputs import PageInputs

Value = TypeVar("Value")
Stage: TypeAlias = Callable[[str], AbstractContextManager[None]]
Request: TypeAlias = SourceText | PageRequest


def _silent(name: str) -> AbstractContextManager[None]:
    return nullcontext()


_MAPS, _DECLARATIONS, _CHECKED = "maps", "declarations", "checked"
"""Kinds of entries in the store; the last says in what nothing was wrong."""
_MANY = 8
"""Texts or pages for which copies of this process are worth their start."""


class Documents(Parser):
    """Summaries of the documents of a course, and their pages."""

    def __init__(self, store: Memo, jobs: int, stage: Stage = _silent) -> None:
        """`jobs` copies of this process at most; `stage` is told when long work begins."""
        self._store = store
        self._stage = stage
        self._jobs = jobs
        self._texts: dict[str, SourceText] = {}
        self._summaries: dict[str, DocumentSummary] = {}
        self._fingerprints: tuple[Course, str | None, str | None] | None = None
        self._readers: dict[str, int] = {}
        """Which copy has read a text, by its path."""
        self._reader = PageReader(store)
        self._workers: Workers[Request, bytes] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the copies, and what typesets formulas: a process that ends with it may hang."""
        self.rest()
        self._reader.close()

    def rest(self) -> None:
        """End the copies; what they remember is gone, and the room is free that they took."""
        if self._workers is not None:
            self._workers.close()
            self._workers = None
            self._readers.clear()

    # --- reading

    @property
    def imports(self) -> dict[str, frozenset[str]]:
        """The modules that each script imports, by its path, as far as texts were read."""
        found = (imported for summary in self._summaries.values() for imported in summary.imports)
        return {path: frozenset(modules) for path, modules in found}

    def fingerprint(self, course: Course, *, notes: bool = True) -> str | None:
        """That of a course whose documents these are; `None` for any other.

        `notes`: with what features note of its documents, which few pages show.
        """
        if self._fingerprints is None or self._fingerprints[0] is not course:
            summaries = self._summaries
            bare = course_fingerprint(
                course, ((s.document, s.fingerprint) for s in summaries.values())
            )
            own = (summaries[d.source.path].notes_fingerprint for d in course.documents)
            self._fingerprints = course, bare, None if bare is None else key_of(bare, *own)
        _, bare, whole = self._fingerprints
        return whole if notes else bare

    def check(self, course: Course) -> tuple[Diagnostic, ...]:
        """What `check_course` finds; nothing where it found nothing in one of this fingerprint."""
        key = step_key("checked course")
        state = (self.fingerprint(course) or "").encode()
        if state and self._store.get(_CHECKED, key, bytes) == state:
            return ()
        found = super().check(course)
        if state and not found:
            self._store.put(_CHECKED, key, state)
        return found

    def ahead(self, sources: Sequence[tuple[Source, bool]], callouts: frozenset[str]) -> None:
        """Have the summaries of sources, of which it is said which are lessons."""
        texts = [SourceText.of(source, callouts, lesson=lesson) for source, lesson in sources]
        missing = [text for text in texts if not self._has(text)]
        if len(missing) >= _MANY:
            prepare_to_read(missing[0])
        answers = self._work("reading lessons and pages", iter(missing))
        for text, (data, reader) in zip(missing, answers, strict=True):
            self._take(text, decode(data, DocumentSummary, text.source))
            if reader is not None:
                self._readers[text.source.path] = reader

    def _has(self, text: SourceText) -> bool:
        """Whether the summary of a text is known, or in the store."""
        known = self._texts.get(text.source.path)
        if known is not None and known.key == text.key:
            return True
        summary = self._store.get(
            SUMMARIES, text.key, lambda data: decode(data, DocumentSummary, text.source)
        )
        if summary is not None:
            self._take(text, summary)
        return summary is not None

    def _take(self, text: SourceText, summary: DocumentSummary | None) -> None:
        assert summary is not None, "what was just encoded can be decoded"
        self._texts[text.source.path] = text
        self._summaries[text.source.path] = summary.noted(partial(self._notes_again, text))

    def _notes_again(self, text: SourceText) -> Mapping[str, bytes]:
        """The notes of a text of which the store has damaged ones."""
        self._store.peek(SUMMARIES, text.key, lambda _: None)  # which tells of it
        summary = decode(self._reader.read(text), DocumentSummary, text.source)
        assert summary is not None, "what was just encoded can be decoded"
        return summary.notes

    def document(
        self, source: Source, callouts: frozenset[str], *, lesson: bool
    ) -> Parsed[Document]:
        """A document without its prose, and what is wrong in it."""
        known = self._texts.get(source.path)
        if (
            known is None
            or known.source is not source
            or (known.callouts, known.lesson) != (callouts, lesson)
        ):
            self.ahead([(source, lesson)], callouts)
        summary = self._summaries[source.path]
        return Parsed(summary.document, summary.diagnostics)

    def course_map(self, source: Source) -> Parsed[Course | None]:
        """The course that a map describes, and what is wrong in it."""
        return self._remembered(_MAPS, Course, source, super().course_map)

    def declarations(self, source: Source) -> Parsed[Declarations | None]:
        """What a file beside a model declares, and what is wrong in it."""
        return self._remembered(_DECLARATIONS, Declarations, source, super().declarations)

    def _remembered(
        self,
        kind: str,
        type: type[Value],
        source: Source,
        parse: Callable[[Source], Parsed[Value | None]],
    ) -> Parsed[Value | None]:
        """What a text parses to: kept, or parsed now, by what is imported only then."""
        key = step_key(kind, source.path, source.text)

        def read(data: bytes) -> Parsed[Value | None] | None:
            parsed = decode(data, Parsed, source)
            return parsed if parsed and isinstance(parsed.value, type | None) else None

        found = self._store.get(kind, key, read)
        if found is not None:
            return found
        parsed = parse(source)
        self._store.put(kind, key, encode(parsed))
        return parsed

    # --- drawing

    def draw(self, pages: Iterator[PageRequest]) -> Iterator[bytes]:
        """Draw pages, which are in the store then; gives their records, encoded, in order.

        Pages are asked for while others are drawn.
        """
        return (data for data, _ in self._work("drawing pages", pages))

    def page(self, key: str, request: Callable[[], PageRequest]) -> DrawnPage:
        """The page of a key, as it is in the store; drawn here and now, where it is not."""
        kept = self._store.peek(PAGES, key, lambda data: decode(data, DrawnPage))
        return kept or self._reader.draw(request())

    def context(self, path: str, inputs: PageInputs, course: Course) -> PageContext:
        """The document at a path with all its text, on the page with these inputs."""
        own = course.theme.template_texts
        return self._reader.context(self._texts[path], inputs, course.language, own)

    # --- here, or in copies of this process

    def _work(self, name: str, requests: Iterator[Request]) -> Iterator[tuple[bytes, int | None]]:
        """The answers to requests, from copies of this process where there are many requests."""
        first = tuple(islice(requests, max(_MANY, self._jobs * _MANY // 2)))
        requests = chain(first, requests)
        if self._workers is None and len(first) >= _MANY and self._jobs > 1:
            from coursebuild.core.engine.workers import Workers, can_fork

            # Before the stage begins, which may start a thread that could not come along.
            if can_fork():
                count = min(self._jobs, -(-2 * len(first) // _MANY))
                self._workers = Workers(self._reader.answer, count)
        if not first:
            return
        with self._stage(name):
            if self._workers is None:
                yield from ((self._reader.answer(request), None) for request in requests)
            else:
                yield from self._workers.map(map(self._to, requests))

    def _to(self, request: Request) -> tuple[int | None, Request]:
        """A request, to the copy that has its document."""
        text = request.text if isinstance(request, PageRequest) else None
        return (None if text is None else self._readers.get(text.source.path)), request
