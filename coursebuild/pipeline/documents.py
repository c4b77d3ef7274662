"""The documents of a course from what is kept, and by work spread over the cores where it is not.

Entry point: `Documents`, a context manager and the `Parser` of a course, which gives summaries
(`document`) and draws pages (`draw`).

1. `ahead` is told which texts there are. The summaries of texts that were read before come from the
   store; the others are read, in copies of this process where there are many.
2. `draw` draws pages: each in the copy that has read its document, which has it still.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from itertools import chain, islice
from typing import TYPE_CHECKING, Self, TypeAlias, TypeVar

from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.tool import step_key
from coursebuild.core.model import Course, Declarations, Document
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.source import Source
from coursebuild.core.values import decode, encode
from coursebuild.pipeline.fingerprints import course_fingerprint
from coursebuild.pipeline.load import Parser
from coursebuild.pipeline.tasks import (
    SUMMARIES,
    Answer,
    DocumentSummary,
    Draw,
    Drawn,
    Later,
    Request,
    Task,
)

if TYPE_CHECKING:
    from coursebuild.core.engine.workers import Workers
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.pages.page_inputs import PageInputs
    from coursebuild.core.pages.record import PageRecord
    from coursebuild.pipeline.reading import PageReader

Value = TypeVar("Value")
Stage: TypeAlias = Callable[[str], AbstractContextManager[None]]


def _silent(name: str) -> AbstractContextManager[None]:
    return nullcontext()


_MAPS, _DECLARATIONS, _CHECKED = "maps", "declarations", "checked"
"""Kinds of entries in the store; the last says in what nothing was wrong."""
_MANY = 8
"""Texts or pages for which copies of this process are worth their start."""
_AT_ONCE = 256
"""Texts whose summaries are waited for before more are read."""


class Documents(Parser):
    """Summaries of the documents of a course, and their pages."""

    def __init__(self, store: Memo, jobs: int, stage: Stage = _silent) -> None:
        """`jobs` copies of this process at most; `stage` is told when long work begins."""
        self._store = store
        self._stage = stage
        self._jobs = jobs
        self._tasks: dict[str, Task] = {}
        self._summaries: dict[str, DocumentSummary] = {}
        self._fingerprint: tuple[Course, str | None] | None = None
        self._readers: dict[str, int] = {}
        """Which copy has read a text, by its path."""
        self._reader: PageReader | None = None
        self._workers: Workers[Request, Answer] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the copies, and what typesets formulas: a process that ends with it may hang."""
        self.rest()
        if self._reader is not None:
            self._reader.close()

    @property
    def summaries(self) -> tuple[DocumentSummary, ...]:
        """All that are known."""
        return tuple(self._summaries.values())

    def fingerprint(self, course: Course) -> str | None:
        """That of a course whose documents these are; `None` for any other."""
        if self._fingerprint is None or self._fingerprint[0] is not course:
            known = ((summary.document, summary.fingerprint) for summary in self.summaries)
            self._fingerprint = course, course_fingerprint(course, known)
        return self._fingerprint[1]

    def check(self, course: Course) -> tuple[Diagnostic, ...]:
        """What `check_course` finds; nothing where it found nothing in one of this fingerprint."""
        key = step_key("checked course")
        state = (self.fingerprint(course) or "").encode()
        if state and self._store.get(_CHECKED, key, local=True) == state:
            return ()
        found = super().check(course)
        if state and not found:
            self._store.put(_CHECKED, key, state, local=True)
        return found

    def ahead(self, sources: Sequence[tuple[Source, bool]], callouts: frozenset[str]) -> None:
        """Have the summaries of sources, of which it is said which are lessons."""
        tasks = [Task.of(source, callouts, lesson) for source, lesson in sources]
        missing = [task for task in tasks if not self._has(task)]
        self._tasks.update((task.source.path, task) for task in tasks)
        if len(missing) >= _MANY:
            from coursebuild.pipeline.reading import prepare_to_read

            prepare_to_read(missing[0])
        rest = iter(missing)
        while at_once := tuple(islice(rest, _AT_ONCE)):
            self._read(at_once)

    def _has(self, task: Task) -> bool:
        """Whether the summary of a text is known, or in the store."""
        path = task.source.path
        if path in self._summaries and self._tasks[path].key == task.key:
            return True
        data = self._store.get(SUMMARIES, task.key, local=True)
        summary = decode(data, DocumentSummary, task.source)
        if summary is not None:
            self._summaries[path] = summary
        return summary is not None

    def _read(self, tasks: Sequence[Task]) -> None:
        requests: Iterator[tuple[int | None, Request]] = ((None, task) for task in tasks)
        answers, readers = self._work("reading lessons and pages", requests)
        for task, data, reader in zip(tasks, answers, readers, strict=True):
            summary = decode(data, DocumentSummary, task.source)
            assert summary is not None
            self._summaries[task.source.path] = summary
            if reader is not None:
                self._readers[task.source.path] = reader

    def document(
        self, source: Source, callouts: frozenset[str], *, lesson: bool
    ) -> Parsed[Document]:
        """A document without its prose, and what is wrong in it."""
        known = self._tasks.get(source.path)
        if known is None or not known.is_of(source, callouts, lesson):
            self.ahead([(source, lesson)], callouts)
        summary = self._summaries[source.path]
        return Parsed(summary.document, summary.diagnostics)

    def course_map(self, source: Source) -> Parsed[Course | None]:
        """The course that a map describes, and what is wrong in it."""
        return self._remembered(_MAPS, source, super().course_map)

    def declarations(self, source: Source) -> Parsed[Declarations | None]:
        """What a file beside a model declares, and what is wrong in it."""
        return self._remembered(_DECLARATIONS, source, super().declarations)

    def _remembered(
        self, kind: str, source: Source, parse: Callable[[Source], Parsed[Value]]
    ) -> Parsed[Value]:
        """What a text parses to: kept, or parsed now, by what is imported only then."""
        key = step_key(kind, source.path, source.text)
        data = self._store.get(kind, key, local=True)
        found = decode(data, Parsed, source)
        if found is not None:
            return found
        parsed = parse(source)
        self._store.put(kind, key, encode(parsed), local=True)
        return parsed

    def task(self, path: str) -> Task:
        """The text of a path, with all that its document depends on."""
        return self._tasks[path]

    def draw(self, pages: Iterable[Later]) -> list[bytes]:
        """Draw pages; gives their packed records, and their bodies are in the store then.

        Pages are asked for while others are drawn.
        """
        rest = iter(pages)
        first = tuple(islice(rest, 1))
        return self._work("drawing pages", map(self._to, chain(first, rest)))[0] if first else []

    def _to(self, page: Later) -> tuple[int | None, Request]:
        """The page, to the copy that has its document."""
        return (self._readers.get(page.path) if page.path is not None else None), page

    def drawn(self, page: Draw) -> Drawn:
        """A page, its body, and what it is found by, drawn here and now."""
        return self._here().draw(page)

    def page(self, page: Draw) -> tuple[PageRecord, str]:
        """A page and its body alone, drawn here and now."""
        return self._here().page(page)

    def context(self, path: str, inputs: PageInputs, language: str) -> PageContext:
        """The document at a path with all its text, on the page with these inputs."""
        return self._here().context(self._tasks[path], inputs, language)

    def _work(
        self, name: str, requests: Iterator[tuple[int | None, Request]]
    ) -> tuple[list[Answer], list[int | None]]:
        """The answers to requests, from copies of this process where there are many requests."""
        reader = self._here()
        if self._workers is None:
            first = tuple(islice(requests, max(_MANY, self._jobs * _MANY // 2)))
            requests = chain(first, requests)
            few = len(first) < _MANY or self._jobs == 1
            if not few:
                from coursebuild.core.engine.workers import Workers, can_fork

            if few or not can_fork():
                with self._stage(name):
                    answers = [reader.answer(request) for _, request in requests]
                return answers, [None] * len(answers)
            # Before the stage begins, which may start a thread that could not come along.
            count = min(self._jobs, -(-2 * len(first) // _MANY))
            self._workers = Workers(reader.answer, count)
        with self._stage(name):
            return self._workers.map(requests)

    def rest(self) -> None:
        """End the copies; what they remember is gone, and the room is free that they took."""
        if self._workers is not None:
            self._workers.close()
            self._workers = None
            self._readers.clear()

    def _here(self) -> PageReader:
        """What reads and draws in this process."""
        if self._reader is None:
            from coursebuild.pipeline.reading import PageReader

            self._reader = PageReader(self._store)
        return self._reader
