"""From a course, its results and its summaries to the files of its site.

1. Every page has inputs, all that it shows of the course, and a key: a hash of its inputs, of its
   document's text, and of the tool. Where nothing has changed of what the inputs are made of, the
   key is that of the last build, and the inputs are not made.
2. The records of the last build's pages are stored together, so that unchanged pages need not be
   loaded. They say whether all links lead somewhere, and which characters and styles pages use.
3. Every file has a key, too. `core.engine.publish` makes it only where it was not published under
   this key. A page's body is loaded then: not all bodies of a large course may fit into memory.
"""

from __future__ import annotations

import functools
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from html import unescape

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.tool import step_key
from coursebuild.core.files.resources import prepared_file
from coursebuild.core.model import (
    Course,
    HtmlBlock,
    RawInline,
    document_blocks,
    document_inlines,
)
from coursebuild.core.model.results import CachedFile, FileList, OutputFile, SiteFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.assets import Names, compressed_files
from coursebuild.core.pages.context import Mistakes, NotedPage, PageRecord, SiteContext
from coursebuild.core.pages.frame import (
    FrameInputs,
    PageFrame,
    robots,
    sitemap,
    versions,
)
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.materials import in_language
from coursebuild.core.pages.page_list import PageEntry, page_list
from coursebuild.core.pages.record import (
    PageFacts,
    common_characters,
    common_files,
)
from coursebuild.core.pages.references import Reference, check_links, has_anchor
from coursebuild.core.pages.theme import FontJob, subset_font
from coursebuild.core.pages.zips import Archive
from coursebuild.core.registry import features, parts_by_mark
from coursebuild.core.syntax.document import read_again
from coursebuild.core.syntax.html import find_address
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.python_code import find_imports
from coursebuild.core.text.source import Source, Span, key_of
from coursebuild.pipeline.downloads import download_files
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.requests import (
    DrawnPage,
    PageRequest,
    SourceText,
    results_fingerprint,
)
from coursebuild.pipeline.script_downloads import make_archives

_INDEX = "index"
"""The kind of the entry in the store that has the records of the last build's pages."""
_FACTS_OF_ANY_PAGE = PageFacts(
    frozenset(map(chr, range(0x20, 0x3000))),
    frozenset(map(chr, (*range(0x20, 0x3000), *range(0x1D400, 0x1D800)))),
    frozenset(),
    frozenset(),
)
"""What pages that are not drawn yet may need."""


class _IndexEntry(Struct, frozen=True, array_like=True):
    """A page that was drawn, now or before."""

    page: PageEntry
    key: str
    origin: str
    """A hash of all that its inputs are made from, and of its text; empty where that is unknown.
    Where it is unchanged, so is the key."""
    record: PageRecord


