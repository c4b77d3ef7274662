"""The pages of a site that changes: drawn when they are asked for, kept until they are stale.

Entry point: `Pages`.

1. `renew` says what the course is now and which pages may have changed by it.
2. `find` gives a file of the site as a build would publish it: a page is drawn if it is stale, an
   archive is packed, a file of the course is read.
3. A page with a mistake stays as it was last drawn.
4. `refresh` makes the shared files anew where the pages need other characters or styles. Until
   then pages are framed with the old ones, and those stay available, since a browser may still ask.

Nothing here is locked: whoever calls sees to that.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path
from typing import TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.effects.errors import EffectError
from coursebuild.effects.read import read_bytes
from coursebuild.model import Course, Document
from coursebuild.pipeline.preview.search import Search
from coursebuild.render import fonts, meta, urls, zips
from coursebuild.render.assets import Assets
from coursebuild.render.characters import visible
from coursebuild.render.exports.files import ExportContext, Exports, OnDemand, export_paths
from coursebuild.render.frame import Draft, Frames, Names, parts_of
from coursebuild.render.library import Library, owners
from coursebuild.render.offline import offline_files
from coursebuild.render.page_list import PageEntry, page_list
from coursebuild.render.search.files import FOLDER
from coursebuild.render.shared import PageFacts, page_facts, settled, shared_files
from coursebuild.render.site import all_facts
from coursebuild.render.tools import Tools, mark_now
from coursebuild.results import OutputFile, SiteFile

Make: TypeAlias = Callable[[], bytes | None]
"""Makes a file, if it can be had."""

_ANYTHING = PageFacts(
    frozenset(map(chr, range(0x20, 0x3000))),
    frozenset(map(chr, (*range(0x20, 0x3000), *range(0x1D400, 0x1D800)))),
    frozenset(),
)
"""For the first pages, which are shown before the others are known."""
_DRAWN = 64
"""Pages that are kept drawn."""
_MARKED = 256
"""Pieces of code that are kept marked."""
_GENERATIONS = 3
"""How many sets of shared files stay available."""


class Drawn(Struct, frozen=True):
    """A page without its frame, and the styles that were written in its elements."""

    draft: Draft
    declarations: frozenset[str]


def site_paths(course: Course) -> dict[str, str]:
    """The site path of each lesson and page, by the path of its file."""
    paths = {entry.path: urls.lesson_path(entry) for entry in course.lessons}
    return paths | {page.path: urls.page_path(page) for page in course.pages}


class Pages:
    """The site of a course as it is now."""

    def __init__(
        self,
        root: Path,
        assets: Assets,
        subset: Callable[[fonts.FontJob], bytes],
        surroundings: Callable[[Course], zips.Surroundings],
        ready: Callable[[str], bool],
        whole: Callable[[Document], Document],
        noted: Callable[[PageEntry, Library], PageFacts | None],
    ) -> None:
        """`ready` makes all that drawing a page needs; it says no to one with a mistake.

        `whole` gives a document with its text, which one that nobody edited may lack. `noted` gives
        what is known of a page as it is now, if it is known without drawing it.
        """
        self._noted = noted
        self._whole = whole
        self._root = root
        self._ready = ready
        self._assets = assets
        self._subset = subset
        self._surroundings = surroundings
        self._library: Library | None = None
        self._entries: dict[str, PageEntry] = {}
        self._ids: dict[str, str] = {}
        """Of lessons and pages, by site path."""
        self._drawn: dict[str, Drawn] = {}
        """The pages drawn last; others are drawn again when they are asked for."""
        self._held: set[str] = set()
        """Pages that are older than their documents, which have mistakes."""
        self._facts: dict[str, PageFacts] = {}
        self._stale: set[str] = set()
        self._texts: dict[str, bytes] = {}
        self._search = Search(whole)
        self._files: dict[str, Make] | None = None
        """Everything else, listed when it is first asked for."""
        self._shared_facts: PageFacts | None = None
        self._generations: list[dict[str, bytes]] = []
        self._names: Names | None = None
        self._frames: Frames | None = None
        """The frames of pages as long as no menu and no shared file is another."""
        self._tools: Tools | None = None
        self._mark = functools.lru_cache(_MARKED)(mark_now)

    # --- what the course is

    def renew(self, library: Library, stale: Collection[str] | None = None) -> None:
        """Take what the course is now; `stale` are the pages to draw anew, `None` means all."""
        self._library = library
        if stale is None:
            self._entries = {entry.path: entry for entry in page_list(library)}
            self._stale = set(self._entries)
            for gone in (self._drawn.keys() | self._facts.keys()) - self._entries.keys():
                self._drawn.pop(gone, None)
                self._facts.pop(gone, None)
                self._held.discard(gone)
            self._texts.clear()  # each has the menu of all
            self._frames = None
            course = library.course
            self._ids = {
                site: owner.id
                for owner, site in zip(owners(course), site_paths(course).values(), strict=True)
            }
        else:
            self._stale.update(stale)
        self._files = None
        self._search.renew()
        if self._names is None:
            self._share(_ANYTHING, lambda job: job.data)

    def framed(self, drawn: Drawn) -> bytes:
        """The finished text of a page of a library with the menus of this one."""
        assert self._library is not None and self._names is not None, "the course was read"
        if self._frames is None:
            self._frames = Frames(self._library, self._names)
        body = drawn.draft.body
        before, after = self._frames.around(drawn.draft, parts_of(body))
        return f"{before}{visible(body)}{after}".encode()

    def hold(self, path: str) -> None:
        """Draw a page, and keep it until it is drawn again: what comes now is not to be shown."""
        if path in self._entries and self._page(path) is not None:
            self._held.add(path)

    def put(self, path: str, drawn: Drawn, text: bytes | None = None) -> None:
        """Take a page that was drawn, and maybe framed, from the library as it is now."""
        if path in self._stale or path in self._held:
            self._search.renew()
        self._held.discard(path)
        self._drawn[path] = drawn
        if len(self._drawn) > _DRAWN + len(self._held):
            oldest = next(p for p in self._drawn if p not in self._held)
            del self._drawn[oldest]
            self._texts.pop(oldest, None)
        self._facts.pop(path, None)
        self._texts.pop(path, None)
        self._stale.discard(path)
        if text is not None:
            self._texts[path] = text

    def _other_files(self, library: Library) -> Iterator[tuple[str, Make]]:
        """Everything that is no page and is not shared by all, made when it is asked for."""
        course = library.course
        for path, (script, _) in library.scripts.items():
            yield path, functools.partial(str.encode, script.code.text)
        for model in course.models:
            yield urls.model_file_path(model.name), functools.partial(str.encode, model.source.text)
        if library.scripts:
            yield urls.EXAMPLES_ZIP, lambda: zips.course_zip(library, self._around(course)).data
        with_scripts = {owner.id for _, owner in library.scripts.values()}
        for entry in course.lessons:
            if entry.id in with_scripts:
                yield (
                    urls.lesson_zip_path(entry),
                    functools.partial(self._lesson_zip, library, entry.id),
                )
        for path in course.files:
            yield urls.file_path(path), functools.partial(read_bytes, self._root, path)
        for file in library.labs.files:
            yield file.path, functools.partial(_data, file)
        for file in offline_files(course, self._assets):
            if file.path != urls.WORKER:  # a preview is shown by nothing but its server
                yield file.path, functools.partial(_data, file)
        files = frozenset(map(urls.file_path, course.files))
        for path in export_paths(library, self._entries, files):
            yield path, functools.partial(self._exported, path)
        yield urls.ROBOTS, functools.partial(meta.robots, course)
        if course.base_url:
            yield urls.SITEMAP, self._sitemap

    def _exports(self, library: Library) -> Iterator[SiteFile]:
        """What the site gives away besides its pages."""
        around = self._around(library.course)
        taken = frozenset(map(urls.file_path, library.course.files))
        archives = zips.lesson_archives(library, around)
        context = ExportContext(archives, around.imports, taken)
        return Exports(library, OnDemand(library, self._body, self._whole), context).files()

    def _exported(self, path: str) -> bytes | None:
        """One of these files, as everything is now; none of what has mistakes."""
        library = self._library
        assert library is not None
        page = path.rpartition(".")[0] + ".html"
        needed = (page,) if page in self._entries else tuple(self._entries)
        if any(self._page(path) is None or path in self._held for path in needed):
            return None
        file = next(file for file in self._exports(library) if file.path == path)
        return file.data if isinstance(file, OutputFile) else file.make()

    def _body(self, path: str) -> str:
        drawn = self._page(path)
        return "" if drawn is None else visible(str(drawn.draft.body))

    def _around(self, course: Course) -> zips.Surroundings:
        return self._surroundings(course)

    def _lesson_zip(self, library: Library, id: str) -> bytes:
        entry = library.lessons[id]
        archive = zips.lesson_zip(library, self._around(library.course), entry)
        return b"" if archive is None else archive.data

    def _sitemap(self) -> bytes:
        assert self._library is not None
        drafts = (self._page(path) for path in self._entries)
        indexed = [drawn.draft.path for drawn in drafts if drawn and drawn.draft.indexed]
        return meta.sitemap(self._library.course, indexed)

    # --- what is asked for

    @property
    def names(self) -> Names | None:
        """The names of the shared files, by which pages are framed."""
        return self._names

    @property
    def library(self) -> Library | None:
        """The course and its results; `None` before it was read."""
        return self._library

    def base(self) -> str:
        """The path under which the published site is served, with a slash at both ends."""
        return "/" if self._library is None else urls.base_path(self._library.course)

    def document(self, path: str) -> Document | None:
        """The document that a page shows, as it was last read."""
        library, id = self._library, self._ids.get(path)
        if library is None or id is None:
            return None
        owner = library.lessons.get(id) or library.pages.get(id)
        return None if owner is None else owner.document

    def paths(self) -> tuple[str, ...]:
        """The site paths of everything that a build would publish, sorted."""
        newest = self._generations[-1].keys() if self._generations else ()
        return tuple(sorted({*self._entries, *self._others(), *newest, *self._searched()}))

    def has_page(self, path: str) -> bool:
        """Whether there is a page, or would be but for its mistakes."""
        return path in self._entries

    def find(self, path: str) -> bytes | None:
        """A file of the site, if there is one and it can be had."""
        if path in self._entries:
            return self._text(path)
        for files in reversed(self._generations):
            if path in files:
                return files[path]
        if path.startswith((urls.SEARCH_INDEX, f"{FOLDER}/")):
            return self._searched().get(path)
        make = self._others().get(path)
        try:
            return None if make is None else make()
        except EffectError:
            return None  # gone since the course was read

    def _searched(self) -> dict[str, bytes]:
        """The files of the search."""
        if self._library is None:
            return {}
        return self._search.files(self._library, self._searchable)

    def _searchable(self) -> Iterator[tuple[Draft, bool]]:
        for path in self._entries:
            drawn = self._page(path)
            if drawn is not None:
                yield drawn.draft, path not in self._held

    def _others(self) -> dict[str, Make]:
        if self._files is None:
            self._files = dict(self._other_files(self._library)) if self._library else {}
        return self._files

    def _text(self, path: str) -> bytes | None:
        drawn = self._page(path)
        if drawn is None:
            return None
        if path not in self._texts:
            self._texts[path] = self.framed(drawn)
        return self._texts[path]

    def _page(self, path: str) -> Drawn | None:
        old = self._drawn.get(path)
        if (old is None or path in self._stale) and self._ready(path):
            assert self._library is not None
            new = self.draw(path, self._library)
            if new == old:
                self._stale.discard(path)
                self._held.discard(path)
            else:
                noted = self._facts.get(path) if path not in self._stale else None
                self.put(path, new)
                if noted is not None:  # it is what it was, and was only forgotten
                    self._facts[path] = noted
        return self._drawn.get(path)

    def draw(self, path: str, library: Library) -> Drawn:
        """Draw a page (`KeyError` where there is none) of a library of the same course map."""
        tools = self._with_what_is_known(library.tools)
        return Drawn(*settled(self._entries[path].draft(library, self._whole, tools)))

    def _with_what_is_known(self, tools: Tools) -> Tools:
        """The same tools, which remember what they made for other pages."""
        old = self._tools
        same = old is not None and old.words is tools.words and old.templates is tools.templates
        around = old.around if old is not None and same else {}
        self._tools = replace(tools, mark=self._mark, around=around)
        return self._tools

    # --- what may wait

    def waiting(self) -> tuple[str, ...]:
        """The pages that are to be drawn anew."""
        return tuple(path for path in self._entries if path in self._stale)

    def prepare(self, path: str) -> None:
        """Make what looking at a page needs, so that to look at it takes half as long."""
        if not self._is_noted(path) and not self._is_known(path):
            self._ready(path)

    def look_at(self, path: str) -> None:
        """Note what the shared files must know of a page; it is drawn if that is not known."""
        drawn = None if self._is_noted(path) else self._page(path)
        if drawn is not None and path not in self._facts:
            self._facts[path] = page_facts(drawn.draft, drawn.declarations)

    def _is_noted(self, path: str) -> bool:
        """Whether what the shared files must know is that of the page as it is now."""
        there = path in self._entries
        return not there or (path in self._facts and path not in self._stale)

    def _is_known(self, path: str) -> bool:
        """Whether that is known without drawing the page: it is drawn when somebody asks for it."""
        library = self._library
        if library is None or path in self._held:
            return False
        facts = self._noted(self._entries[path], library)
        if facts is None:
            return False
        self._drawn.pop(path, None)
        self._texts.pop(path, None)
        self._stale.discard(path)
        self._search.renew()
        self._facts[path] = facts
        return True

    def unnoted(self) -> tuple[str, ...]:
        """The pages of which that is not noted yet."""
        return tuple(path for path in self._entries if path not in self._facts)

    def needed(self) -> PageFacts | None:
        """The facts for new shared files, where those that there are do not do any more."""
        if self._library is None:
            return None
        facts = all_facts(self._library, self._facts.values())
        return None if facts == self._shared_facts else facts

    def make_shared(self, facts: PageFacts) -> tuple[tuple[OutputFile, ...], Names]:
        """The shared files for these facts; this may take seconds, and changes nothing."""
        return shared_files(self._assets, self._subset, facts)

    def share(self, facts: PageFacts, files: Iterable[OutputFile], names: Names) -> None:
        """Use shared files from now on."""
        self._shared_facts = facts
        self._generations = [
            *self._generations[1 - _GENERATIONS :],
            {file.path: file.data for file in files},
        ]
        if names != self._names:
            self._names = names
            self._texts.clear()
            self._frames = None

    def _share(self, facts: PageFacts, subset: Callable[[fonts.FontJob], bytes]) -> None:
        files, names = shared_files(self._assets, subset, facts)
        self.share(facts, files, names)
        self._shared_facts = None  # the fonts were not cut


def _data(file: OutputFile) -> bytes:
    return file.data
