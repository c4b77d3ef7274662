"""The files of a site: pages, what they share, what can be downloaded.

Entry point: `site_files(…)`.

A file that is the same as in the site of before need not be made: it has a key, a hash of all that
its bytes depend on, and `core.engine.publish` makes it only where it was not published under
this key.
"""

from __future__ import annotations

import functools
import hashlib
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.core.engine.digests import Digests
from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.prepared import (
    prepared_copy,
    prepared_cut,
    prepared_folder,
    prepared_source,
)
from coursebuild.core.engine.tool import step_key
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.resources import Bundle, template_texts
from coursebuild.core.model import Course
from coursebuild.core.model.results import CachedFile, FileList, OutputFile, Results, SiteFile
from coursebuild.core.pages import meta, urls, zips
from coursebuild.core.pages.added_files import SiteContext, added_files
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.compressed import COPIES, compressed_files, kept_copy
from coursebuild.core.pages.frame import Names
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_list import PageEntry
from coursebuild.core.pages.shared import PageFacts, common_characters
from coursebuild.core.run.packages import distributions, library_files
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Excerpt, Source, key_of, text_digest
from coursebuild.numerics.reports import Reports
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.pages import Pages
from coursebuild.pipeline.tasks import all_imports

if TYPE_CHECKING:
    from coursebuild.core.pages.fonts import FontJob

_SHARED, _SHARED_DATA = "shared", "shared-data"
"""Kinds of entries in the store: the names of what all pages share, and its bytes."""
_PARTS = "parts"
"""Kind of the entries that hold parts of what features add to a site."""
_DIGEST = hashlib.sha256().digest_size * 2


class Site(Struct, frozen=True):
    """A site that may be published where nothing is wrong with it."""

    files: tuple[SiteFile, ...]
    """Sorted by path."""
    listed: FileList | None
    """The list of them all, where there is one."""
    diagnostics: tuple[Diagnostic, ...]
    drawn: tuple[str, ...]
    """The pages that were drawn just now, and not before."""
    names: Names | None = None
    """Of what all pages share."""
    keys: Mapping[str, str] = field(default_factory=dict)
    """The keys of pages, by site path."""


def site_files(
    course: Course, results: Results, documents: Documents, options: Options, reports: Reports
) -> Site:
    """The site of a course whose documents are summaries; `reports` are those that it shows."""
    assets = Assets(template_texts(), Bundle(), prepared_folder())
    library = Library.of(course, results, assets, reports)
    return SiteMaker(library, assets, documents, options).made()


_ANYTHING = PageFacts(
    frozenset(map(chr, range(0x20, 0x3000))),
    frozenset(map(chr, (*range(0x20, 0x3000), *range(0x1D400, 0x1D800)))),
    frozenset(),
)
"""What pages may need that nobody has looked at."""


def _whole(job: FontJob) -> bytes:
    return job.data


