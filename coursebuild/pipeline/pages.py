"""The pages of a site. Only those that show something that has changed are drawn.

Entry point: `Pages`.

1. Every page has inputs, all that it shows of the course, and a key: a hash of its inputs, of its
   document's text, and of the tool. Where nothing has changed of what the inputs are made of, the
   key is that of the last build, and the inputs are not made.
2. The records of the pages of the last build are stored together, so that unchanged pages need not
   be loaded. Records of pages that were drawn earlier come from the store with their pages; a page
   that is not there is drawn.
3. The records say whether all links lead somewhere, and which characters and styles pages use.
4. A page's body is loaded, and put into its frame, when its file is written: not all bodies of a
   large course may fit into memory.
"""

from __future__ import annotations

import functools
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping

from msgspec import Struct

from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.tool import step_key
from coursebuild.core.model.results import CachedFile
from coursebuild.core.pages.added_files import NotedPage
from coursebuild.core.pages.common_files import PageFacts
from coursebuild.core.pages.frame import FrameInputs, Names, PageFrame
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.links import Reference, has_anchor
from coursebuild.core.pages.page_list import PageEntry, page_list
from coursebuild.core.pages.record import PageRecord
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Source, key_of
from coursebuild.core.values import decode
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.fingerprints import results_fingerprint
from coursebuild.pipeline.reading import PAGES, DrawnPage, PageRequest, SourceText

_INDEX = "index"
"""The kind of the entry in the store that has the records of the last build's pages."""


