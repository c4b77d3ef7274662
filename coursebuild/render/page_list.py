"""Every page of a site, in order: the one place that says which there are.

Entry point: `page_list(library)`.

An entry may be asked with another library of the same course: while a course is edited its
documents change, and its pages stay as long as the course map does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from msgspec import Struct

from coursebuild.model import Document
from coursebuild.render import urls
from coursebuild.render.draft import Draft
from coursebuild.render.library import Library
from coursebuild.render.sheet import Sheet
from coursebuild.render.tools import Tools


class PageEntry(Struct, frozen=True):
    """A page of a site."""

    path: str
    """Its site path."""
    id: str
    """Of the level, lesson, model or page that it shows; empty where there is one page of its
    kind."""
    kind: PageKind

    def sheet(self, library: Library) -> Sheet:
        """What it shows; summaries of documents are enough."""
        return self.kind.sheet(library, self.id)

    def document(self, library: Library) -> Document | None:
        """The document that it shows, if any."""
        return self.kind.document(library, self.id)

    def draft(
        self,
        library: Library,
        whole: Callable[[Document], Document] = lambda document: document,
        tools: Tools | None = None,
    ) -> Draft:
        """The page drawn; `whole` gives a document with its text, `tools` are the library's."""
        from coursebuild.render.draw import draw  # with all that it takes to draw

        document = self.document(library)
        shown = None if document is None else whole(document)
        return draw(self.sheet(library), shown, tools or library.tools)


class PageKind(Struct, frozen=True):
    """How the pages of a kind are made, each from the id of what it shows."""

    sheet: Callable[[Library, str], Sheet]
    document: Callable[[Library, str], Document | None] = lambda library, id: None


# What makes a sheet is imported when there is one to make: after an edit few are made.


def _lesson_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render import lesson

    entry = library.lessons[id]
    if entry.document is None:
        return lesson.stub_sheet(library, entry)
    return lesson.lesson_sheet(library, entry, entry.document)


def _page_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.pages import page_sheet

    page = library.pages[id]
    assert page.document is not None, "a page without a document is not in the list"
    return page_sheet(library, page, page.document)


def _model_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.pages import model_sheet

    model = next(model for model in library.course.models if model.name == id)
    return model_sheet(library, model)


def _level_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.pages import level_sheet

    return level_sheet(library, library.levels[id])


def _home_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.pages import home_sheet

    return home_sheet(library)


def _glossary_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.lookup.glossary import glossary_sheet

    return glossary_sheet(library)


def _symbols_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.lookup.symbol_index import symbols_sheet

    return symbols_sheet(library)


def _numerics_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.numerics import numerics_sheet

    return numerics_sheet(library)


def _progress_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.reader import progress_sheet

    return progress_sheet(library)


def _review_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.reader import review_sheet

    return review_sheet(library)


def _offline_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.offline import offline_sheet

    return offline_sheet(library)


def _search_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.search.sheet import search_sheet

    return search_sheet(library)


def _not_found_sheet(library: Library, id: str) -> Sheet:
    from coursebuild.render.pages import not_found_sheet

    return not_found_sheet(library)


_HOME = PageKind(_home_sheet)
_LEVEL = PageKind(_level_sheet)
_LESSON = PageKind(_lesson_sheet, lambda library, id: library.lessons[id].document)
_MODEL = PageKind(_model_sheet)
_GLOSSARY = PageKind(_glossary_sheet)
_SYMBOLS = PageKind(_symbols_sheet)
_NUMERICS = PageKind(_numerics_sheet)
_PAGE = PageKind(_page_sheet, lambda library, id: library.pages[id].document)
_PROGRESS = PageKind(_progress_sheet)
_REVIEW = PageKind(_review_sheet)
_OFFLINE = PageKind(_offline_sheet)
_SEARCH = PageKind(_search_sheet)
_NOT_FOUND = PageKind(_not_found_sheet)


def page_list(library: Library) -> Iterator[PageEntry]:
    """The pages of the site of a course."""
    course = library.course
    yield PageEntry(urls.HOME, "", _HOME)
    for level in course.levels:
        yield PageEntry(urls.level_path(level), level.id, _LEVEL)
    for entry in library.order:
        yield PageEntry(urls.lesson_path(entry), entry.id, _LESSON)
    for model in course.models:
        yield PageEntry(urls.model_page_path(model.name), model.name, _MODEL)
    if library.references.terms:
        yield PageEntry(urls.GLOSSARY, "", _GLOSSARY)
    if library.references.has_symbols:
        yield PageEntry(urls.SYMBOLS, "", _SYMBOLS)
    if library.reports.cases:
        yield PageEntry(urls.NUMERICS, "", _NUMERICS)
    for page in course.pages:
        if page.document is not None:
            yield PageEntry(urls.page_path(page), page.id, _PAGE)
    yield PageEntry(urls.PROGRESS, "", _PROGRESS)
    if library.asked:
        yield PageEntry(urls.REVIEW, "", _REVIEW)
    yield PageEntry(urls.OFFLINE, "", _OFFLINE)
    yield PageEntry(urls.SEARCH, "", _SEARCH)
    yield PageEntry(urls.NOT_FOUND, "", _NOT_FOUND)
