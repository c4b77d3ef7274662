"""The files of the site of a course as it is now; pages are drawn on demand.

A page whose document has mistakes is drawn with marks where they stand. Callers hold the session's
lock, except for `make`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError
from coursebuild.core.model import Document
from coursebuild.core.model.results import OutputFile, SiteFile
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import Mistakes
from coursebuild.core.pages.frame import FrameInputs, PageFrame
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_list import PageEntry, page_list
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.site import Site, frame_page, page_request

_MOST_PAGES = 64
"""How many pages are kept in memory with their frames."""
_MOST_SITES = 3
"""Sites whose shared files stay available: a browser may still ask for those of an older page."""


class Files:
    """The files of the site."""

    def __init__(
        self,
        options: Options,
        assets: Assets,
        reader: Reader,
        mistakes: Callable[[Document], Mistakes],
    ) -> None:
        """`mistakes` finds those of a document."""
        self._options = replace(options, jobs=1)  # a process with threads is not forked
        self._assets = assets
        self._reader = reader
        self._mistakes = mistakes
        self._library: Library | None = None
        self._entries: dict[str, PageEntry] = {}
        self._frame: PageFrame | None = None
        """There is a new frame after each change of the course or of what pages share."""
        self._framed_pages: dict[str, bytes] = {}
        """Pages in this frame, by site path."""
        self._sites: list[tuple[Site, Mapping[str, SiteFile]]] = []
        self._trial_files: Mapping[str, OutputFile] = {}
        """Features' files that pages may show before a site was made with them."""

    def show(self, library: Library) -> None:
        """Draw pages of this course from now on."""
        self._library = library
        self._trial_files = {file.path: file for file in library.trial_files}
        self._entries = {entry.path: entry for entry in page_list(library)}
        if self._sites:
            self._set_frame()
        else:  # fonts with all characters, as pages are not drawn yet
            self.serve(
                *_with_files(Site(library, self._reader, self._options, (), whole_fonts=True))
            )

    def make(
        self, library: Library, mistakes: Mapping[str, Mistakes], pause: Callable[[], None]
    ) -> tuple[Site, Mapping[str, SiteFile]]:
        """Make all files of the site; return them by path.

        `mistakes` are those of pages, by site path. `pause` is called between pages.
        """

        def entries() -> Iterator[PageEntry]:
            for entry in page_list(library):
                pause()
                yield entry

        return _with_files(Site(library, self._reader, self._options, entries(), mistakes))

    def serve(self, site: Site, files: Mapping[str, SiteFile]) -> None:
        """Serve the files of this site from now on."""
        self._sites = [*self._sites[1 - _MOST_SITES :], (site, files)]
        self._set_frame()

    def _set_frame(self) -> None:
        names = self._sites[-1][0].names
        assert self._library is not None
        self._frame = PageFrame(FrameInputs.of(self._library, names), self._assets)
        self._framed_pages.clear()

    # --- lookup

    @property
    def paths(self) -> tuple[str, ...]:
        """The paths of all files of the site that was made last."""
        return tuple(self._sites[-1][1]) if self._sites else ()

    def has_page(self, path: str) -> bool:
        """Whether the site has a page here, even one that a template fails to draw."""
        return path in self._entries

    def document(self, path: str) -> Document | None:
        """The document that a page shows, as it was last read."""
        entry = self._entries.get(path)
        return None if entry is None or self._library is None else entry.document(self._library)

    def find(self, path: str) -> bytes | None:
        """Return a file of the site, if there is one and it can be made."""
        if path in self._entries:
            if path not in self._framed_pages:
                assert self._library is not None and self._frame is not None
                document = self.document(path)
                mistakes = () if document is None else self._mistakes(document)
                request = page_request(self._entries[path], self._library, mistakes)
                page = self._reader.find_page(request.key) or self._reader.draw_page(request)
                if len(self._framed_pages) == _MOST_PAGES:
                    self._framed_pages.clear()
                self._framed_pages[path] = frame_page(page, self._frame)
            return self._framed_pages[path]
        if path in self._trial_files:
            return self._trial_files[path].data
        for site, files in reversed(self._sites):
            # Browsers may ask for shared files of an older page.
            newest = site is self._sites[-1][0]
            if path in files and (newest or path.startswith("assets/")):
                try:
                    return files[path].make()
                except EffectError:
                    return None  # gone since the course was read
        return None


def _with_files(site: Site) -> tuple[Site, Mapping[str, SiteFile]]:
    return site, {file.path: file for file in site.files}
