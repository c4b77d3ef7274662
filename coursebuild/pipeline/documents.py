"""The documents of a course from what is kept, and by work spread over the cores where it is not.

Entry point: `Documents`, a context manager, which gives outlines (`parse`) and draws pages
(`draw`).

1. `ahead` is told which texts there are. The outlines of texts that were read before come from the
   store; the others are read, in copies of this process where there are many.
2. `draw` draws pages: each in the copy that has read its document, which has it still.
3. Where texts are put aside, so are the skeletons: what is held of a document is then its name, its
   key and what is wrong in it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from itertools import islice
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeAlias, TypeVar

from coursebuild.diagnostics import Diagnostic, Parsed
from coursebuild.effects.aside import Aside
from coursebuild.effects.store import Store
from coursebuild.effects.tool import tool_digest
from coursebuild.model import Course, Declarations, Document
from coursebuild.pipeline.faces import course_face
from coursebuild.pipeline.outlines import Outline, Task, pack, parted, unpack, unpacked
from coursebuild.pipeline.requests import OUTLINES, Answer, Cut, Draw, Drawn, Later, Read, Request
from coursebuild.pipeline.shelf import Shelf
from coursebuild.source import Source
from coursebuild.values import replace

if TYPE_CHECKING:
    from coursebuild.effects.pool import Pool
    from coursebuild.pipeline.reading import Reader
    from coursebuild.render.fonts import FontJob

Value = TypeVar("Value")
Stage: TypeAlias = Callable[[str], AbstractContextManager[None]]


def _silent(name: str) -> AbstractContextManager[None]:
    return nullcontext()


_MAPS, _DECLARATIONS, _FONTS = "maps", "declarations", "fonts"
"""Kinds of entries in the store: course maps, and cut fonts."""
_CHECKED = "checked"
"""The kind of the entry that says in what nothing was wrong."""
_MANY = 8
"""Texts or pages for which copies of this process are worth their start."""
_AT_ONCE = 256
"""Texts whose outlines are waited for before more are read."""


class Documents:
    """Outlines of the documents of a course, and their pages."""

    def __init__(
        self, store: Store, jobs: int, stage: Stage = _silent, aside: Aside | None = None
    ) -> None:
        """`jobs` copies of this process at most; `stage` is told when long work begins.

        `aside` is where skeletons are put; without it they stay in memory.
        """
        self.aside = aside
        self._shelf = Shelf(aside) if aside is not None else None
        self._store = store
        self._stage = stage
        self._jobs = jobs
        self._tasks: dict[str, Task] = {}
        self._outlines: dict[str, Outline] = {}
        self._face: tuple[Course, str | None] | None = None
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

    def face(self, course: Course) -> str | None:
        """The face of a course whose documents these are (`faces`); `None` for any other."""
        if self._face is None or self._face[0] is not course:
            faces = ((outline.skeleton, outline.face) for outline in self._outlines.values())
            self._face = course, course_face(course, faces)
        return self._face[1]

    def check(self, course: Course) -> tuple[Diagnostic, ...]:
        """What `check_course` finds; nothing where it found nothing in a course of this face."""
        key = hashlib.sha256(f"checked course\0{tool_digest()}".encode()).hexdigest()
        face = (self.face(course) or "").encode()
        if face and not self._store.fresh and self._store.peek(_CHECKED, key) == face:
            return ()
        from coursebuild.checks.course import check_course

        found = check_course(course)
        if face and not found:
            self._store.keep(_CHECKED, key, face, packed=True)
        return found

    def ahead(self, sources: Sequence[tuple[Source, bool]], callouts: frozenset[str]) -> None:
        """Have the outlines of sources, of which it is said which are lessons."""
        missing: list[Task] = []
        for source, lesson in sources:
            task = Task.of(source, callouts, lesson)
            self._tasks[source.path] = task
            outline = self._stored(task)
            if outline is None:
                missing.append(task)
            else:
                self._outlines[source.path] = outline
        if len(missing) >= _MANY:
            from coursebuild.pipeline.reading import prepare_to_read

            prepare_to_read(missing[0])
        rest = iter(missing)
        while tasks := tuple(islice(rest, _AT_ONCE)):
            self._read(tasks)

    def _read(self, tasks: Sequence[Task]) -> None:
        requests: list[tuple[int | None, Request]] = [(None, Read(task)) for task in tasks]
        answers, readers = self._work("reading lessons and pages", requests)
        for task, data, reader in zip(tasks, answers, readers, strict=True):
            outline = self._opened(data, task)
            assert outline is not None
            self._outlines[task.source.path] = outline
            self._readers[task.source.path] = reader

    def parse(self, source: Source, callouts: frozenset[str], *, lesson: bool) -> Parsed[Document]:
        """The skeleton of a document, and what is wrong in it."""
        known = self._tasks.get(source.path)
        if known is None or not known.is_of(source, callouts, lesson):
            self.ahead([(source, lesson)], callouts)
        outline = self._outlines[source.path]
        return Parsed(outline.skeleton, outline.diagnostics)

    def course_map(self, source: Source) -> Parsed[Course | None]:
        """The course that a map describes, and what is wrong in it."""

        def parse(source: Source) -> Parsed[Course | None]:
            from coursebuild.syntax.coursemap import parse_course_map

            return parse_course_map(source)

        return self._remembered(_MAPS, source, parse)

    def declarations(self, source: Source) -> Parsed[Declarations | None]:
        """What a file beside a model declares, and what is wrong in it."""

        def parse(source: Source) -> Parsed[Declarations | None]:
            from coursebuild.syntax.scenarios import parse_declarations

            return parse_declarations(source)

        return self._remembered(_DECLARATIONS, source, parse)

    def _remembered(
        self, kind: str, source: Source, parse: Callable[[Source], Parsed[Value]]
    ) -> Parsed[Value]:
        """What a text parses to: kept, or parsed now, by what is imported only then."""
        parts = (tool_digest(), source.path, source.text)
        key = hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()
        data = None if self._store.fresh else self._store.peek(kind, key)
        found = None if data is None else unpack(data, source)
        if isinstance(found, Parsed):
            return found
        parsed = parse(source)
        self._store.keep(kind, key, pack(parsed), packed=True)
        return parsed

    def task(self, path: str) -> Task:
        """The text of a path, with all that its document depends on."""
        return self._tasks[path]

    def draw(self, pages: Sequence[Later]) -> list[bytes]:
        """Draw pages; gives their packed records, and their bodies are in the store then."""
        requests: list[tuple[int | None, Request]] = [
            (self._readers.get(page.path) if page.path is not None else None, page)
            for page in pages
        ]
        return self._work("drawing pages", requests)[0] if requests else []

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
            from coursebuild.pipeline.reading import prepare_to_cut

            self._rest()  # which have seen everything; what cuts fonts needs room
            prepare_to_cut()
            requests: list[tuple[int | None, Request]] = [(None, Cut(job)) for job in missing]
            answers, _ = self._work("cutting fonts", requests, many=2)
            for job, made in zip(missing, answers, strict=True):
                found[job.key] = made
                self._store.keep(_FONTS, job.key, made)
            self._rest()
        return lambda job: found[job.key]

    def drawn(self, page: Draw) -> Drawn:
        """A page, its body, and what it is found by, drawn here and now."""
        return self._here().draw(page)

    def _stored(self, task: Task) -> Outline | None:
        data = None if self._store.fresh else self._store.peek(OUTLINES, task.key)
        return None if data is None else self._opened(data, task)

    def _opened(self, data: bytes, task: Task) -> Outline | None:
        """An outline, put aside where that is wanted; `None` where the bytes are none."""
        if self._shelf is None:
            return unpacked(data, task.source)
        parts = parted(data, task.source)
        if parts is None:
            return None
        outline, skeleton = parts

        def again() -> Document:
            return self._here().outline(task).skeleton

        return replace(outline, skeleton=self._shelf.document(task.source, skeleton, again))

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
            count = min(self._jobs, -(-2 * len(requests) // many))
            self._pool = Pool(reader.answer, count, reader.begin_copy)
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
