"""The pages of a site, drawn where something that they show has changed.

Entry point: `Pages`.

1. Every page has inputs, all that it shows of the course, and a key: a hash of its inputs, of its
   document's text, and of the tool.
   Where nothing has changed of what inputs are made of, the key is known without (`page_index`).
2. The records of pages come from the store; a page that has none is drawn.
3. From records alone it is known whether all links lead somewhere, and which characters and
   styles the pages use (`page_index`).
4. A body is fetched, and framed, when its file is written.

Of a page no more is held than its key and how its inputs are made: a course may have any number.
"""

from __future__ import annotations

import functools
import itertools
import operator
from collections.abc import Iterable, Iterator, Mapping

from msgspec import Struct

from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.tool import step_key
from coursebuild.core.model import Course
from coursebuild.core.model.results import CachedFile
from coursebuild.core.pages.added_files import NotedPage
from coursebuild.core.pages.frame import Frames, Names
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.links import has
from coursebuild.core.pages.page_list import PageEntry, page_list, page_title
from coursebuild.core.pages.record import PageRecord
from coursebuild.core.pages.shared import PageFacts
from coursebuild.core.text.source import key_of
from coursebuild.core.values import decode, encode
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.fingerprints import results_fingerprint
from coursebuild.pipeline.page_index import Facts, PageKeys
from coursebuild.pipeline.tasks import PAGES, Draw, KeptPage, Later, Task


class _Wanted(Struct, frozen=True):
    """A page as it should be."""

    page: PageEntry
    key: str
    task: Task | None
    """The text of its document."""

    @property
    def path(self) -> str:
        """Its site path."""
        return self.page.path


class _Page(Struct, frozen=True):
    wanted: _Wanted
    indexed: bool
    notes: tuple[tuple[str, NotedPage], ...]
    """Of features, by name."""
    ids: tuple[str, ...]
    """Its anchors."""


