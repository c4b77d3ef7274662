"""The files of the site of a course as it is now; pages are drawn when they are asked for.

Entry point: `Files`.

1. `make` puts all files together as a build does, of pages and of what they share. Most are made
   when they are asked for.
2. A page that shows something else since is drawn when it is asked for. One whose document has a
   mistake stays as it was.

Callers hold the session's lock, but for `make`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError
from coursebuild.core.model import Document
from coursebuild.core.model.results import OutputFile, SiteFile
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.frame import PageFrame
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_list import PageEntry, page_list
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.pages import framed, page_request, text_of
from coursebuild.pipeline.reading import DrawnPage
from coursebuild.pipeline.site import Site, SiteMaker

_DRAWN = 64
"""Pages whose text is kept in memory."""
_SITES = 3
"""Sites whose shared files stay available: a browser may still ask for those of an older page."""


class ServedPage(Struct, frozen=True):
    """The text of a page, and what it was made from."""

    frame: PageFrame
    """Another one after each change of the course or of what pages share."""
    key: str
    page: DrawnPage
    text: bytes


class Files:
    """See the module."""

    def __init__(
        self,
        options: Options,
        assets: Assets,
        documents: Documents,
        is_sound: Callable[[Document], bool],
    ) -> None:
        """`is_sound` says whether a document can be drawn."""
        self._options = replace(options, jobs=1)  # no copies are made of a process with threads
        self._assets = assets
        self._documents = documents
        self._is_sound = is_sound
        self._library: Library | None = None
        self._entries: dict[str, PageEntry] = {}
        self._pages: dict[str, ServedPage] = {}
        self._last_good: dict[str, str] = {}
        """Keys of pages as they are in the site that was made last, by site path."""
        self._frame: PageFrame | None = None
        self._sites: list[tuple[Site, Mapping[str, SiteFile]]] = []
        self._trial_files: Mapping[str, OutputFile] = {}
        """Files of features that pages already show, though no site was made with them yet."""

    def show(self, library: Library) -> None:
        """Draw pages of this course from now on."""
        self._library = library
        self._trial_files = {file.path: file for file in library.trial_files}
        self._entries = {entry.path: entry for entry in page_list(library)}
        self._pages = {path: one for path, one in self._pages.items() if path in self._entries}
        self._last_good = {p: key for p, key in self._last_good.items() if p in self._entries}
        if self._sites:
            self._set_frame()
        else:  # whatever characters pages will have
            self.serve(self._maker(library).made((), whole_fonts=True))

    def make(self, library: Library, broken: Collection[str], pause: Callable[[], None]) -> Site:
        """All files of a site.

        `broken` are paths of pages whose documents have mistakes. `pause` is called between pages.
        """
        last_good = {path: key for path, key in self._last_good.items() if path in broken}

        def entries() -> Iterator[PageEntry]:
            for entry in page_list(library):
                if entry.path not in broken or entry.path in last_good:
                    pause()
                    yield entry

        return self._maker(library).made(entries(), last_good)

    def _maker(self, library: Library) -> SiteMaker:
        return SiteMaker(library, self._assets, self._documents, self._options)

    def serve(self, site: Site) -> None:
        """Have the files of this site from now on."""
        files = {file.path: file for file in site.files}
        self._sites = [*self._sites[1 - _SITES :], (site, files)]
        self._last_good |= {p: key for p, key in site.keys.items() if p in self._entries}
        self._set_frame()

    def _set_frame(self) -> None:
        names = self._sites[-1][0].names
        assert self._library is not None and names is not None
        self._frame = PageFrame(self._library, names)

    # --- what there is

    @property
    def paths(self) -> tuple[str, ...]:
        """The paths of all files of the site that was made last."""
        return tuple(self._sites[-1][1]) if self._sites else ()

    def has_page(self, path: str) -> bool:
        """Whether there is a page, or would be but for its mistakes."""
        return path in self._entries

    def is_kept(self, path: str) -> bool:
        """Whether a page is older than its document, which has mistakes."""
        document = self.document(path)
        drawn = path in self._pages or path in self._last_good
        return document is not None and drawn and not self._is_sound(document)

    def document(self, path: str) -> Document | None:
        """The document that a page shows, as it was last read."""
        entry = self._entries.get(path)
        return None if entry is None or self._library is None else entry.document(self._library)

    def find(self, path: str) -> bytes | None:
        """A file of the site, if there is one and it can be had."""
        if path in self._entries:
            return self._page(path)
        if path in self._trial_files:
            return self._trial_files[path].data
        for site, files in reversed(self._sites):
            # A browser may ask for what an older page shares with others.
            newest = site is self._sites[-1][0]
            if path in files and (newest or path.startswith("assets/")):
                return _data(files[path])
        return None

    def _page(self, path: str) -> bytes | None:
        """A page as it is now, or as it was when it had no mistake."""
        library, frame, known = self._library, self._frame, self._pages.pop(path, None)
        assert library is not None and frame is not None
        if known is None or known.frame is not frame:
            document = self.document(path)
            if document is None or self._is_sound(document):
                entry = self._entries[path]
                request = page_request(entry, library, text_of(entry, library))
                if known is None or known.key != request.key:
                    page = self._documents.page(request.key, lambda: request)
                else:
                    page = known.page
                known = ServedPage(frame, request.key, page, framed(page, frame))
            elif known is None:
                files = self._sites[-1][1]
                return _data(files[path]) if path in files else None
            else:
                known = replace(known, frame=frame, text=framed(known.page, frame))
        self._pages[path] = known  # as the one that was asked for last
        if len(self._pages) > _DRAWN:
            del self._pages[next(iter(self._pages))]
        return known.text


def _data(file: SiteFile) -> bytes | None:
    try:
        return file.data if isinstance(file, OutputFile) else file.make()
    except EffectError:
        return None  # gone since the course was read