class SitePage(Struct, frozen=True, array_like=True):
    """A page that was drawn, now or before."""

    entry: PageEntry
    key: str
    origin: str
    """A hash of all that its inputs are made from, and of its text; empty where that is unknown.
    Where it is unchanged, so is the key."""
    record: PageRecord


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
        """Draw the pages of these entries, or all pages.

        `last_good`: the keys, by site path, of pages that stay as they were.
        """
        self._library = library
        self._documents = documents
        self._store = store
        self._last_good = last_good or {}
        self._latest: tuple[str, DrawnPage] | None = None
        """The page that was loaded last: several files are made of it."""
        self.drawn_paths: list[str] = []
        """Site paths of the pages that were drawn just now."""
        index = step_key("index of pages")
        stored_pages = store.get_value(_INDEX, index, tuple[SitePage, ...]) or ()
        self._pages = self._draw_changed(
            page_list(library) if entries is None else entries,
            {page.entry.path: page for page in stored_pages},
        )
        all_pages = tuple(self._pages.values())
        if entries is None and all_pages != stored_pages:
            store.put_value(_INDEX, index, all_pages)

    @property
    def facts(self) -> PageFacts:
        """What the shared files must know of all pages together."""
        records = [page.record for page in self._pages.values()]
        return PageFacts(
            frozenset[str]().union(*(record.text for record in records)),
            frozenset[str]().union(*(record.mathematics for record in records)),
            frozenset[str]().union(*(record.declarations for record in records)),
            frozenset[str]().union(*(record.parts for record in records)),
        )

    @property
    def keys(self) -> dict[str, str]:
        """The keys of all pages, by site path."""
        return {path: page.key for path, page in self._pages.items()}

    @property
    def indexed(self) -> Iterator[str]:
        """Site paths of the pages that search engines should list."""
        return (path for path, page in self._pages.items() if page.record.indexed)

    def noted_pages(self, feature: str) -> tuple[NotedPage, ...]:
        """The pages of which a feature has noted something, in order."""
        return tuple(
            NotedPage(path, page.record.kind, page.entry.id, page.record.title, digest)
            for path, page in self._pages.items()
            for name, digest in page.record.notes
            if name == feature
        )

    def note(self, feature: str, path: str) -> bytes:
        """What a feature has noted of one of these pages."""
        return self._load(path).notes[feature]

    def are_sound(self, files: set[str]) -> bool:
        """Whether all links of the pages lead to pages, or to files among these."""
        ids = {path: frozenset(page.record.ids) for path, page in self._pages.items()}

        def exists(path: str, anchor: str) -> bool:
            if path not in ids:
                return path in files
            return anchor in ("", "top") or has_anchor(ids[path], anchor)

        links = set[Reference]().union(*(page.record.references for page in self._pages.values()))
        return all(exists(*link) for link in links)

    def repeated_ids(self) -> Iterator[Diagnostic]:
        """Report ids that several elements of a page have."""
        for path, page in self._pages.items():
            for name, start, end in page.record.repeated_ids:
                document = page.entry.document(self._library)
                source = Source(f"public/{path}", "") if document is None else document.source
                message = f"the id `{name}` is already used on the finished page"
                help = "give one of the two another id"
                yield diagnose("anchor-repeated", source.span(start, end), message, help=help)

    def files(self, names: Names) -> Iterator[CachedFile]:
        """The pages in their frames."""
        frame = PageFrame(FrameInputs.of(self._library, names), self._library.assets)
        key = step_key("frame", frame.inputs)
        for path, page in self._pages.items():
            make = functools.partial(self._make_file, path, frame)
            yield CachedFile(path, key_of(page.key, key), make)

    def _make_file(self, path: str, frame: PageFrame) -> bytes:
        return frame_page(self._load(path), frame)

    # --- keys

    def _origins(self) -> Callable[[PageEntry, str], str]:
        """Return a function that hashes all that a page is made of: see `SitePage.origin`."""
        library = self._library
        results = results_fingerprint(library.results, library.reports)
        bare, with_notes = self._documents.fingerprints(library.course)

        def origin(entry: PageEntry, text_key: str) -> str:
            course = with_notes if entry.may_show_notes(library) else bare
            return "" if course is None else key_of(course, results, text_key)

        return origin

    # --- drawing

    def _draw_changed(
        self, entries: Iterable[PageEntry], last_pages: Mapping[str, SitePage]
    ) -> dict[str, SitePage]:
        """Return the pages by site path, in order; draw those that are not stored."""
        pages: dict[str, SitePage | None] = {}
        pending: deque[tuple[PageEntry, str, str]] = deque()
        origin_of = self._origins()

        def missing() -> Iterator[PageRequest]:  # inputs are made while pages are drawn
            for entry in entries:
                path, text = entry.path, text_of(entry, self._library)
                origin = origin_of(entry, "" if text is None else text.key)
                last_page = last_pages.get(path)
                key, request = self._last_good.get(path), None
                if key is None and last_page is not None and origin and last_page.origin == origin:
                    key = last_page.key
                if key is None:
                    request = page_request(entry, self._library)
                    key = request.key
                if last_page is not None and (last_page.key, last_page.entry) == (key, entry):
                    record: PageRecord | None = last_page.record
                else:
                    record = self._find_record(key)
                if record is not None:
                    pages[path] = SitePage(entry, key, origin, record)
                elif path not in self._last_good:  # else it is no longer in the store
                    pages[path] = None
                    pending.append((entry, key, origin))
                    yield request or page_request(entry, self._library)

        for data in self._documents.draw(missing()):
            entry, key, origin = pending.popleft()
            record = decode(data, PageRecord)
            assert record is not None
            pages[entry.path] = SitePage(entry, key, origin, record)
            self.drawn_paths.append(entry.path)
        return {path: page for path, page in pages.items() if page is not None}

    def _find_record(self, key: str) -> PageRecord | None:
        """Find the record of a page that was drawn before the last build."""
        page = self._store.get(PAGES, key, lambda data: decode(data, DrawnPage))
        return None if page is None else page.record

    def _load(self, path: str) -> DrawnPage:
        """Return a page of the site, from the store."""
        if self._latest is None or self._latest[0] != path:
            page = self._pages[path]
            make = functools.partial(page_request, page.entry, self._library)
            self._latest = path, self._documents.get_or_draw(page.key, make)
        return self._latest[1]


def frame_page(page: DrawnPage, frame: PageFrame) -> bytes:
    """Put a page into its frame, as it is published."""
    return frame.render(page.head, page.record.parts, page.body.decode()).encode()


def text_of(entry: PageEntry, library: Library) -> SourceText | None:
    """The text of the document that a page shows, if it shows one."""
    document = entry.document(library)
    if document is None:
        return None
    lesson = library.lessons.get(entry.id)
    is_lesson = lesson is not None and lesson.document is document
    course = library.course
    return SourceText.of(
        document.source, course.callout_names, lesson=is_lesson, words=course.words
    )


def page_request(entry: PageEntry, library: Library) -> PageRequest:
    """Make the request to draw a page."""
    course = library.course
    return PageRequest.of(
        entry.inputs(library),
        text_of(entry, library),
        course.language,
        course.base_url,
        course.theme.template_texts,
    )
