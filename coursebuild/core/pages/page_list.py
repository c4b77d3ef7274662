"""Every page of a site, in order: the one place that says which there are.

Entry point: `page_list(library)`.

An entry may be asked with another library of the same course: while a course is edited its
documents change, and its pages stay as long as the course map does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from msgspec import Struct

from coursebuild.core.model import Document
from coursebuild.core.pages import urls
from coursebuild.core.pages.draft import Draft
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.core.pages.tools import Tools


class PageEntry(Struct, frozen=True):
    """A page of a site."""

    path: str
    """Its site path."""
    id: str
    """Of the level, lesson, model or page that it shows; empty where there is one page of its
    kind."""
    kind: PageKind

    def inputs(self, library: Library) -> PageInputs:
        """What it shows; summaries of documents are enough."""
        return self.kind.inputs(library, self.id)

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
        from coursebuild.core.pages.draw import draw  # with all that it takes to draw

        document = self.document(library)
        shown = None if document is None else whole(document)
        return draw(self.inputs(library), shown, tools or library.tools)


class PageKind(Struct, frozen=True):
    """How the pages of a kind are made, each from the id of what it shows."""

    inputs: Callable[[Library, str], PageInputs]
    document: Callable[[Library, str], Document | None] = lambda library, id: None


# What makes inputs is imported when there are some to make: after an edit these are few.


def _lesson_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages import lesson

    entry = library.lessons[id]
    if entry.document is None:
        return lesson.stub_inputs(library, entry)
    return lesson.lesson_inputs(library, entry, entry.document)


def _page_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.pages import page_inputs

    page = library.pages[id]
    assert page.document is not None, "a page without a document is not in the list"
    return page_inputs(library, page, page.document)


def _model_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.pages import model_inputs

    model = next(model for model in library.course.models if model.name == id)
    return model_inputs(library, model)


def _level_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.pages import level_inputs

    return level_inputs(library, library.levels[id])


def _home_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.pages import home_inputs

    return home_inputs(library)


def _glossary_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.lookup.glossary import glossary_inputs

    return glossary_inputs(library)


def _symbols_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.lookup.symbol_index import symbols_inputs

    return symbols_inputs(library)


def _numerics_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.numerics import numerics_inputs

    return numerics_inputs(library)


def _progress_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.reader import progress_inputs

    return progress_inputs(library)


def _review_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.reader import review_inputs

    return review_inputs(library)


def _offline_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.offline import offline_inputs

    return offline_inputs(library)


def _search_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.search.page_inputs import search_inputs

    return search_inputs(library)


def _not_found_inputs(library: Library, id: str) -> PageInputs:
    from coursebuild.core.pages.pages import not_found_inputs

    return not_found_inputs(library)


_HOME = PageKind(_home_inputs)
_LEVEL = PageKind(_level_inputs)
_LESSON = PageKind(_lesson_inputs, lambda library, id: library.lessons[id].document)
_MODEL = PageKind(_model_inputs)
_GLOSSARY = PageKind(_glossary_inputs)
_SYMBOLS = PageKind(_symbols_inputs)
_NUMERICS = PageKind(_numerics_inputs)
_PAGE = PageKind(_page_inputs, lambda library, id: library.pages[id].document)
_PROGRESS = PageKind(_progress_inputs)
_REVIEW = PageKind(_review_inputs)
_OFFLINE = PageKind(_offline_inputs)
_SEARCH = PageKind(_search_inputs)
_NOT_FOUND = PageKind(_not_found_inputs)


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
