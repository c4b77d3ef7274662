"""The documents of a course from what is kept, and by work spread over the cores where it is not.

Entry point: `Documents`, a context manager, which gives outlines (`parse`) and draws pages
(`draw`).

1. `ahead` is told which texts there are. The outlines of texts that were read before come from the
   store; the others are read, in copies of this process where there are many.
2. `draw` draws pages: each in the copy that has read its document, which has it still.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeAlias

from coursebuild.diagnostics import Parsed
from coursebuild.effects.store import Store
from coursebuild.effects.tool import tool_digest
from coursebuild.model import Course, Document
from coursebuild.pipeline.outlines import Outline, Task, pack, unpack, unpacked
from coursebuild.pipeline.requests import OUTLINES, Answer, Cut, Draw, Read, Request
from coursebuild.source import Source

if TYPE_CHECKING:
    from coursebuild.effects.pool import Pool
    from coursebuild.pipeline.reading import Reader
    from coursebuild.render.fonts import FontJob
    from coursebuild.render.record import PageRecord

Stage: TypeAlias = Callable[[str], AbstractContextManager[None]]


def _silent(name: str) -> AbstractContextManager[None]:
    return nullcontext()


_MAPS, _FONTS = "maps", "fonts"
"""Kinds of entries in the store: course maps, and cut fonts."""
_MANY = 8
"""Texts or pages for which copies of this process are worth their start."""


class Documents:
    """Outlines of the documents of a course, and their pages."""

    def __init__(self, store: Store, jobs: int, stage: Stage = _silent) -> None:
        """`jobs` copies of this process at most; `stage` is told when long work begins."""
        self._store = store
        self._stage = stage
        self._jobs = jobs
        self._tasks: dict[str, Task] = {}
        self._outlines: dict[str, Outline] = {}
        self._readers: dict[str, int | None] = {}
        """Which copy has read a text, by its path."""
        self._reader: Reader | None = None
        self._pool: Pool[Request, Answer] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._rest()
        if self._reader is not None:
            self._reader.__exit__(kind, error, traceback)

    @property
    def outlines(self) -> tuple[Outline, ...]:
        """All that are known."""
        return tuple(self._outlines.values())

    def ahead(self, sources: Sequence[tuple[Source, bool]], callouts: frozenset[str]) -> None:
        """Have the outlines of sources, of which it is said which are lessons."""
        missing: list[Task] = []
        for source, lesson in sources:
            task = Task(source, callouts, lesson)
            self._tasks[source.path] = task
            outline = self._stored(task)
            if outline is None:
                missing.append(task)
            else:
                self._outlines[source.path] = outline
        if not missing:
            return
        requests: list[tuple[int | None, Request]] = [(None, Read(task)) for task in missing]
        if len(requests) >= _MANY:
            from coursebuild.pipeline.reading import import_all

            import_all()
        answers, readers = self._work("reading lessons and pages", requests)
        for task, data, reader in zip(missing, answers, readers, strict=True):
            assert isinstance(data, bytes)
            outline = unpacked(data, task.source)
            assert outline is not None
            self._outlines[task.source.path] = outline
            self._readers[task.source.path] = reader

    def parse(self, source: Source, callouts: frozenset[str], *, lesson: bool) -> Parsed[Document]:
        """The skeleton of a document, and what is wrong in it."""
        known = self._tasks.get(source.path)
        if known is None or known != Task(source, callouts, lesson):
            self.ahead([(source, lesson)], callouts)
        outline = self._outlines[source.path]
        return Parsed(outline.skeleton, outline.diagnostics)

    def course_map(self, source: Source) -> Parsed[Course | None]:
        """The course that a map describes, and what is wrong in it."""
        parts = (tool_digest(), source.path, source.text)
        key = hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()
        data = None if self._store.fresh else self._store.peek(_MAPS, key)
        found = None if data is None else unpack(data, source)
        if isinstance(found, Parsed):
            return found
        from coursebuild.syntax.coursemap import parse_course_map

        parsed = parse_course_map(source)
        self._store.keep(_MAPS, key, pack(parsed), local=True)
        return parsed

    def task(self, path: str) -> Task:
        """The text of a path, with all that its document depends on."""
        return self._tasks[path]

    def draw(self, pages: Sequence[Draw]) -> list[PageRecord]:
        """Draw pages; their bodies are in the store then."""
        requests: list[tuple[int | None, Request]] = [
            (self._readers.get(page.task.source.path) if page.task is not None else None, page)
            for page in pages
        ]
        if not requests:
            return []
        answers, _ = self._work("drawing pages", requests)
        return [answer for answer in answers if not isinstance(answer, bytes)]

    def cut(self, jobs: Sequence[FontJob]) -> Callable[[FontJob], bytes]:
        """Fonts, cut already or cut now; gives them."""
        from coursebuild.effects.prepared import prepared_cut

        found: dict[str, bytes] = {}
        for job in jobs:
            data = prepared_cut(job.key) or self._store.load(_FONTS, job.key)
            if data is not None:
                found[job.key] = data
        # The largest first, so that none of them is left for the end.
        missing = sorted((j for j in jobs if j.key not in found), key=lambda j: -len(j.data))
        if missing:
            self._rest()  # which have seen everything; what cuts fonts needs room
            requests: list[tuple[int | None, Request]] = [(None, Cut(job)) for job in missing]
            answers, _ = self._work("cutting fonts", requests, many=2)
            for job, made in zip(missing, answers, strict=True):
                assert isinstance(made, bytes)
                found[job.key] = made
                self._store.keep(_FONTS, job.key, made)
        return lambda job: found[job.key]

    def drawn(self, page: Draw) -> tuple[PageRecord, str]:
        """A page and its body, drawn here and now."""
        return self._here().draw(page)

    def _stored(self, task: Task) -> Outline | None:
        data = None if self._store.fresh else self._store.peek(OUTLINES, task.key)
        return None if data is None else unpacked(data, task.source)

    def _work(
        self, name: str, requests: Sequence[tuple[int | None, Request]], *, many: int = _MANY
    ) -> tuple[list[Answer], list[int | None]]:
        """The answers to requests, from copies of this process where there are many requests."""
        reader = self._here()
        if self._pool is None:
            few = len(requests) < many or self._jobs == 1
            if not few:
                from coursebuild.effects.pool import Pool, can_fork

            if few or not can_fork():
                with self._stage(name):
                    answers = [reader.answer(request) for _, request in requests]
                return answers, [None] * len(answers)
            # Before the stage begins, which may start a thread that could not come along.
            self._pool = Pool(reader.answer, min(self._jobs, -(-2 * len(requests) // many)))
        with self._stage(name):
            return self._pool.run(requests)

    def _rest(self) -> None:
        """End the copies; what they remember is gone."""
        if self._pool is not None:
            self._pool.close()
            self._pool = None
            self._readers.clear()

    def _here(self) -> Reader:
        """What reads and draws in this process."""
        if self._reader is None:
            from coursebuild.pipeline.reading import Reader

            self._reader = Reader(self._store)
        return self._reader
