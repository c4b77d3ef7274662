"""The files of the search for a site that is made in one go.

Entry point: `site_search(library, drafts)`; its steps `SearchedPages` and `search_files`.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator

from coursebuild.model import Document, Lesson, Level, MjcfModel, Page
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
    """The files for these pages, which are drawn."""
    pages = SearchedPages(library)
    return search_files(library, ((draft, pages.searched(draft)) for draft in drafts))


def search_files(
    library: Library, pages: Iterable[tuple[Draft, Searched | None]]
) -> Iterator[OutputFile]:
    """The files for pages, each with what it is found by."""
    found: dict[str, Searched] = {}
    entries: list[Entry] = []
    for draft, by in pages:
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


class SearchedPages:
    """What the pages of a course are found by."""

    def __init__(
        self, library: Library, whole: Callable[[Document], Document] = lambda document: document
    ) -> None:
        """`whole` gives a document with its text."""
        self._known = _sheets(library)
        self._whole = whole

    def searched(self, draft: Draft) -> Searched | None:
        """Of a page that is drawn and has no mistake; `None` where it is not searched."""
        make = self._known.get(draft.path)
        sheet, document = make() if make is not None else (_plain(draft), None)
        return searched(sheet, self._whole(document) if document else None, str(draft.body))


def _sheets(library: Library) -> dict[str, Callable[[], tuple[Sheet, Document | None]]]:
    """Sheets of the pages of which the search takes more than what is drawn."""
    course, found = library.course, dict[str, Callable[[], tuple[Sheet, Document | None]]]()
    for level in course.levels:
        found[urls.level_path(level)] = functools.partial(_level, library, level)
    for lesson in course.lessons:
        found[urls.lesson_path(lesson)] = functools.partial(_lesson, library, lesson)
    for model in course.models:
        found[urls.model_page_path(model.name)] = functools.partial(_model, library, model)
    for page in course.pages:
        if page.document is not None:
            found[urls.page_path(page)] = functools.partial(_page, library, page, page.document)
    return found


def _level(library: Library, level: Level) -> tuple[Sheet, Document | None]:
    return pages.level_sheet(library, level), None


def _lesson(library: Library, lesson: Lesson) -> tuple[Sheet, Document | None]:
    if lesson.document is None:
        return stub_sheet(library, lesson), None
    return lesson_sheet(library, lesson, lesson.document), lesson.document


def _model(library: Library, model: MjcfModel) -> tuple[Sheet, Document | None]:
    return pages.model_sheet(library, model), None


def _page(library: Library, page: Page, document: Document) -> tuple[Sheet, Document | None]:
    return pages.page_sheet(library, page, document), document


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
