"""The pages of a site, drawn where something that they show has changed.

Entry point: `Pages`.

1. Every page has a sheet, all that it shows of the course, and a key: a hash of its sheet, of its
   document's text, and of the tool.
   Where nothing has changed of what sheets are made of, the key is known without (`page_keys`).
2. The record of a page under its key comes from the record of the site that was put together last,
   or from the store; where it is nowhere, the page is drawn.
3. From the records alone it is known whether all links lead somewhere, and which characters and
   styles the pages use.
4. A body is fetched, and framed, when its file is written.

Of a page no more is held than its key and how its sheet is made: a course may have any number.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
import operator
import sys
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from coursebuild.effects.aside import Aside, Kept
from coursebuild.effects.store import Store
from coursebuild.effects.tool import tool_digest
from coursebuild.model import Course
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.faces import results_face
from coursebuild.pipeline.page_keys import PageKeys
from coursebuild.pipeline.records import (
    bundle,
    part,
    searched_part,
    unbundle,
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
from coursebuild.render.sheet import Sheet, fingerprint
from coursebuild.results import KeptFile
from coursebuild.values import dataclass

if TYPE_CHECKING:
    from coursebuild.render.exports.page import Beside
    from coursebuild.render.exports.parts import LessonPart, OpenChapter

_SITE = "site"
"""The kind of the entry that holds the records of the last site."""


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
    record: Kept
    """Packed."""
    indexed: bool
    entry: Entry | None
    """Where it is searched."""


class Pages:
    """The pages of a course, drawn."""

    def __init__(self, library: Library, documents: Documents, store: Store) -> None:
        self._library = library
        self._documents = documents
        self._store = store
        self._aside = documents.aside or Aside(store.folder)
        self._facts = _Facts()
        self._by_path: dict[str, _Wanted] = {}
        keys = PageKeys(store, self._around())
        self._pages = self._made([self._wanted(page, keys) for page in page_list(library)])
        keys.save()

    @property
    def facts(self) -> PageFacts:
        """What the shared files must know of all pages together."""
        return self._facts.together()

    @property
    def indexed(self) -> Iterator[str]:
        """Site paths of the pages that search engines should list."""
        return (page.wanted.path for page in self._pages if page.indexed)

    @property
    def searched(self) -> tuple[Entry, ...]:
        """The pages that are searched, in order."""
        return tuple(page.entry for page in self._pages if page.entry is not None)

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
                ids = frozenset(self._record(pages[path]).ids)
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
        """What a page gives to the files beside it."""
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
            key = page_key(self._library.course, self._documents, sheet)
            keys.add(page.path, task, key)
        return _Wanted(page, key, path)

    def _request(self, wanted: _Wanted) -> Draw:
        course = self._library.course
        path = wanted.document
        task = self._documents.task(path) if path is not None else None
        return Draw(
            wanted.page.sheet(self._library), task, course.language, course.base_url, wanted.key
        )

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

    def _made(self, pages: list[_Wanted]) -> list[_Page]:
        """The pages with their records, which are drawn where they are nowhere."""
        last = self._load_last()
        packed = {page.key: self._known(page.key, last) for page in pages}
        found = {page.key: made for page in pages if (made := self._noted(page, packed[page.key]))}
        new = [page for page in pages if page.key not in found]
        self.drawn = tuple(page.path for page in new)
        """Site paths of the pages that were drawn just now."""
        later = [Later(p.document, functools.partial(self._request, p)) for p in new]
        for page, data in zip(new, self._documents.draw(later), strict=True):
            packed[page.key] = data
            made = self._noted(page, data)
            assert made is not None
            found[page.key] = made
        if list(last) != list(packed):
            self._store.keep(_SITE, self._name(), bundle(packed.items()), packed=True)
        return [found[page.key] for page in pages]

    def _known(self, key: str, last: Mapping[str, bytes]) -> bytes:
        """A packed record; empty where there is none."""
        data = last.get(key)
        if data is None and not self._store.fresh:
            kept = self._store.peek(PAGES, key)
            data = None if kept is None else part(kept)[0]
        return data or b""

    def _noted(self, page: _Wanted, packed: bytes) -> _Page | None:
        """A page whose record can be read, now that it is known what it says."""
        record = unpack_record(packed) if packed else None
        if record is None:
            return None
        self._facts.add(record)
        kept, draft = self._aside.put(packed), record.draft
        entry = None
        if record.search is not None:
            name, digest = record.search
            # Of what a record says twice or as others do, no copy is held.
            entry = Entry(page.path, sys.intern(draft.kind), draft.title, name, digest)
        return _Page(page, kept, draft.indexed, entry)

    def _load_last(self) -> dict[str, bytes]:
        data = None if self._store.fresh else self._store.peek(_SITE, self._name())
        return {} if data is None else unbundle(data)

    def _name(self) -> str:
        return hashlib.sha256(f"records of pages\0{tool_digest()}".encode()).hexdigest()

    def _record(self, page: _Page) -> PageRecord:
        record = unpack_record(page.record())
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


def page_key(course: Course, documents: Documents, sheet: Sheet) -> str:
    """A hash of all that a page depends on."""
    task = documents.task(sheet.document) if sheet.document is not None else None
    parts = (
        tool_digest(),
        course.language,
        course.base_url,
        fingerprint(sheet),
        task.key if task is not None else "",
    )
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


class _Facts:
    """What is known of all pages together."""

    def __init__(self) -> None:
        self._text: set[str] = set()
        self._mathematics: set[str] = set()
        self._declarations: set[str] = set()
        self.sound = True
        """Whether every page has the anchors that it leads to itself."""
        self.leads: dict[str, str] = {}
        """Site paths that pages lead to, each by itself, so that none is held twice."""
        self.anchors: set[tuple[str, str]] = set()
        """Anchors that pages lead to on others, each after the site path of its page."""

    def add(self, record: PageRecord) -> None:
        """Note what a page shows and where it leads."""
        self._text.update(record.text)
        self._mathematics.update(record.mathematics)
        self._declarations.update(record.declarations)
        own = {"", "top", *record.ids}
        for path, anchor in record.references:
            if path == record.draft.path:
                self.sound = self.sound and has(own, anchor)
            else:
                path = self.leads.setdefault(path, path)
                if anchor not in ("", "top"):
                    self.anchors.add((path, sys.intern(anchor)))

    def together(self) -> PageFacts:
        """What the shared files must know."""
        return PageFacts(
            frozenset(self._text), frozenset(self._mathematics), frozenset(self._declarations)
        )