class SiteMaker:
    """Puts the files of a site together."""

    def __init__(
        self, library: Library, assets: Assets, documents: Documents, options: Options
    ) -> None:
        self.library = library
        self.course = library.course
        self.assets = assets
        self.options = options
        self.store = options.store
        self.documents = documents
        self._packed: dict[str, tuple[str, zips.MakeArchive]] = {}
        """The archives, with their keys."""
        self._imports: Callable[[str], frozenset[str]] = zips.imports
        self._files: dict[str, tuple[str, Callable[[], bytes]]] = {}
        """Files of the course, with their keys."""

    def made(
        self,
        entries: Iterable[PageEntry] | None = None,
        last_good: Mapping[str, str] | None = None,
        *,
        whole_fonts: bool = False,
    ) -> Site:
        """The site, or some pages of it with all other files: these are not checked for links.

        For the arguments see `Pages`. `whole_fonts` serve pages that are drawn later.
        """
        pages = Pages(self.library, self.documents, self.store, entries, last_good)
        self.documents.rest()
        names, shared = self._shared(None if whole_fonts else pages.facts)
        files = [*self._feature_files(), *self._downloads()]
        added, listed = added_files(functools.partial(self._context, pages, names))
        files += [*added, *shared]
        files.append(OutputFile(urls.ROBOTS, meta.robots(self.course)))
        if self.course.base_url:
            sitemap = meta.sitemap(self.course, pages.indexed)
            files.append(OutputFile(urls.SITEMAP, sitemap))
        framed = tuple(pages.files(names))
        found: tuple[Diagnostic, ...] = ()
        if entries is None and not pages.are_sound({file.path for file in files}):
            found = tuple(broken_links([*framed, *files], self.course.base_url))
        everything = tuple(sorted((*framed, *files), key=lambda file: file.path))
        return Site(everything, listed, found, pages.drawn, names, pages.keys)

    # --- what all pages share

    def _shared(self, facts: PageFacts | None) -> tuple[Names, list[SiteFile]]:
        """The shared files, made only for characters and styles for which they were not made.

        With whole fonts where there are no facts.
        """
        if facts is None:
            facts, cut = _ANYTHING, _whole
        else:
            facts = replace(facts, text=facts.text | common_characters(self.library))
            cut = functools.partial(_cut_font, self.store)
        key = step_key("shared files", facts, cut is _whole)
        data = _Data(self.store, key, functools.partial(self._make_shared, facts, cut))
        names, paths = data.listing()
        files = [CachedFile(p, key_of(data.key, p), functools.partial(data.file, p)) for p in paths]
        # Those of the style sheet, which is another in every course, are made where files are made
        # at the same time. They are smaller in any case: most of it is the same everywhere.
        for suffix in COPIES:
            path = f"{names.style}.{suffix}"
            make = functools.partial(self._copy, data, names.style, suffix)
            files.append(CachedFile(path, key_of(data.key, path), make))
        return names, [*files]

    def _make_shared(
        self, facts: PageFacts, cut: Callable[[FontJob], bytes]
    ) -> tuple[Names, dict[str, bytes]]:
        from coursebuild.core.pages.shared import shared_files

        made, names = shared_files(self.assets, cut, facts)
        copies = self._copies(file for file in made if file.path != names.style)
        return names, {file.path: file.data for file in (*made, *copies)}

    def _copy(self, data: _Data, path: str, suffix: str) -> bytes:
        # Local: a copy of this process does not live until a shared cache has it.
        keep = functools.partial(self._kept_copy, local=True)
        return kept_copy(data.file(path), suffix, keep)

    def _copies(self, files: Iterable[OutputFile]) -> tuple[OutputFile, ...]:
        return compressed_files(files, self._kept_copy)

    def _kept_copy(self, key: str, make: Callable[[], bytes], *, local: bool = False) -> bytes:
        return prepared_copy(key) or self.store.get_or_create("compressed", key, make, local=local)

    def _feature_files(self) -> list[SiteFile]:
        files = self.library.feature_files
        return [*files, *self._copies(files)]

    def _context(self, pages: Pages, names: Names, feature: str) -> SiteContext:
        """What a feature makes further files from."""
        return SiteContext(
            self.library,
            self.assets,
            names,
            pages.noted(feature),
            functools.partial(pages.note, feature),
            functools.partial(self.store.get_or_create, _PARTS, local=True),
            self._packed,
            self._imports,
        )

    # --- downloads

    def _downloads(self) -> Iterator[SiteFile]:
        """Scripts, models, archives, and files of the course."""
        for path, (script, _) in self.library.scripts.items():
            yield CachedFile(path, script.code.digest.hex(), functools.partial(self._script, path))
        for model in self.course.models:
            path = urls.model_file_path(model.name)
            yield OutputFile(path, model.source.text.encode())
        yield from self._archives()
        yield from self._course_files()

    def _script(self, path: str) -> bytes:
        return self.library.scripts[path][0].code.text.encode()

    def _archives(self) -> Iterator[SiteFile]:
        """The archives; of each only its key is held until it is written."""
        around = self._around()
        self._imports = around.imports
        for make in zips.archives(self.library, around):
            archive = make()
            if archive is not None:
                key = step_key("archive", archive.key)
                self._packed[archive.path] = key, make
                yield CachedFile(archive.path, key, functools.partial(_packed, make))

    def _course_files(self) -> Iterator[SiteFile]:
        digests = Digests(self.store)
        for path in self.course.files:
            digest = digests.file(f"{self.options.root}/{path}")
            read = functools.partial(read_bytes, self.options.root, path)
            if len(digest) != _DIGEST:  # it is gone, or cannot be read, as reading it says
                digest = hashlib.sha256(read()).hexdigest()
            self._files[urls.file_path(path)] = digest, read
            yield CachedFile(urls.file_path(path), digest, read)
        digests.save()

    def _around(self) -> zips.Surroundings:
        """What scripts need around them."""
        if not self.library.scripts:
            return zips.Surroundings()
        known = all_imports(self.documents.summaries)
        by_text = {
            script.code.digest: known[path]
            for path, (script, _) in self.library.scripts.items()
            if path in known
        }
        used = {name for modules in by_text.values() for name in modules}
        library = library_files() if "mjcourse" in used else ()
        imports = _Imports(self.store, by_text)
        modules = zips.imported_modules(self.course, library, imports, imports.of)
        packages = tuple(zips.Package(*p) for p in distributions(self.store, modules))
        meshes = tuple(
            OutputFile(path, read_bytes(self.options.root, path))
            for path in self.course.files
            if path.startswith("models/")
        )
        return zips.Surroundings(packages, library, meshes, imports, imports.of)


