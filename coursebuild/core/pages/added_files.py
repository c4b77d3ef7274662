"""Files that features add to a site, and what exports are made from.

Entry points: `SiteContext` and `ExportContext`, what features make files from; `added_files`;
`page_notes`, what features note of a page when it is drawn, in order to make files later.
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
    """A page that a feature has made a note of."""

    path: str
    """Its site path."""
    kind: str
    """See `PageHead`."""
    id: str
    """The id of its lesson, level, model or page."""
    title: str
    digest: str
    """The digest of the note."""


class SiteContext(Struct, frozen=True):
    """What a feature makes files of a site from."""

    library: Library
    assets: Assets
    names: Names
    """The names of the files that all pages share."""
    pages: tuple[NotedPage, ...]
    """The pages with a note of this feature, in the order of the site."""
    note: Callable[[str], bytes]
    """Returns the note of a page, by its site path."""
    get_or_create: Callable[[str, Callable[[], bytes]], bytes]
    """Returns what was made under a key before, or makes it."""
    archives: Mapping[str, Archive]
    """Archives of scripts by site path."""
    imports: Callable[[str], frozenset[str]]
    """Returns the modules that a Python text imports."""


class ExportContext(Struct, frozen=True):
    """A course without errors, and what an export can be made from."""

    library: Library
    """The course with its results, words and templates. Its documents are summaries."""
    assets: Assets
    site: Callable[[], Mapping[str, SiteFile]]
    """The files of its site by path, collected on the first call."""
    page: Callable[[Document], PageContext]
    """A document with its whole text on its page, ready to be drawn."""
    read: Callable[[str], bytes]
    """A file of the course, by its path."""

    @property
    def course(self) -> Course:
        """The course."""
        return self.library.course


def page_notes(inputs: PageInputs, page: PageContext | None, body: str) -> dict[str, bytes]:
    """The notes that features make of a drawn page, by the feature's name.

    `page` is the document on it, if any, `body` its HTML as published.
    """
    notes = {f.name: f.note(inputs, page, body) for f in features() if f.note is not None}
    return {name: note for name, note in notes.items() if note}


def added_files(
    contexts: Callable[[str], SiteContext],
) -> tuple[list[SiteFile], FileList | None]:
    """The files of all features, and the list of all files, if one makes it.

    `contexts` returns the context of a feature by its name.
    """
    files: list[SiteFile] = []
    file_list: FileList | None = None
    for feature in features():
        for file in feature.files(contexts(feature.name)) if feature.files is not None else ():
            if isinstance(file, FileList):
                file_list = file
            else:
                files.append(file)
    return files, file_list
