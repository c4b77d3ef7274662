"""The files of the search for a site that is made in one go.

Entry point: `site_search(library, drafts)`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from coursebuild.model import Document
from coursebuild.render import pages, urls
from coursebuild.render.draft import Draft
from coursebuild.render.lesson import lesson_sheet, stub_sheet
from coursebuild.render.library import Library
from coursebuild.render.search.files import Entry, SearchFiles
from coursebuild.render.search.page import searched
from coursebuild.render.search.sheet import search_words
from coursebuild.render.search.values import Searched
from coursebuild.render.sheet import Sheet
from coursebuild.results import OutputFile


def site_search(library: Library, drafts: Iterable[Draft]) -> Iterator[OutputFile]:
    """The files for these pages, which are drawn and not yet settled."""
    known = _sheets(library)
    found: dict[str, Searched] = {}
    entries: list[Entry] = []
    for draft in drafts:
        sheet, document = known.get(draft.path, (_plain(draft), None))
        by = searched(sheet, document, str(draft.body))
        if by is not None:
            found[draft.path] = by
            entries.append(Entry(draft.path, draft.kind, draft.title, by.name, by.digest))
    files = SearchFiles(
        entries,
        search_words(library),
        lambda path: found[path].text,
        lambda path: found[path].terms,
        _Memory(),
    )
    for file in files.files():
        yield OutputFile(file.path, file.make())


def _sheets(library: Library) -> dict[str, tuple[Sheet, Document | None]]:
    """Sheets of the pages of which the search takes more than what is drawn."""
    course = library.course
    found: dict[str, tuple[Sheet, Document | None]] = {}
    for level in course.levels:
        found[urls.level_path(level)] = pages.level_sheet(library, level), None
    for lesson in course.lessons:
        document = lesson.document
        sheet = (
            stub_sheet(library, lesson)
            if document is None
            else lesson_sheet(library, lesson, document)
        )
        found[urls.lesson_path(lesson)] = sheet, document
    for model in course.models:
        found[urls.model_page_path(model.name)] = pages.model_sheet(library, model), None
    for page in course.pages:
        if page.document is not None:
            sheet = pages.page_sheet(library, page, page.document)
            found[urls.page_path(page)] = sheet, page.document
    return found


def _plain(draft: Draft) -> Sheet:
    """Of a page of which nothing counts but what is drawn."""
    kind, indexed = draft.kind, draft.indexed
    return Sheet(draft.path, kind, draft.title, draft.description, "", {}, indexed=indexed)


class _Memory:
    """Keeps what is made, as long as it is needed."""

    def get(self, key: str) -> bytes | None:
        """Nothing was made before."""
        return None

    def put(self, key: str, data: bytes) -> Callable[[], bytes]:
        """As it is."""
        return lambda: data
