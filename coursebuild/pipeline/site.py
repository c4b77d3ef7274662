"""The files of a site: pages, what they share, what can be downloaded.

Entry point: `site_files(…)`.

A file that is the same as in the last site need not be made: it has a key, a hash of all that its
bytes depend on, and `core.engine.publish` makes it only where it was not published under this key.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from html import unescape
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.core.engine.memo import Memo
from coursebuild.core.files.resources import (
    Bundle,
    prepared_file,
    prepared_folder,
    template_texts,
)
from coursebuild.core.model import (
    Course,
    HtmlBlock,
    Lesson,
    RawInline,
    document_blocks,
    document_inlines,
)
from coursebuild.core.model.results import (
    CachedFile,
    FileList,
    OutputFile,
    Reports,
    Results,
    SiteFile,
)
from coursebuild.core.pages import meta, urls
from coursebuild.core.pages.added_files import SiteContext, added_files, compressed_files
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.common_files import PageFacts, common_characters, common_files
from coursebuild.core.pages.frame import Names
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_list import PageEntry
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.syntax.html import find_address
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Source, Span
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.downloads import Downloads
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.pages import Pages

if TYPE_CHECKING:
    from coursebuild.core.pages.fonts import FontJob


class Site(Struct, frozen=True):
    """A site that may be published where nothing is wrong with it."""

    files: tuple[SiteFile, ...]
    """Sorted by path."""
    file_list: FileList | None
    """The list of all files, if a feature adds one."""
    diagnostics: tuple[Diagnostic, ...]
    drawn_pages: tuple[str, ...]
    """Site paths of the pages that were drawn for it, since they had changed."""
    names: Names | None = None
    """The names of the files that all pages share."""
    keys: Mapping[str, str] = field(default_factory=dict)
    """The keys of pages, by site path."""


def site_files(
    course: Course, results: Results, documents: Documents, options: Options, reports: Reports
) -> Site:
    """Make the site of a course whose documents are summaries; its pages show the `reports`."""
    assets = Assets(template_texts(), Bundle(), prepared_folder())
    library = Library(course, results, assets, reports)
    return SiteMaker(library, assets, documents, options).make_site()


_FACTS_OF_ANY_PAGE = PageFacts(
    frozenset(map(chr, range(0x20, 0x3000))),
    frozenset(map(chr, (*range(0x20, 0x3000), *range(0x1D400, 0x1D800)))),
    frozenset(),
)
"""What pages that are not drawn yet may need."""


class SiteMaker:
    """Puts the files of a site together."""

    def __init__(
        self, library: Library, assets: Assets, documents: Documents, options: Options
    ) -> None:
        self.library = library
        self.course = library.course
        self.assets = assets
        self.root = options.root
        self.store = options.store
        self.documents = documents

    def make_site(
        self,
        entries: Iterable[PageEntry] | None = None,
        last_good: Mapping[str, str] | None = None,
        *,
        whole_fonts: bool = False,
    ) -> Site:
        """Make the site, or some of its pages with all other files; then links are not checked.

        See `Pages` for the arguments. `whole_fonts`: leave fonts whole, for pages drawn later.
        """
        pages = Pages(self.library, self.documents, self.store, entries, last_good)
        self.documents.stop_workers()
        names, shared_files = self._make_shared_files(None if whole_fonts else pages.facts)
        trial_files = self.library.trials.files
        downloads = Downloads.of(self.library, self.assets, self.documents, self.root, self.store)
        files: list[SiteFile] = [
            *shared_files,
            *trial_files,
            *self._copies(trial_files),
            *downloads.files,
        ]
        context = functools.partial(self._context, pages, names, downloads)
        files_added, file_list = added_files(context)
        files += [*files_added, OutputFile(urls.ROBOTS, meta.robots(self.course))]
        if self.course.base_url:
            files.append(OutputFile(urls.SITEMAP, meta.sitemap(self.course, pages.indexed)))
        page_files = tuple(pages.files(names))
        diagnostics = tuple(pages.repeated_ids())
        if entries is None and not pages.are_sound({file.path for file in files}):
            diagnostics += tuple(broken_links(self.course, [*page_files, *files]))
        all_files = tuple(sorted((*page_files, *files), key=lambda file: file.path))
        return Site(all_files, file_list, diagnostics, tuple(pages.drawn_paths), names, pages.keys)

    # --- what all pages share

    def _make_shared_files(self, facts: PageFacts | None) -> tuple[Names, list[SiteFile]]:
        """Make the shared files; with whole fonts where there are no facts."""
        cut_font = None if facts is None else functools.partial(_cut_font, self.store)
        facts = facts or _FACTS_OF_ANY_PAGE
        facts = replace(facts, text=facts.text | common_characters(self.library))
        shared_files, names = common_files(self.assets, cut_font, facts, self.course.theme)
        return names, [*shared_files, *self._copies(shared_files)]

    def _copies(self, files: Iterable[SiteFile]) -> tuple[CachedFile, ...]:
        """Make compressed copies."""

        def keep(key: str, make: Callable[[], bytes]) -> bytes:
            return prepared_file("copies", key) or self.store.get_or_create("compressed", key, make)

        return compressed_files(files, keep)

    def _context(
        self,
        pages: Pages,
        names: Names,
        downloads: Downloads,
        feature: str,
    ) -> SiteContext:
        """Return what a feature makes its files from."""
        return SiteContext(
            self.library,
            self.assets,
            names,
            pages.noted_pages(feature),
            functools.partial(pages.note, feature),
            functools.partial(self.store.get_or_create, "parts"),
            downloads.archives,
            downloads.imports,
        )


def _cut_font(store: Memo, job: FontJob) -> bytes:
    """Return a cut font: delivered with the tool, stored, or cut now."""

    def make() -> bytes:
        from coursebuild.core.pages.fonts import subset_font

        return subset_font(job)

    return prepared_file("fonts", job.key) or store.get_or_create("fonts", job.key, make)


def broken_links(course: Course, files: Sequence[SiteFile]) -> Iterator[Diagnostic]:
    """Find links of built pages that lead nowhere; most are found in the sources already.

    The place is that of the raw HTML that wrote the link; of other links, the place in the page.
    """
    from coursebuild.core.pages.links import check_links

    pages = {
        file.path: file.data if isinstance(file, OutputFile) else file.make()
        for file in files
        if file.path.endswith(".html")
    }
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
        lesson = isinstance(owner, Lesson)
        document = parse_document(
            summary.source, course.callout_names, lesson=lesson, words=course.words
        ).value
        for node in (*document_blocks(document), *document_inlines(document)):
            if isinstance(node, HtmlBlock | RawInline) and (at := find_address(node.html, url)):
                # In a quiz it is a part of JSON, in a quote of lines with marks.
                value = node.html[slice(*at)]
                start = at[0] if node.html == node.span.text else node.span.text.find(value)
                source, first = node.span.source, node.span.start + start
                return source.span(first, first + len(value)) if start >= 0 else node.span
    return None
