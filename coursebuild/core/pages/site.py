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
from collections.abc import Callable, Iterable, Iterator, Sequence
from hashlib import sha256

from msgspec import Struct, field

from coursebuild.core.model import Course
from coursebuild.core.model.results import FileFacts, OutputFile, Results
from coursebuild.core.pages import fonts, meta, urls, zips
from coursebuild.core.pages.added_files import NotedPage, SiteContext, added_files, page_notes
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.draw import draw_whole
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
    drawn = []
    for entry in entries:
        draft, page = draw_whole(entry.inputs(library), entry.document(library), library.tools)
        draft, declarations = settled(draft)
        drafts.append(draft)
        drawn.append((draft, page))
        facts.append(page_facts(draft, declarations))
    shared, names = shared_files(assets, options.subset, all_facts(library, facts))
    files = [OutputFile(draft.path, frame(library, draft, names).encode()) for draft in drafts]
    files += shared
    files += library.feature_files
    files += _downloads(library, options)
    files += _machine_files(course, drafts)
    contexts = functools.partial(_context, library, assets, options, names, entries, drawn)
    added, listed = added_files(contexts)
    files += [f if isinstance(f, OutputFile) else OutputFile(f.path, f.make()) for f in added]
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
    options: SiteOptions,
    names: Names,
    entries: Sequence[PageEntry],
    drawn: Sequence[tuple[Draft, PageContext | None]],
    feature: str,
) -> SiteContext:
    """What a feature makes further files from; nothing is kept."""
    notes: dict[str, bytes] = {}
    pages: list[NotedPage] = []
    for entry, (draft, page) in zip(entries, drawn, strict=True):
        found = page_notes(entry.inputs(library), page, visible(str(draft.body)))
        if feature in found:
            notes[draft.path] = found[feature]
            digest = sha256(found[feature]).hexdigest()
            pages.append(NotedPage(draft.path, draft.kind, entry.id, draft.title, digest))
    return SiteContext(
        library,
        assets,
        names,
        tuple(pages),
        notes.__getitem__,
        lambda key, make: make(),
        zips.lesson_archives(library, options.around),
        options.around.imports,
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


def _machine_files(course: Course, drafts: Iterable[Draft]) -> Iterator[OutputFile]:
    """What search engines look for."""
    yield OutputFile(urls.ROBOTS, meta.robots(course))
    if course.base_url:
        indexed = (draft.path for draft in drafts if draft.indexed)
        yield OutputFile(urls.SITEMAP, meta.sitemap(course, indexed))
