"""The pages of a site, drawn where something that they show has changed.

Entry point: `Pages`.

1. Every page has a sheet, all that it shows of the course, and a key: a hash of its sheet, of its
   document's text, and of the tool.
   Where nothing has changed of what sheets are made of, the key is known without (`page_keys`).
2. What the records of some pages say together is kept (`page_facts`). Where one of the pages has
   changed, their records come from the store; a page that has none is drawn.
3. From that alone it is known whether all links lead somewhere, and which characters and
   styles the pages use.
4. A body is fetched, and framed, when its file is written.

Of a page no more is held than its key and how its sheet is made: a course may have any number.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
import operator
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

from coursebuild.effects.aside import Aside, Kept
from coursebuild.effects.store import Store
from coursebuild.effects.tool import tool_digest
from coursebuild.model import Course
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.faces import results_face
from coursebuild.pipeline.outlines import Task
from coursebuild.pipeline.page_facts import Facts, Gathered, Known, groups, pack, unpack
from coursebuild.pipeline.page_keys import PageKeys
from coursebuild.pipeline.records import (
    part,
    searched_part,
    unpack_record,
    unpack_value,
)
from coursebuild.pipeline.requests import EXPORTS, PAGES, PARTS, SECTIONS, Draw, Later
from coursebuild.render.frame import Frames, Names
from coursebuild.render.library import Library
from coursebuild.render.links import has
from coursebuild.render.own_pages import own_pages
from coursebuild.render.page_list import PageEntry, page_list
from coursebuild.render.record import PageRecord
from coursebuild.render.search.files import Entry
from coursebuild.render.shared import PageFacts
from coursebuild.render.sheet import fingerprint, sheet_bytes
from coursebuild.results import KeptFile
from coursebuild.source import key_of
from coursebuild.values import dataclass

if TYPE_CHECKING:
    from coursebuild.render.exports.page import Beside
    from coursebuild.render.exports.parts import LessonPart, OpenChapter

_SITE = "site"
"""The kind of the entries that say what the records of some pages say together."""


@dataclass(frozen=True, slots=True)
class _Wanted:
    """A page as it should be."""

    page: PageEntry
    key: str
    document: str | None
    """The path of its document."""

    @property
    def path(self) -> str:
        """Its site path."""
        return self.page.path


@dataclass(frozen=True, slots=True)
class _Page:
    wanted: _Wanted
    known: Known


class Pages:
    """The pages of a course, drawn."""

    def __init__(self, library: Library, documents: Documents, store: Store) -> None:
        self._library = library
        self._documents = documents
        self._store = store
        self._aside = documents.aside or Aside(store.folder)
        self._facts = Facts()
        self._by_path: dict[str, _Wanted] = {}
        self._beside: tuple[str, Beside] | None = None
        """What the page that was asked for last gives: two files are made of it."""
        self._sheets: dict[str, Kept] = {}
        """Of the pages without a known key, by site path, until these are drawn."""
        keys = PageKeys(store, self._around())
        self._pages = self._made(page_list(library), keys)
        self._sheets.clear()
        keys.save()

    @property
    def facts(self) -> PageFacts:
        """What the shared files must know of all pages together."""
        return self._facts.together()

    @property
    def indexed(self) -> Iterator[str]:
        """Site paths of the pages that search engines should list."""
        return (page.wanted.path for page in self._pages if page.known.indexed)

    @property
    def searched(self) -> tuple[Entry, ...]:
        """The pages that are searched, in order."""
        entries = (page.known.entry for page in self._pages)
        return tuple(entry for entry in entries if entry is not None)

    def found_by(self, path: str) -> tuple[bytes, bytes]:
        """The text and the terms that a page is found by."""
        page = self._at(path)
        data = self._store.peek(PAGES, page.key)
        text, terms = (b"", b"") if data is None else searched_part(data)
        if not text:  # it was damaged, or the store cannot be written
            searched = self._documents.drawn(self._request(page)).searched
            assert searched is not None
            text, terms = searched.text, searched.terms
        return text, terms

    def are_sound(self, files: set[str]) -> bool:
        """Whether all links of the pages lead to pages, or to files among these."""
        pages = {page.wanted.path: page for page in self._pages}
        if not self._facts.sound or not self._facts.leads.keys() <= files | pages.keys():
            return False
        for path, led in itertools.groupby(sorted(self._facts.anchors), operator.itemgetter(0)):
            if path in pages:
                ids = pages[path].known.ids
                if not all(has(ids, anchor) for _, anchor in led):
                    return False
        return True

    def files(self, names: Names) -> Iterator[KeptFile]:
        """The pages in their frames."""
        frame = hashlib.sha256(self._frame(names).encode()).hexdigest()
        frames = Frames(self._library, names)
        for page in self._pages:
            key = hashlib.sha256(f"{page.wanted.key}{frame}".encode()).hexdigest()
            make = functools.partial(self._framed, page.wanted, frames)
            yield KeptFile(page.wanted.path, key, make)

    @property
    def paths(self) -> tuple[str, ...]:
        """The site paths of all pages."""
        return tuple(page.wanted.path for page in self._pages)

    def key(self, path: str) -> str:
        """The key of a page."""
        return self._at(path).key

    def beside(self, path: str) -> Beside:
        """What a page gives to the files beside it, which are made one after the other."""
        if self._beside is None or self._beside[0] != path:
            self._beside = path, self._beside_of(path)
        return self._beside[1]

    def _beside_of(self, path: str) -> Beside:
        from coursebuild.render.exports.page import Beside

        page = self._at(path)
        found = unpack_value(self._store.peek(EXPORTS, page.key), Beside)
        return found or self._documents.drawn(self._request(page)).exports.beside

    def section(self, path: str) -> str:
        """What a lesson gives to the page of the whole course."""
        page = self._at(path)
        found = unpack_value(self._store.peek(SECTIONS, page.key), str)
        return found if found is not None else self._part(page).section

    def chapter(self, path: str) -> OpenChapter:
        """What a lesson gives to the e-book."""
        from coursebuild.render.exports.parts import OpenChapter

        page = self._at(path)
        found = unpack_value(self._store.peek(PARTS, page.key), OpenChapter)
        return found or self._part(page).chapter

    def _part(self, page: _Wanted) -> LessonPart:
        """Both, made anew: what was kept is damaged or gone."""
        part = self._documents.drawn(self._request(page)).exports.part
        assert part is not None, "a written lesson has a part"
        return part

    def _at(self, path: str) -> _Wanted:
        if not self._by_path:
            self._by_path.update((page.wanted.path, page.wanted) for page in self._pages)
        return self._by_path[path]

    # --- keys

    def _around(self) -> str | None:
        """A hash of all that sheets are made of, but for documents; `None` where it has none."""
        course = self._documents.face(self._library.course)
        if course is None:
            return None
        results = results_face(self._library.results, self._library.reports)
        return hashlib.sha256(f"{course}{results}".encode()).hexdigest()

    def _wanted(self, page: PageEntry, keys: PageKeys) -> _Wanted:
        document = page.document(self._library)
        path = None if document is None else document.source.path
        task = "" if path is None else self._documents.task(path).key
        key = keys.get(page.path, task)
        if key is None:
            sheet = page.sheet(self._library)
            assert sheet.document == path
            data = sheet_bytes(sheet)
            key = page_key(self._library.course, self._documents, path, data)
            keys.add(page.path, task, key)
            self._sheets[page.path] = self._aside.put(data)
        return _Wanted(page, key, path)

    def _request(self, wanted: _Wanted) -> Draw:
        course = self._library.course
        path = wanted.document
        task = self._documents.task(path) if path is not None else None
        kept = self._sheets.pop(wanted.path, None)
        sheet = sheet_bytes(wanted.page.sheet(self._library)) if kept is None else kept()
        return Draw(sheet, task, course.language, course.base_url, wanted.key)

    def _frame(self, names: Names) -> str:
        """All that a frame shows besides its page."""
        course, results = self._library.course, self._library.results
        shown = (
            tool_digest(),
            course.language,
            course.title,
            course.key,
            course.base_url,
            course.repository,
            course.licence,
            tuple((page.id, page.title, page.menu) for page in course.pages),
            own_pages(self._library),
            results.engine,
            results.python,
            names,
        )
        return fingerprint(shown)

    # --- records and bodies

    def _made(self, entries: Iterable[PageEntry], keys: PageKeys) -> list[_Page]:
        """The pages with what their records say; they are drawn where they have none."""
        chunks: list[tuple[tuple[_Wanted, ...], tuple[_Page, ...] | None]] = []
        packed: dict[str, bytes] = {}
        new: list[_Wanted] = []

        def is_new(page: _Wanted) -> bool:
            packed[page.key] = self._known(page.key)
            if unpack_record(packed[page.key]) is not None:
                return False
            new.append(page)
            return True

        def missing() -> Iterator[Later]:  # sheets are made while pages are drawn
            for group in groups(entries, lambda page: page.path):
                pages: list[_Wanted] = []
                whole = True
                for entry in group:
                    page = self._wanted(entry, keys)
                    pages.append(page)
                    if page.path in self._sheets and is_new(page):
                        whole = False
                        yield self._later(page)
                chunk = tuple(pages)
                known = self._gathered(chunk) if whole else None
                chunks.append((chunk, known))
                if known is None:
                    left = (page for page in chunk if page.key not in packed)
                    yield from (self._later(page) for page in left if is_new(page))

        for page, data in zip(new, self._documents.draw(missing()), strict=True):
            packed[page.key] = data
        self.drawn = tuple(page.path for page in new)
        """Site paths of the pages that were drawn just now."""
        made: list[_Page] = []
        for chunk, known in chunks:
            made += self._gather(chunk, packed) if known is None else known
        return made

    def _later(self, page: _Wanted) -> Later:
        return Later(page.document, functools.partial(self._request, page))

    def _gathered(self, pages: tuple[_Wanted, ...]) -> tuple[_Page, ...] | None:
        """These pages, where an earlier build has gathered what their records say."""
        data = None if self._store.fresh else self._store.peek(_SITE, self._name(pages))
        gathered = unpack(data, len(pages))
        return None if gathered is None else self._noted(pages, gathered)

    def _gather(self, pages: tuple[_Wanted, ...], packed: Mapping[str, bytes]) -> tuple[_Page, ...]:
        """These pages, by their records, for the next build as well."""
        gathered = Gathered.of([self._record(packed[page.key]) for page in pages])
        self._store.keep(_SITE, self._name(pages), pack(gathered), packed=True)
        return self._noted(pages, gathered)

    def _noted(self, pages: tuple[_Wanted, ...], gathered: Gathered) -> tuple[_Page, ...]:
        """These pages, now that it is known what they say."""
        self._facts.update(gathered)
        return tuple(map(_Page, pages, gathered.known(self._aside)))

    def _known(self, key: str) -> bytes:
        """A packed record; empty where there is none."""
        kept = None if self._store.fresh else self._store.peek(PAGES, key)
        return b"" if kept is None else part(kept)[0]

    def _name(self, pages: tuple[_Wanted, ...]) -> str:
        return key_of("records of pages", tool_digest(), *(page.key for page in pages))

    def _record(self, packed: bytes) -> PageRecord:
        record = unpack_record(packed)
        assert record is not None
        return record

    def _framed(self, page: _Wanted, frames: Frames) -> bytes:
        data = self._store.peek(PAGES, page.key)
        packed, body = (b"", b"") if data is None else part(data)
        record = unpack_record(packed)
        if record is None:  # it was damaged, or the store cannot be written
            drawn = self._documents.drawn(self._request(page))
            record, body = drawn.record, drawn.body.encode()
        before, after = frames.around(record.draft, record.parts)
        return before.encode() + body + after.encode()


def page_key(course: Course, documents: Documents, document: str | None, sheet: bytes) -> str:
    """A hash of all that a page depends on: its document's path and its sheet's bytes."""
    return text_page_key(course, documents.task(document) if document is not None else None, sheet)


def text_page_key(course: Course, text: Task | None, sheet: bytes) -> str:
    """The same, by the text of its document."""
    shown = hashlib.sha256(sheet).hexdigest()
    key = text.key if text is not None else ""
    return key_of(tool_digest(), course.language, course.base_url, shown, key)