class Site:
    """The site of a course: its pages, what they share, what features add, what can be downloaded.

    Pages that have changed are drawn at once, everything else is made when it is first asked for.
    """

    def __init__(
        self,
        library: Library,
        reader: Reader,
        options: Options,
        entries: Iterable[PageEntry] | None = None,
        mistakes: Mapping[str, Mistakes] | None = None,
        *,
        whole_fonts: bool = False,
    ) -> None:
        """Draw the pages that have changed of a course that the reader has read.

        `entries`: only these pages; then links are not checked. `mistakes`: those of the documents
        of pages that are drawn all the same, by site path. `whole_fonts`: leave fonts whole, for
        pages drawn later.
        """
        self._library = library
        self._reader = reader
        self._options, self._store = options, options.store
        self._has_all_pages, self._whole_fonts = entries is None, whole_fonts
        self._mistakes = mistakes or {}
        self._latest: tuple[str, DrawnPage] | None = None
        """The page that was loaded last: several files are made of it."""
        self.drawn_paths: list[str] = []
        """Site paths of the pages that were drawn just now."""
        index = step_key("index of pages")
        last_pages = self._store.get_value(_INDEX, index, tuple[_IndexEntry, ...]) or ()
        self._pages = self._draw_changed(
            page_list(library) if entries is None else entries,
            {entry.page.path: entry for entry in last_pages},
        )
        all_pages = tuple(self._pages.values())
        if entries is None and all_pages != last_pages:
            self._store.put_value(_INDEX, index, all_pages)
        reader.close()

    @property
    def keys(self) -> dict[str, str]:
        """The keys of all pages, by site path."""
        return {path: entry.key for path, entry in self._pages.items()}

    # --- pages

    def _draw_changed(
        self, pages: Iterable[PageEntry], last_pages: Mapping[str, _IndexEntry]
    ) -> dict[str, _IndexEntry]:
        known_pages: dict[str, _IndexEntry | None] = {}
        pending: deque[tuple[PageEntry, str, str]] = deque()
        library = self._library
        results = results_fingerprint(library.results, library.reports)
        bare, with_notes = self._reader.fingerprints(library.course)

        def missing() -> Iterator[PageRequest]:  # inputs are made while pages are drawn
            for page in pages:
                path, text = page.path, text_of(page, library)
                course = with_notes if page.may_show_notes(library) else bare
                text_key = "" if text is None else text.key
                origin = "" if course is None else key_of(course, results, text_key)
                last = last_pages.get(path)
                mistakes = self._mistakes.get(path, ())
                request, is_known = None, last is not None and origin and last.origin == origin
                if last is not None and is_known and not mistakes:
                    key = last.key
                else:
                    request = page_request(page, library, mistakes)
                    key = request.key
                if last is not None and (last.key, last.page) == (key, page):
                    record: PageRecord | None = last.record
                else:  # drawn before the last build, perhaps
                    stored_page = None if self._store.fresh else self._reader.find_page(key)
                    record = None if stored_page is None else stored_page.record
                if record is not None:
                    known_pages[path] = _IndexEntry(page, key, origin, record)
                else:
                    known_pages[path] = None
                    pending.append((page, key, origin))
                    yield request or page_request(page, library)

        for record in self._reader.draw(missing()):
            page, key, origin = pending.popleft()
            known_pages[page.path] = _IndexEntry(page, key, origin, record)
            self.drawn_paths.append(page.path)
        return {path: entry for path, entry in known_pages.items() if entry is not None}

    def _load(self, path: str) -> DrawnPage:
        if self._latest is None or self._latest[0] != path:
            entry = self._pages[path]
            page = self._reader.find_page(entry.key)
            if page is None:
                mistakes = self._mistakes.get(path, ())
                page = self._reader.draw_page(page_request(entry.page, self._library, mistakes))
            self._latest = path, page
        return self._latest[1]

    def _page_files(self) -> Iterator[CachedFile]:
        frame = PageFrame(FrameInputs.of(self._library, self.names), self._library.assets)
        frame_key = step_key("frame", frame.inputs)

        def make(path: str) -> bytes:
            return frame_page(self._load(path), frame)

        for path, entry in self._pages.items():
            yield CachedFile(path, key_of(entry.key, frame_key), functools.partial(make, path))

    # --- all files

    @property
    def names(self) -> Names:
        """The names of the files that all pages share."""
        return self._shared_files[1]

    @property
    def file_list(self) -> FileList | None:
        """The list of all files, if a feature adds one."""
        return self._added_files[1]

    @functools.cached_property
    def files(self) -> tuple[SiteFile, ...]:
        """All files but that list, sorted by path."""
        course, trial_files = self._library.course, self._library.trial_files
        files: list[SiteFile] = [*self._shared_files[0], *trial_files]

        def keep(key: str, make: Callable[[], bytes]) -> bytes:
            return prepared_file("copies", key) or self._store.get_or_make("compressed", key, make)

        files += compressed_files(files, keep)
        files += download_files(self._library, self._archives.values(), self._options.root)
        files += (*self._added_files[0], *self._page_files())
        files.append(OutputFile(urls.ROBOTS, robots(course)))
        if course.version:
            files.append(OutputFile(urls.VERSIONS, versions(course)))
        if course.base_url:
            indexed = (path for path, entry in self._pages.items() if entry.record.indexed)
            files.append(OutputFile(urls.SITEMAP, sitemap(course, indexed)))
        return tuple(sorted(files, key=lambda file: file.path))

    @functools.cached_property
    def _shared_files(self) -> tuple[Sequence[SiteFile], Names]:
        library = self._library
        records = [entry.record for entry in self._pages.values()]
        facts, cut_font = _FACTS_OF_ANY_PAGE, None
        if not self._whole_fonts:
            cut_font = self._cut_font
            facts = PageFacts(
                frozenset[str]().union(*(record.text for record in records)),
                frozenset[str]().union(*(record.mathematics for record in records)),
                frozenset[str]().union(*(record.declarations for record in records)),
                frozenset[str]().union(*(record.parts for record in records)),
            )
        facts = replace(facts, text=facts.text | common_characters(library, facts.parts))
        if not self._has_all_pages:  # a page drawn later may have any part
            facts = replace(facts, parts=frozenset(parts_by_mark()))
        return common_files(library.assets, cut_font, facts, library.course.theme)

    def _cut_font(self, job: FontJob) -> bytes:
        make = functools.partial(subset_font, job)
        return prepared_file("fonts", job.key) or self._store.get_or_make("fonts", job.key, make)

    @functools.cached_property
    def _archives(self) -> Mapping[str, Archive]:
        """The archives of scripts, by site path."""
        options = self._options.for_course(self._library.course)
        archives = make_archives(self._library, options, self._reader.imports)
        return {archive.path: archive for archive in archives}

    @functools.cached_property
    def _added_files(self) -> tuple[list[SiteFile], FileList | None]:
        files: list[SiteFile] = []
        file_list: FileList | None = None
        for feature in features():
            if feature.files is None:
                continue
            for file in feature.files(self._context(feature.name)):
                if isinstance(file, FileList):
                    file_list = file
                else:
                    files.append(file)
        return files, file_list

    def _context(self, feature: str) -> SiteContext:
        return SiteContext(
            self._library,
            self._library.assets,
            self.names,
            tuple(
                NotedPage(path, entry.record.kind, entry.page.id, entry.record.title, digest)
                for path, entry in self._pages.items()
                for name, digest in entry.record.notes
                if name == feature
            ),
            lambda path: self._load(path).notes[feature],
            functools.partial(self._store.get_or_make, "parts"),
            self._archives,
            find_imports,
        )

    # --- what is wrong with them

    @functools.cached_property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """What is wrong with the finished pages: ids that stand there twice, broken links."""
        diagnostics: list[Diagnostic] = []
        for path, entry in self._pages.items():
            for name, start, end in entry.record.repeated_ids:
                document = entry.page.document(self._library)
                source = Source(f"public/{path}", "") if document is None else document.source
                message = f"the id `{name}` is already used on the finished page"
                help = "give one of the two another id"
                span = source.span(start, end)
                diagnostics.append(diagnose("anchor-repeated", span, message, help=help))
        if not self._has_all_pages:
            return tuple(diagnostics)
        ids = {path: frozenset(entry.record.ids) for path, entry in self._pages.items()}
        paths = {file.path for file in self.files}
        links = set[Reference]().union(*(entry.record.references for entry in self._pages.values()))
        are_sound = all(
            path in paths
            if path not in ids
            else anchor in ("", "top") or has_anchor(ids[path], anchor)
            for path, anchor in links
        )
        if not are_sound:
            diagnostics += broken_links(self._library.course, self.files)
        return tuple(diagnostics)