def _cut_font(store: Memo, job: FontJob) -> bytes:
    """A cut font: cut already, or cut now from the smallest font that has all that it needs."""

    def make() -> bytes:
        from coursebuild.core.pages.fonts import VERSION, subset_font

        source = prepared_source(job.data, job.characters, VERSION)
        return subset_font(job if source is None else replace(job, data=source))

    return prepared_cut(job.key) or store.get_or_create("fonts", job.key, make)


class _Data:
    """Files that are made together, of which the names may be all that is needed."""

    def __init__(
        self, store: Memo, key: str, make: Callable[[], tuple[Names, dict[str, bytes]]]
    ) -> None:
        self._store = store
        self.key = key
        self._make = make
        self._files: dict[str, bytes] | None = None

    def listing(self) -> tuple[Names, tuple[str, ...]]:
        """Their names."""
        return self._load(_SHARED, tuple[Names, tuple[str, ...]]) or self._made()

    def file(self, path: str) -> bytes:
        """The bytes of one."""
        if self._files is None:
            self._files = self._load(_SHARED_DATA, dict[str, bytes])
        if self._files is None:
            self._made()
        assert self._files is not None
        return self._files[path]

    def _made(self) -> tuple[Names, tuple[str, ...]]:
        names, self._files = self._make()
        listing = names, tuple(self._files)
        self._store.put(_SHARED_DATA, self.key, msgspec.msgpack.encode(self._files), local=True)
        self._store.put(_SHARED, self.key, msgspec.msgpack.encode(listing), local=True)
        return listing

    def _load(self, kind: str, type: Any) -> Any:
        data = self._store.get(kind, self.key, local=True)
        try:
            return None if data is None else msgspec.msgpack.decode(data, type=type)
        except msgspec.MsgspecError:
            return None


class _Imports:
    """What Python texts import: those of lessons are known, others are kept."""

    def __init__(self, store: Memo, known: dict[bytes, frozenset[str]]) -> None:
        """`known` go by the hash of their text."""
        self._store = store
        self._known = known

    def of(self, code: Excerpt) -> frozenset[str]:
        """What the code of a script imports; it is only read where that is not known."""
        known = self._known.get(code.digest)
        return self(code.text) if known is None else known

    def __call__(self, text: str) -> frozenset[str]:
        """What a text imports."""
        digest = text_digest(text)
        if digest not in self._known:
            key = key_of(sys.version, text)
            found = self._store.get_value("imports", key, list[str])
            if found is None:
                found = sorted(zips.imports(text))
                self._store.put_value("imports", key, found)
            self._known[digest] = frozenset(found)
        return self._known[digest]


def _packed(make: zips.MakeArchive) -> bytes:
    archive = make()
    assert archive is not None
    return archive.packed()


def broken_links(files: Sequence[SiteFile], base_url: str) -> Iterator[Diagnostic]:
    """Links of the built pages that lead nowhere; most are found in the sources already."""
    from coursebuild.core.pages.links import check_links

    pages = {
        file.path: file.data if isinstance(file, OutputFile) else file.make()
        for file in files
        if file.path.endswith(".html")
    }
    everything = (OutputFile(file.path, pages.get(file.path, b"")) for file in files)
    for broken in check_links(everything, base_url):
        page = Source(f"public/{broken.page}", pages[broken.page].decode())
        start = page.line_starts[broken.line - 1]
        at = page.text.find(broken.url, start)
        span = page.span(at, at + len(broken.url)) if at >= 0 else page.span(start, start)
        help = f"did you mean `{broken.near}`?" if broken.near else ""
        message = f"`{broken.url}` leads nowhere: {broken.reason}"
        yield diagnose("link-broken", span, message, help=help)
