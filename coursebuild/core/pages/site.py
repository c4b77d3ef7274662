"""A course and what running it found, as the files of a site.

Entry point: `render_site(course, results, assets, options)`.

1. Every page is drawn without its frame.
2. Punctuation is held to formulas, styles written in single elements become classes, and the fonts
   are cut down to the characters that the pages use.
3. The style sheet gets its name from its content, and every page its frame.
4. Scripts, models, archives, files of the course, the sitemap and the rest follow.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from hashlib import sha256

from msgspec import Struct, field

from coursebuild.core.model import Course
from coursebuild.core.model.results import FileFacts, OutputFile, Results
from coursebuild.core.pages import fonts, meta, urls, zips
from coursebuild.core.pages.added_files import NotedPage, SiteContext, added_files, page_notes
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.draw import draw_whole
from coursebuild.core.pages.exports.files import PageByproducts, page_byproducts, page_copies
from coursebuild.core.pages.exports.markdown_copy import html_copy
from coursebuild.core.pages.frame import Draft, Names, frame
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_list import PageEntry, page_list
from coursebuild.core.pages.shared import (
    PageFacts,
    common_characters,
    page_facts,
    settled,
    shared_files,
)
from coursebuild.numerics.reports import Reports


class SiteOptions(Struct, frozen=True):
    """What is not in the course itself."""

    files: tuple[OutputFile, ...] = ()
    """Files that pages show or link to, and that models pull in, by their path relative to the
    project root."""
    around: zips.Surroundings = field(default_factory=zips.Surroundings)
    """What downloaded scripts need."""
    reports: Reports = field(default_factory=Reports)
    """What was measured, as far as it fits the course."""
    subset: Callable[[fonts.FontJob], bytes] = fonts.subset_font
    """How a font is cut: whoever calls may keep results, by a job's `key`."""


def render_site(
    course: Course, results: Results, assets: Assets, options: SiteOptions | None = None
) -> tuple[OutputFile, ...]:
    """The files of the site, sorted by path. The same values give the same bytes."""
    options = options or SiteOptions()
    library = Library.of(course, results, assets, reports=options.reports)
    drafts, facts = [], []
    entries = tuple(page_list(library))
    drawn = tuple(entry.draft(library) for entry in entries)
    for draft, declarations in map(settled, drawn):
        drafts.append(draft)
        facts.append(page_facts(draft, declarations))
    shared, names = shared_files(assets, options.subset, all_facts(library, facts))
    files = [OutputFile(draft.path, frame(library, draft, names).encode()) for draft in drafts]
    files += shared
    files += library.feature_files
    files += _downloads(library, options)
    files += _machine_files(course, drafts)
    added, listed = added_files(functools.partial(_context, library, assets, names, entries, drawn))
    files += [f if isinstance(f, OutputFile) else OutputFile(f.path, f.make()) for f in added]
    files += _exports(library, options, drafts)
    if listed is not None:
        files.append(OutputFile(listed.path, listed.make(map(_facts, sorted(files, key=_path)))))
    return tuple(sorted(files, key=_path))


def _path(file: OutputFile) -> str:
    return file.path


def _facts(file: OutputFile) -> FileFacts:
    return FileFacts(file.path, sha256(file.data).hexdigest(), len(file.data))


def _context(
    library: Library,
    assets: Assets,
    names: Names,
    entries: Sequence[PageEntry],
    drawn: Sequence[Draft],
    feature: str,
) -> SiteContext:
    """What a feature makes further files from; nothing is kept."""
    notes: dict[str, bytes] = {}
    pages: list[NotedPage] = []
    for entry, draft in zip(entries, drawn, strict=True):
        found = page_notes(entry.inputs(library), entry.document(library), str(draft.body))
        if feature in found:
            notes[draft.path] = found[feature]
            digest = sha256(found[feature]).hexdigest()
            pages.append(NotedPage(draft.path, draft.kind, entry.id, draft.title, digest))
    return SiteContext(
        library, assets, names, tuple(pages), notes.__getitem__, lambda key, make: make()
    )


def all_facts(library: Library, pages: Iterable[PageFacts]) -> PageFacts:
    """The facts of all pages together, with those of what every page has around it."""
    text: set[str] = {*common_characters(library)}
    mathematics: set[str] = set()
    declarations: set[str] = set()
    for facts in pages:
        text |= facts.text
        mathematics |= facts.mathematics
        declarations |= facts.declarations
    return PageFacts(frozenset(text), frozenset(mathematics), frozenset(declarations))


# --------------------------------------------------------------------------------- downloads


def _downloads(library: Library, options: SiteOptions) -> Iterator[OutputFile]:
    """Scripts, models, archives, and files of the course."""
    for path, (script, _) in library.scripts.items():
        yield OutputFile(path, script.code.text.encode())
    for model in library.course.models:
        yield OutputFile(urls.model_file_path(model.name), model.source.text.encode())
    if library.scripts:
        yield zips.course_zip(library, options.around)
    for entry in library.course.lessons:
        archive = zips.lesson_zip(library, options.around, entry)
        if archive is not None:
            yield archive
    for file in options.files:
        yield OutputFile(urls.file_path(file.path), file.data)


def _exports(
    library: Library, options: SiteOptions, drafts: Sequence[Draft]
) -> Iterator[OutputFile]:
    """What the site gives away besides its pages."""
    bodies = {draft.path: visible(str(draft.body)) for draft in drafts}
    archives = zips.lesson_archives(library, options.around)
    taken = frozenset(urls.file_path(file.path) for file in options.files)
    source = _Pages(library, bodies)
    for file in page_copies(library, source, archives, options.around.imports, taken):
        yield OutputFile(file.path, file.make())


class _Pages:
    """The pages of a site, of which each is drawn again when its copies are made."""

    def __init__(self, library: Library, bodies: Mapping[str, str]) -> None:
        """`bodies` are the pages as published, by path."""
        self._library = library
        self._bodies = bodies
        self._entries = {entry.path: entry for entry in page_list(library)}
        self.paths = tuple(self._entries)

    def key(self, path: str) -> str:
        """Its path: nothing is kept."""
        return path

    def byproducts(self, path: str) -> PageByproducts:
        """What a page gives to the files beside it."""
        entry, body = self._entries[path], self._bodies[path]
        document = entry.document(self._library)
        if document is None:
            return PageByproducts(html_copy(path, body), None)
        inputs = entry.inputs(self._library)
        _, page = draw_whole(inputs, document, self._library.tools)
        return page_byproducts(inputs, page, self._library.course.base_url, body)


def _machine_files(course: Course, drafts: Iterable[Draft]) -> Iterator[OutputFile]:
    """What search engines look for."""
    yield OutputFile(urls.ROBOTS, meta.robots(course))
    if course.base_url:
        indexed = (draft.path for draft in drafts if draft.indexed)
        yield OutputFile(urls.SITEMAP, meta.sitemap(course, indexed))