def frame_page(page: DrawnPage, frame: PageFrame) -> bytes:
    """Put a page into its frame, as it is published."""
    return frame.render(page.head, page.record.parts, page.body.decode()).encode()


def text_of(entry: PageEntry, library: Library) -> SourceText | None:
    """The text of the document that a page shows, if it shows one."""
    document = entry.document(library)
    if document is None:
        return None
    is_lesson, course = entry.kind == "lesson", library.course
    owner = library.lessons[entry.id] if is_lesson else library.pages[entry.id]
    return SourceText.of(
        document.source, course.callout_names, lesson=is_lesson, words=course.words_of(owner)
    )


def page_request(entry: PageEntry, library: Library, mistakes: Mistakes = ()) -> PageRequest:
    """Make the request to draw a page."""
    course = library.course
    owner = library.pages.get(entry.id) if entry.kind == "page" else library.lessons.get(entry.id)
    language = course.language if owner is None else course.language_of(owner)
    inputs = entry.inputs(in_language(library, language))
    return PageRequest.of(
        inputs,
        text_of(entry, library),
        language,
        course.base_url,
        course.theme.template_texts,
        is_manual=course.is_manual,
        mistakes=mistakes,
    )


def broken_links(course: Course, files: Sequence[SiteFile]) -> Iterator[Diagnostic]:
    """Find links of built pages that lead nowhere; most are found in the sources already.

    The place is that of the raw HTML that wrote the link; of other links, the place in the page.
    """
    pages = {file.path: file.make() for file in files if file.path.endswith(".html")}
    listed_files = (OutputFile(file.path, pages.get(file.path, b"")) for file in files)
    for broken in check_links(listed_files, course.base_url):
        span = _find_in_texts(course, broken.page, broken.url)
        if span is None:
            page = Source(f"public/{broken.page}", pages[broken.page].decode())
            span = page.span(*(find_address(page.text, broken.url) or (0, 0)))
        help = f"did you mean `{broken.suggestion}`?" if broken.suggestion else ""
        message = f"`{broken.url}` leads nowhere: {broken.reason}"
        yield diagnose("link-broken", span, message, help=help)


def _find_in_texts(course: Course, page: str, url: str) -> Span | None:
    """Find the raw HTML with an address: in the text of a page, else in one shown there."""
    owned = sorted(course.owned_documents, key=lambda pair: urls.owner_path(pair[0]) != page)
    for owner, summary in owned:
        if url not in unescape(summary.source.text):
            continue
        document = read_again(course, owner, summary)
        for node in (*document_blocks(document), *document_inlines(document)):
            if isinstance(node, HtmlBlock | RawInline) and (at := find_address(node.html, url)):
                # In a quiz it is a part of JSON, in a quote of lines with marks.
                value = node.html[slice(*at)]
                start = at[0] if node.html == node.span.text else node.span.text.find(value)
                source, first = node.span.source, node.span.start + start
                return source.span(first, first + len(value)) if start >= 0 else node.span
    return None
