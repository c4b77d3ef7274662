"""The files of the search for a site that is made in one go.

Entry point: `site_search(library, drafts)`; its steps `SearchedPages` and `search_files`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from coursebuild.core.model import Document
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.draft import Draft
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.pages.search.files import IndexEntry, SearchFiles, search_words
from coursebuild.core.pages.search.page import searched
from coursebuild.core.pages.search.values import Searched


def site_search(library: Library, drafts: Iterable[Draft]) -> Iterator[OutputFile]:
    """The files for these pages, which are drawn."""
    pages = SearchedPages(library)
    return search_files(library, ((draft, pages.searched(draft)) for draft in drafts))


def search_files(
    library: Library, pages: Iterable[tuple[Draft, Searched | None]]
) -> Iterator[OutputFile]:
    """The files for pages, each with what it is found by."""
    found: dict[str, Searched] = {}
    entries: list[IndexEntry] = []
    for draft, by in pages:
        if by is not None:
            found[draft.path] = by
            entries.append(IndexEntry(draft.path, draft.kind, draft.title, by.name, by.digest))
    files = SearchFiles(
        entries,
        search_words(library.words),
        lambda path: found[path].text,
        lambda path: found[path].terms,
        _Memory(),
    )
    for file in files.files():
        yield OutputFile(file.path, file.make())


class SearchedPages:
    """What the pages of a course are found by."""

    def __init__(
        self, library: Library, whole: Callable[[Document], Document] = lambda document: document
    ) -> None:
        """`whole` gives a document with its text."""
        self._library = library
        self._entries = {entry.path: entry for entry in page_list(library)}
        self._whole = whole

    def searched(self, draft: Draft) -> Searched | None:
        """Of a page that is drawn and has no mistake; `None` where it is not searched."""
        entry = self._entries[draft.path]
        document = entry.document(self._library)
        whole = None if document is None else self._whole(document)
        return searched(entry.inputs(self._library), whole, str(draft.body))


class _Memory:
    """Keeps nothing from build to build."""

    def get(self, key: str) -> bytes | None:
        """Nothing was made before."""
        return None

    def put(self, key: str, data: bytes) -> None:
        """Nothing is kept."""
