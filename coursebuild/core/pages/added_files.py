"""Files that features add to a site, made of its course and its pages.

Entry points: `SiteContext`, what they are made from; `added_files`; `page_notes`, what features
have to know of a page for it, noted when the page is drawn.
"""

from __future__ import annotations

from collections.abc import Callable

from msgspec import Struct

from coursebuild.core.model import Document
from coursebuild.core.model.results import FileList, SiteFile
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.frame import Names
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.core.registry import features


class NotedPage(Struct, frozen=True):
    """A page of which a feature has noted something."""

    path: str
    """Its site path."""
    kind: str
    """See `Draft`."""
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


def page_notes(inputs: PageInputs, document: Document | None, body: str) -> dict[str, bytes]:
    """What features note of a page that was drawn, by the feature's name."""
    made = {f.name: f.note(inputs, document, body) for f in features() if f.note is not None}
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
