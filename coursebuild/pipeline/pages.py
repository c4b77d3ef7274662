"""The pages of a site, drawn where something that they show has changed.

Entry point: `Pages`.

1. Every page has a sheet, all that it shows of the course, and a key: a hash of its sheet, of its
   document's text, and of the tool.
2. The record of a page under its key comes from the record of the site that was put together last,
   or from the store; where it is nowhere, the page is drawn.
3. From the records alone it is known whether all links lead somewhere, and which characters and
   styles the pages use.
4. A body is fetched, and framed, when its file is written.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Iterable, Iterator, Sequence

from coursebuild.effects.store import Store
from coursebuild.effects.tool import tool_digest
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.requests import PAGES, Draw
from coursebuild.render import lesson, pages
from coursebuild.render.frame import Frames, Names
from coursebuild.render.library import Library
from coursebuild.render.links import all_lead_somewhere
from coursebuild.render.record import PageRecord
from coursebuild.render.sheet import Sheet, fingerprint
from coursebuild.results import KeptFile
from coursebuild.values import dataclass

_SITE = "site"
"""The kind of the entry that holds the records of the last site."""


@dataclass(frozen=True, slots=True)
class _Page:
    request: Draw
    record: PageRecord


class Pages:
    """The pages of a course, drawn."""

    def __init__(self, library: Library, documents: Documents, store: Store) -> None:
        self._library = library
        self._documents = documents
        self._store = store
        requests = [self._request(sheet) for sheet in sheets(library)]
        known = self._known(request.key for request in requests)
        new = [request for request in requests if request.key not in known]
        self.drawn = tuple(request.sheet.path for request in new)
        """Site paths of the pages that were drawn just now."""
        made = documents.draw(new)
        known |= {request.key: record for request, record in zip(new, made, strict=True)}
        self._pages = [_Page(request, known[request.key]) for request in requests]
        if self._last != [page.request.key for page in self._pages]:
            self._remember()

    @property
    def records(self) -> tuple[PageRecord, ...]:
        """In the order of the site."""
        return tuple(page.record for page in self._pages)

    def are_sound(self, files: set[str]) -> bool:
        """Whether all links of the pages lead to pages, or to files among these."""
        ids = {page.record.draft.path: frozenset(page.record.ids) for page in self._pages}
        paths = files | ids.keys()
        return all(all_lead_somewhere(page.record.references, paths, ids) for page in self._pages)

    def files(self, names: Names) -> Iterator[KeptFile]:
        """The pages in their frames."""
        frame = hashlib.sha256(self._frame(names).encode()).hexdigest()
        frames = Frames(self._library, names)
        for page in self._pages:
            key = hashlib.sha256(f"{page.request.key}{frame}".encode()).hexdigest()

            def make(page: _Page = page) -> bytes:
                return self._framed(page, frames)

            yield KeptFile(page.record.draft.path, key, make)

    # --- keys

    def _request(self, sheet: Sheet) -> Draw:
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
        return Draw(sheet, task, course.language, course.base_url, key)

    def _frame(self, names: Names) -> str:
        """All that a frame shows besides its page."""
        course, results = self._library.course, self._library.results
        shown = (
            tool_digest(),
            course.language,
            course.title,
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

    def _known(self, keys: Iterable[str]) -> dict[str, PageRecord]:
        """The records that there are, by key."""
        last = self._load_last()
        self._last = list(last)
        found: dict[str, PageRecord] = {}
        for key in keys:
            if key in last:
                found[key] = last[key]
            elif (kept := self._kept(key)) is not None:
                found[key] = kept[0]
        return found

    def _load_last(self) -> dict[str, PageRecord]:
        data = None if self._store.fresh else self._store.peek(_SITE, self._name())
        try:
            found = pickle.loads(data) if data is not None else {}
        except Exception:  # whatever damaged bytes make of it
            return {}
        return found if isinstance(found, dict) else {}

    def _remember(self) -> None:
        records = {page.request.key: page.record for page in self._pages}
        data = pickle.dumps(records, pickle.HIGHEST_PROTOCOL)
        self._store.keep(_SITE, self._name(), data, local=True)

    def _name(self) -> str:
        return hashlib.sha256(f"records of pages\0{tool_digest()}".encode()).hexdigest()

    def _kept(self, key: str) -> tuple[PageRecord, str] | None:
        """A record and a body from the store."""
        data = None if self._store.fresh else self._store.peek(PAGES, key)
        return None if data is None else _unpickled(data)

    def _framed(self, page: _Page, frames: Frames) -> bytes:
        data = self._store.peek(PAGES, page.request.key)
        kept = None if data is None else _unpickled(data)
        if kept is None:  # it was damaged, or the store cannot be written
            kept = self._documents.drawn(page.request)
        record, body = kept
        before, after = frames.around(record.draft, live=record.live)
        return f"{before}{body}{after}".encode()


def _unpickled(data: bytes) -> tuple[PageRecord, str] | None:
    try:
        record, body = pickle.loads(data)
    except Exception:  # whatever damaged bytes make of it
        return None
    return (record, body) if isinstance(record, PageRecord) and isinstance(body, str) else None


def sheets(library: Library) -> Iterator[Sheet]:
    """The sheets of all pages of a course."""
    course = library.course
    yield pages.home_sheet(library)
    for level in course.levels:
        yield pages.level_sheet(library, level)
    for entry in library.order:
        if entry.document is None:
            yield lesson.stub_sheet(library, entry)
        else:
            yield lesson.lesson_sheet(library, entry, entry.document)
    for model in course.models:
        yield pages.model_sheet(library, model)
    for page in course.pages:
        if page.document is not None:
            yield pages.page_sheet(library, page, page.document)
    yield pages.not_found_sheet(library)


def indexed(records: Sequence[PageRecord]) -> Iterator[str]:
    """Site paths of the pages that search engines should list."""
    return (record.draft.path for record in records if record.draft.indexed)
