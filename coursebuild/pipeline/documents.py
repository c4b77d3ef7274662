"""The documents of a course and their pages, from the store or made by several processes.

Entry point: `Documents`, a context manager and the `Parser` of a course, which returns summaries
(`read_documents`) and draws pages (`draw`).

1. `read_documents` gets the summaries of texts. Those of texts that were read before come from the
   store; the other texts are read, by worker processes where there are many.
2. `draw` draws pages. The worker that has read a document also draws its page, since it still has
   the whole document.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import chain, islice
from typing import TYPE_CHECKING, Self, TypeAlias, TypeVar

from coursebuild.core.engine.tool import step_key
from coursebuild.core.model import Course, Declarations, Document
from coursebuild.core.model.vocabulary import Words
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.source import Source, key_of
from coursebuild.core.values import decode, encode
from coursebuild.pipeline.fingerprints import course_fingerprint
from coursebuild.pipeline.load import Parser
from coursebuild.pipeline.options import Options
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
    from coursebuild.core.engine.page_pool import Workers
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.pages.page_inputs import PageInputs

Value = TypeVar("Value")
Request: TypeAlias = SourceText | PageRequest

_MAPS, _DECLARATIONS, _CLEAN_COURSES = "maps", "declarations", "checked"
"""Kinds of entries in the store; the last is for courses in which nothing was wrong."""
_MIN_PARALLEL = 8
"""Texts or pages for which worker processes are worth their start."""


class Documents(Parser):
    """Summaries of the documents of a course, and their pages."""

    def __init__(self, options: Options) -> None:
        self._store = options.store
        self._stage = options.progress.stage
        self._jobs = options.jobs
        self._texts: dict[str, SourceText] = {}
        self._summaries: dict[str, DocumentSummary] = {}
        self._fingerprints: tuple[Course, tuple[str | None, str | None]] | None = None
        self._readers: dict[str, int] = {}
        """The number of the worker that has read a text, by the text's path."""
        self._reader = PageReader(self._store)
        self._workers: Workers[Request, bytes] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the workers, and what typesets formulas: with it running, a process may hang."""
        self.stop_workers()
        self._reader.close()

    def stop_workers(self) -> None:
        """End the workers, which frees their memory with the documents that they have read."""
        if self._workers is not None:
            self._workers.close()
            self._workers = None
            self._readers.clear()

    # --- reading

    @property
    def imports(self) -> dict[str, frozenset[str]]:
        """The modules that each script imports, by its path; of the documents read so far."""
        imports = (pair for summary in self._summaries.values() for pair in summary.imports)
        return {path: frozenset(modules) for path, modules in imports}

    def fingerprints(self, course: Course) -> tuple[str | None, str | None]:
        """The fingerprints of a course whose documents these are; `None` for any other course.

        The first is of the course without what features note of its documents, which few pages
        show.
        """
        if self._fingerprints is None or self._fingerprints[0] is not course:
            summaries = self._summaries
            bare = course_fingerprint(
                course, ((s.document, s.fingerprint) for s in summaries.values())
            )
            whole = None
            if bare is not None:
                documents = course.documents
                whole = key_of(
                    bare, *(summaries[d.source.path].notes_fingerprint for d in documents)
                )
            self._fingerprints = course, (bare, whole)
        return self._fingerprints[1]

    def check(self, course: Course) -> tuple[Diagnostic, ...]:
        """What `check_course` finds; a course that was found clean is not checked again."""
        key = step_key("checked course")
        state = (self.fingerprints(course)[1] or "").encode()
        if state and self._store.get(_CLEAN_COURSES, key, bytes) == state:
            return ()
        diagnostics = super().check(course)
        if state and not diagnostics:
            self._store.put(_CLEAN_COURSES, key, state)
        return diagnostics

    def read_documents(
        self, sources: Sequence[tuple[Source, bool]], callouts: frozenset[str], words: Words
    ) -> list[Parsed[Document]]:
        """Return documents without their prose, and what is wrong in them."""
        texts = [
            SourceText.of(source, callouts, lesson=lesson, words=words)
            for source, lesson in sources
        ]
        summaries = {text.key: self._find_summary(text) for text in texts}
        missing = [text for text in texts if summaries[text.key] is None]
        if len(missing) >= _MIN_PARALLEL:
            prepare_to_read(missing[0])
        answers = self._answer_requests("reading lessons and pages", iter(missing))
        for text, (data, reader) in zip(missing, answers, strict=True):
            summaries[text.key] = self._keep(text, decode(data, DocumentSummary, text.source))
            if reader is not None:
                self._readers[text.source.path] = reader
        all_summaries = (summaries[text.key] for text in texts)
        return [Parsed(s.document, s.diagnostics) for s in all_summaries if s is not None]

    def _find_summary(self, text: SourceText) -> DocumentSummary | None:
        """Find the summary of a text, in memory or in the store."""
        path = text.source.path
        if path in self._texts and self._texts[path].key == text.key:
            return self._summaries[path]
        summary = self._store.get(
            SUMMARIES, text.key, lambda data: decode(data, DocumentSummary, text.source)
        )
        return None if summary is None else self._keep(text, summary)

    def _keep(self, text: SourceText, summary: DocumentSummary | None) -> DocumentSummary:
        assert summary is not None, "what was just encoded can be decoded"
        path = text.source.path
        self._texts[path], self._summaries[path] = text, summary.with_notes()
        return self._summaries[path]

    def read_map(self, source: Source) -> Parsed[Course | None]:
        """Return the course that a map describes, and what is wrong in it."""
        return self._get_or_parse(_MAPS, Course, source, super().read_map)

    def read_declarations(self, source: Source) -> Parsed[Declarations | None]:
        """Return what a file beside a model declares, and what is wrong in it."""
        return self._get_or_parse(_DECLARATIONS, Declarations, source, super().read_declarations)

    def _get_or_parse(
        self,
        kind: str,
        type: type[Value],
        source: Source,
        parse: Callable[[Source], Parsed[Value | None]],
    ) -> Parsed[Value | None]:
        """Return what is stored for a text; parse it where nothing is."""
        key = step_key(kind, source.path, source.text)

        def read(data: bytes) -> Parsed[Value | None] | None:
            content = decode(data, Parsed, source)
            return content if content and isinstance(content.value, type | None) else None

        entry = self._store.get(kind, key, read)
        if entry is not None:
            return entry
        result = parse(source)
        self._store.put(kind, key, encode(result))
        return result

    # --- drawing

    def draw(self, pages: Iterator[PageRequest]) -> Iterator[bytes]:
        """Draw pages and store them; return their records, encoded, in order.

        Requests are taken from the iterator while pages are drawn.
        """
        return (data for data, _ in self._answer_requests("drawing pages", pages))

    def get_or_draw(self, key: str, request: Callable[[], PageRequest]) -> DrawnPage:
        """Return the page stored under a key; draw it here where there is none."""
        return self.find_page(key) or self._reader.draw(request())

    def find_page(self, key: str) -> DrawnPage | None:
        """Return the page stored under a key, if there is one."""
        return self._store.peek(PAGES, key, lambda data: decode(data, DrawnPage))

    def page_context(self, path: str, inputs: PageInputs, course: Course) -> PageContext:
        """What is needed to draw parts of the document at a path, with all its text."""
        templates = course.theme.template_texts
        return self._reader.page_context(self._texts[path], inputs, course.language, templates)

    # --- here, or in worker processes

    def _answer_requests(
        self, name: str, requests: Iterator[Request]
    ) -> Iterator[tuple[bytes, int | None]]:
        """Answer requests, by workers where there are many; name the worker of each answer."""
        first = tuple(islice(requests, max(_MIN_PARALLEL, self._jobs * _MIN_PARALLEL // 2)))
        requests = chain(first, requests)
        if self._workers is None and len(first) >= _MIN_PARALLEL and self._jobs > 1:
            from coursebuild.core.engine.page_pool import Workers, can_fork

            # Before the stage begins, which may start a thread: a fork does not copy threads.
            if can_fork():
                count = min(self._jobs, -(-2 * len(first) // _MIN_PARALLEL))
                self._workers = Workers(self._reader.answer, count)
        if not first:
            return
        with self._stage(name):
            if self._workers is None:
                yield from ((self._reader.answer(request), None) for request in requests)
            else:
                yield from self._workers.map(map(self._assign, requests))

    def _assign(self, request: Request) -> tuple[int | None, Request]:
        """A request with the number of the worker that has its document, if any."""
        text = request.text if isinstance(request, PageRequest) else None
        return (None if text is None else self._readers.get(text.source.path)), request
