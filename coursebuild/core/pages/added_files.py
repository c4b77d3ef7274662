"""Files that features make of a course and its pages: for its site, and when it is exported.

Entry points: `SiteContext` and `ExportContext`, what they are made from; `added_files`;
`page_notes`, what features have to know of a page for it, noted when the page is drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from msgspec import Struct

from coursebuild.core.model import Course, Document
from coursebuild.core.model.results import FileList, SiteFile
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.frame import Names
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.core.pages.zips import Archive
from coursebuild.core.registry import features


class NotedPage(Struct, frozen=True):
    """A page of which a feature has noted something."""

    path: str
    """Its site path."""
    kind: str
    """See `PageHead`."""
    id: str
    """Of its lesson, level, model or page."""
    title: str
    digest: str
    """Of the note."""


class SiteContext(Struct, frozen=True):
    """What a feature makes files of a site from."""

    library: Library
    assets: Assets
    names: Names
    """Of the files that all pages share."""
    pages: tuple[NotedPage, ...]
    """Those of which the feature has noted something, in the order of the site."""
    note: Callable[[str], bytes]
    """Gives what it noted, by the page's site path."""
    get_or_create: Callable[[str, Callable[[], bytes]], bytes]
    """Gives what was made under a key before, or makes it."""
    archives: Mapping[str, Archive]
    """Archives of scripts by site path."""
    imports: Callable[[str], frozenset[str]]
    """Says what a Python text imports."""


class ExportContext(Struct, frozen=True):
    """A course in which nothing is wrong, and what can be made of it."""

    library: Library
    """The course with its results, words and templates. Its documents are summaries."""
    assets: Assets
    site: Callable[[], Mapping[str, SiteFile]]
    """The files of its site by path; they are put together when this is called first."""
    page: Callable[[Document], PageContext]
    """A document with all its text, on its page, ready to be drawn."""
    read: Callable[[str], bytes]
    """A file of the course, by its path."""

    @property
    def course(self) -> Course:
        """The course."""
        return self.library.course


def page_notes(inputs: PageInputs, page: PageContext | None, body: str) -> dict[str, bytes]:
    """What features note of a page that was drawn, by the feature's name.

    `page` is the document on it, if it has one, `body` its HTML as published.
    """
    made = {f.name: f.note(inputs, page, body) for f in features() if f.note is not None}
    return {name: note for name, note in made.items() if note}


def added_files(
    contexts: Callable[[str], SiteContext],
) -> tuple[list[SiteFile], FileList | None]:
    """The files of all features, and the list of all files, if one makes it.

    `contexts` gives what a feature sees, by its name.
    """
    files: list[SiteFile] = []
    listed: FileList | None = None
    for feature in features():
        for file in feature.files(contexts(feature.name)) if feature.files is not None else ():
            if isinstance(file, FileList):
                listed = file
            else:
                files.append(file)
    return files, listed
