"""The pages of a site, drawn where something that they show has changed.

Entry point: `Pages`.

1. Every page has a sheet, all that it shows of the course, and a key: a hash of its sheet, of its
   document's text, and of the tool.
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
from collections.abc import Callable, Iterator, Mapping

from coursebuild.effects.aside import Aside, Kept
from coursebuild.effects.store import Store
from coursebuild.effects.tool import tool_digest
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.records import bundle, part, unbundle, unpack_record
from coursebuild.pipeline.requests import PAGES, Draw, Later
from coursebuild.render import lesson, pages
from coursebuild.render.frame import Frames, Names
from coursebuild.render.library import Library
from coursebuild.render.numerics import numerics_sheet
from coursebuild.render.record import PageRecord
from coursebuild.render.shared import PageFacts
from coursebuild.render.sheet import Sheet, fingerprint
from coursebuild.results import KeptFile
from coursebuild.values import dataclass

_SITE = "site"
"""The kind of the entry that holds the records of the last site."""


@dataclass(frozen=True, slots=True)
class _Wanted:
    """A page as it should be."""

    path: str
    """Its site path."""
    key: str
    sheet: Callable[[], Sheet]
    document: str | None
    """The path of its document."""


@dataclass(frozen=True, slots=True)
class _Page:
    wanted: _Wanted
    record: Kept
    """Packed."""
    indexed: bool


class Pages:
    """The pages of a course, drawn."""

    def __init__(self, library: Library, documents: Documents, store: Store) -> None:
        self._library = library
        self._documents = documents
        self._store = store
        self._aside = documents.aside or Aside(store.folder)
        self._facts = _Facts()
        self._pages = self._made([self._wanted(make) for make in sheets(library)])

    @property
    def facts(self) -> PageFacts:
        """What the shared files must know of all pages together."""
        return self._facts.together()

    @property
    def indexed(self) -> Iterator[str]:
        """Site paths of the pages that search engines should list."""
        return (page.wanted.path for page in self._pages if page.indexed)

    def are_sound(self, files: set[str]) -> bool:
        """Whether all links of the pages lead to pages, or to files among these."""
        pages = {page.wanted.path: page for page in self._pages}
        if not self._facts.sound or not self._facts.leads <= files | pages.keys():
            return False
        for path, anchors in self._facts.anchors.items():
            if path in pages and not anchors <= {"top", *self._record(pages[path]).ids}:
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

    # --- keys

    def _wanted(self, make: Callable[[], Sheet]) -> _Wanted:
        sheet = make()
        course = self._library.course
        task = self._documents.task(sheet.document) if sheet.document is not None else None
        parts = (
            tool_digest(),
            course.language,
            course.base_url,
            fingerprint(sheet),
            task.key if task is not None else "",
        )
        key = hashlib.sha256("\0".join(parts).encode()).hexdigest()
        return _Wanted(sheet.path, key, make, sheet.document)

    def _request(self, wanted: _Wanted) -> Draw:
        course = self._library.course
        path = wanted.document
        task = self._documents.task(path) if path is not None else None
        return Draw(wanted.sheet(), task, course.language, course.base_url, wanted.key)

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
            self._store.keep(_SITE, self._name(), bundle(packed.items()), local=True)
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
        return _Page(page, self._aside.put(packed), record.draft.indexed)

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
            record, text = self._documents.drawn(self._request(page))
            body = text.encode()
        before, after = frames.around(record.draft, record.parts)
        return before.encode() + body + after.encode()


class _Facts:
    """What is known of all pages together."""

    def __init__(self) -> None:
        self._text: set[str] = set()
        self._mathematics: set[str] = set()
        self._declarations: set[str] = set()
        self.sound = True
        """Whether every page has the anchors that it leads to itself."""
        self.leads: set[str] = set()
        """Site paths that pages lead to."""
        self.anchors: dict[str, set[str]] = {}
        """Anchors that pages lead to on others, by the site path of these."""

    def add(self, record: PageRecord) -> None:
        """Note what a page shows and where it leads."""
        self._text.update(record.text)
        self._mathematics.update(record.mathematics)
        self._declarations.update(record.declarations)
        own = {"", "top", *record.ids}
        for path, anchor in record.references:
            if path == record.draft.path:
                self.sound = self.sound and anchor in own
            else:
                self.leads.add(path)
                if anchor not in ("", "top"):
                    self.anchors.setdefault(path, set()).add(anchor)

    def together(self) -> PageFacts:
        """What the shared files must know."""
        return PageFacts(
            frozenset(self._text), frozenset(self._mathematics), frozenset(self._declarations)
        )


def sheets(library: Library) -> Iterator[Callable[[], Sheet]]:
    """What makes the sheets of all pages of a course."""
    course, partial = library.course, functools.partial
    yield partial(pages.home_sheet, library)
    for level in course.levels:
        yield partial(pages.level_sheet, library, level)
    for entry in library.order:
        if entry.document is None:
            yield partial(lesson.stub_sheet, library, entry)
        else:
            yield partial(lesson.lesson_sheet, library, entry, entry.document)
    for model in course.models:
        yield partial(pages.model_sheet, library, model)
    if library.reports.cases:
        yield partial(numerics_sheet, library)
    for page in course.pages:
        if page.document is not None:
            yield partial(pages.page_sheet, library, page, page.document)
    yield partial(pages.not_found_sheet, library)