class Pages:
    """The pages of a course, drawn."""

    def __init__(
        self,
        library: Library,
        documents: Documents,
        store: Memo,
        entries: Iterable[PageEntry] | None = None,
        last_good: Mapping[str, str] | None = None,
    ) -> None:
        """`entries` are those to draw, all where nothing is said.

        `last_good`: keys, by site path, of pages that stay as they were.
        """
        self._library = library
        self._documents = documents
        self._store = store
        self._facts = Facts()
        self._by_path: dict[str, _Wanted] = {}
        self._inputs: dict[str, bytes] = {}
        """Of the pages without a known key, by site path, until these are drawn."""
        keys = PageKeys(store, self._around())
        self._last_good = last_good or {}
        self._pages = self._made(page_list(library) if entries is None else entries, keys)
        self._inputs.clear()
        if entries is None:
            keys.save()

    @property
    def facts(self) -> PageFacts:
        """What the shared files must know of all pages together."""
        return self._facts.together()

    @property
    def indexed(self) -> Iterator[str]:
        """Site paths of the pages that search engines should list."""
        return (page.wanted.path for page in self._pages if page.indexed)

    def noted(self, feature: str) -> tuple[NotedPage, ...]:
        """The pages of which a feature has noted something, in order."""
        return tuple(one for page in self._pages for name, one in page.notes if name == feature)

    def note(self, feature: str, path: str) -> bytes:
        """What a feature has noted of one of these pages."""
        page = self._at(path)
        kept = KeptPage.read(self._store.peek(PAGES, page.key))
        if kept is not None and feature in kept.notes:
            return kept.notes[feature]
        # It was damaged, or the store cannot be written.
        return self._documents.drawn(self._request(page)).notes[feature]

    def are_sound(self, files: set[str]) -> bool:
        """Whether all links of the pages lead to pages, or to files among these."""
        pages = {page.wanted.path: page for page in self._pages}
        if not self._facts.sound or not self._facts.leads.keys() <= files | pages.keys():
            return False
        for path, led in itertools.groupby(sorted(self._facts.anchors), operator.itemgetter(0)):
            if path in pages:
                ids = frozenset(pages[path].ids)
                if not all(has(ids, anchor) for _, anchor in led):
                    return False
        return True

    def files(self, names: Names) -> Iterator[CachedFile]:
        """The pages in their frames."""
        frame = self._frame(names)
        frames = Frames(self._library, names)
        for page in self._pages:
            key = key_of(page.wanted.key, frame)
            make = functools.partial(self._framed, page.wanted, frames)
            yield CachedFile(page.wanted.path, key, make)

    @property
    def keys(self) -> dict[str, str]:
        """The keys of all pages, by site path."""
        return {page.wanted.path: page.wanted.key for page in self._pages}

    def _at(self, path: str) -> _Wanted:
        if not self._by_path:
            self._by_path.update((page.wanted.path, page.wanted) for page in self._pages)
        return self._by_path[path]

    # --- keys

    def _around(self) -> str | None:
        """A hash of all that inputs are made of, but for documents; `None` where it has none."""
        course = self._documents.fingerprint(self._library.course)
        if course is None:
            return None
        results = results_fingerprint(self._library.results, self._library.reports)
        return key_of(course, results)

    def _wanted(self, page: PageEntry, keys: PageKeys) -> _Wanted:
        task = text_of(page, self._library)
        if page.path in self._last_good:
            return _Wanted(page, self._last_good[page.path], task)
        text = "" if task is None else task.key
        key = keys.get(page.path, text)
        if key is None:
            data = encode(page.inputs(self._library))
            key = page_key(self._library.course, task, data)
            keys.add(page.path, text, key)
            self._inputs[page.path] = data
        return _Wanted(page, key, task)

    def _request(self, wanted: _Wanted) -> Draw:
        course = self._library.course
        inputs = self._inputs.pop(wanted.path, None)
        if inputs is None:
            inputs = encode(wanted.page.inputs(self._library))
        return Draw(inputs, wanted.task, course.language, course.base_url, wanted.key)

    def _frame(self, names: Names) -> str:
        """The key of all that a frame shows besides its page."""
        course, results = self._library.course, self._library.results
        return step_key(
            "frame",
            course.language,
            course.title,
            course.key,
            course.base_url,
            course.repository,
            course.licence,
            tuple((page.id, page.title, page.menu) for page in course.pages),
            tuple((p.path, page_title(self._library, p)) for p in self._library.added_pages),
            results.engine,
            results.python,
            names,
        )

    # --- records and bodies

    def _made(self, entries: Iterable[PageEntry], keys: PageKeys) -> list[_Page]:
        """The pages with what their records say; they are drawn where they have none."""
        pages: list[_Wanted] = []
        records: dict[str, PageRecord] = {}
        new: list[_Wanted] = []

        def missing() -> Iterator[Later]:  # inputs are made while pages are drawn
            for entry in entries:
                page = self._wanted(entry, keys)
                record = self._known(page.key)
                if record is None and page.path in self._last_good:
                    continue  # what it was is gone
                pages.append(page)
                if record is None:
                    new.append(page)
                    yield self._later(page)
                else:
                    self._inputs.pop(page.path, None)
                    records[page.path] = record

        for page, data in zip(new, self._documents.draw(missing()), strict=True):
            record = decode(data, PageRecord)
            assert record is not None
            records[page.path] = record
        self.drawn = tuple(page.path for page in new)
        """Site paths of the pages that were drawn just now."""
        return [self._noted(page, records[page.path]) for page in pages]

    def _later(self, page: _Wanted) -> Later:
        path = None if page.task is None else page.task.source.path
        return Later(path, functools.partial(self._request, page))

    def _noted(self, page: _Wanted, record: PageRecord) -> _Page:
        """A page, now that it is known what it says."""
        self._facts.add(record)
        draft = record.draft
        notes = tuple(
            (name, NotedPage(draft.path, draft.kind, page.page.id, draft.title, digest))
            for name, digest in record.notes
        )
        return _Page(page, draft.indexed, notes, record.ids)

    def _known(self, key: str) -> PageRecord | None:
        """The record of a page that was drawn before."""
        kept = KeptPage.read(self._store.get(PAGES, key, local=True))
        return None if kept is None else kept.record

    def _framed(self, page: _Wanted, frames: Frames) -> bytes:
        kept = KeptPage.read(self._store.peek(PAGES, page.key))
        record = None if kept is None else kept.record
        if kept is None or record is None:  # it was damaged, or the store cannot be written
            drawn = self._documents.drawn(self._request(page))
            record, body = drawn.record, drawn.body.encode()
        else:
            body = kept.body
        before, after = frames.around(record.draft, record.parts)
        return before.encode() + body + after.encode()


class DemandedPage(Struct, frozen=True):
    """A page without its frame."""

    key: str
    record: PageRecord
    body: str


def demanded_page(
    entry: PageEntry,
    library: Library,
    documents: Documents,
    store: Memo,
    known: DemandedPage | None = None,
) -> DemandedPage:
    """One page: as it is known, as it was drawn before, or drawn now and not kept."""
    course, task = library.course, text_of(entry, library)
    inputs = encode(entry.inputs(library))
    key = page_key(course, task, inputs)
    if known is not None and known.key == key:
        return known
    kept = KeptPage.read(store.get(PAGES, key, local=True))
    record = None if kept is None else kept.record
    if kept is not None and record is not None:
        return DemandedPage(key, record, kept.body.decode())
    request = Draw(inputs, task, course.language, course.base_url, key)
    record, text = documents.page(request)
    return DemandedPage(key, record, text)


def text_of(page: PageEntry, library: Library) -> Task | None:
    """The text of the document that a page shows, if it shows one."""
    document = page.document(library)
    if document is None:
        return None
    callouts = frozenset(kind.name for kind in library.course.callouts)
    lesson = library.lessons.get(page.id)
    is_lesson = lesson is not None and lesson.document is document
    return Task.of(document.source, callouts, is_lesson)


def page_key(course: Course, text: Task | None, inputs: bytes) -> str:
    """A hash of all that a page depends on: its document's text and its inputs' bytes."""
    key = text.key if text is not None else ""
    return step_key("page", course.language, course.base_url, inputs, key)
