"""The search in a preview: its files are made when somebody asks for one of them.

Entry point: `Search.files`.

Of a page that is drawn as it was, what it is found by is not made again. A page with a mistake is
found by what it was before.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TypeAlias

from markupsafe import Markup
from msgspec.structs import replace

from coursebuild.model import Document
from coursebuild.render.compressed import COPIES
from coursebuild.render.draft import Draft
from coursebuild.render.library import Library
from coursebuild.render.search.values import Searched
from coursebuild.render.search.whole import SearchedPages, search_files

Pages: TypeAlias = Iterable[tuple[Draft, bool]]
"""Pages that are drawn, and of each whether it is without mistakes."""
Entry: TypeAlias = tuple[Draft, Searched | None]
"""A page without its body, and what it is found by."""


class Search:
    """See the module."""

    def __init__(self, whole: Callable[[Document], Document]) -> None:
        """`whole` gives a document with its text."""
        self._whole = whole
        self._known: dict[str, tuple[int, Entry]] = {}
        self._files: dict[str, bytes] = {}
        self._due = True

    def renew(self) -> None:
        """Say that pages may have changed."""
        self._due = True

    def files(self, library: Library, pages: Callable[[], Pages]) -> dict[str, bytes]:
        """The files, by site path; `pages` gives those that can be had, in order."""
        if self._due:
            self._due = False
            self._known = dict(self._looked_at(library, pages()))
            entries = (entry for _, entry in self._known.values())
            files = search_files(library, entries)
            self._files = {f.path: f.data for f in files if not _is_copy(f.path)}
        return self._files

    def _looked_at(self, library: Library, pages: Pages) -> Iterator[tuple[str, tuple[int, Entry]]]:
        looked = SearchedPages(library, self._whole)
        for draft, sound in pages:
            known, mark = self._known.get(draft.path), hash(draft)
            if known is None or (known[0] != mark and sound):
                by = looked.searched(draft) if sound else None
                known = mark, (replace(draft, body=Markup()), by)
            yield draft.path, known


def _is_copy(path: str) -> bool:
    """Whether it is a file made smaller, which a preview does not send."""
    return path.rpartition(".")[2] in COPIES
