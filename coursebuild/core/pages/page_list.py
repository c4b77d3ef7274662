"""The list of all pages of a site, in order.

Entry point: `page_list(library)`.

An entry works with any library of the same course: edits change documents, but the pages stay the
same as long as the course map does.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from coursebuild.core.features import PageKind
from coursebuild.core.model import Document, FeatureBlock, document_blocks
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import PageHead, PageInputs
from coursebuild.core.registry import kind_of_block, page_kind


class PageEntry(Struct, frozen=True):
    """A page of a site."""

    path: str
    """Its site path."""
    kind: str
    """One of `CORE_PAGES`, or the name of a `PageKind`."""
    id: str = ""
    """The id of its level, lesson, model or page; empty if there is only one page of its kind."""

    def inputs(self, library: Library) -> PageInputs:
        """The inputs of the page; summaries of documents are enough."""
        kind = page_kind(self.kind)
        return _course_inputs(self, library) if kind is None else _added_inputs(kind, library)

    def may_show_notes(self, library: Library) -> bool:
        """Whether its inputs may depend on summaries by features (`Feature.summary`)."""
        if self.kind not in ("level", "lesson", "page", "notfound"):
            return True
        document = self.document(library)
        blocks = () if document is None else document_blocks(document)
        feature_blocks = (block for block in blocks if isinstance(block, FeatureBlock))
        return any(kind_of_block(block).values is not None for block in feature_blocks)

    def document(self, library: Library) -> Document | None:
        """The document that it shows, if any."""
        match self.kind:
            case "lesson":
                return library.lessons[self.id].document
            case "page" | "home":
                page = library.pages.get(self.id)
                return None if page is None else page.document
            case _:
                return None


def page_list(library: Library) -> Iterator[PageEntry]:
    """The pages of the site of a course."""
    course = library.course
    yield PageEntry(urls.HOME, "home", "home")
    for level in course.levels:
        yield PageEntry(urls.level_path(level), "level", level.id)
    for lesson in library.order:
        yield PageEntry(urls.lesson_path(lesson), "lesson", lesson.id)
    if library.gallery:
        yield PageEntry(library.gallery, "models")
    for model in course.models:
        yield PageEntry(urls.model_page_path(model.name), "model", model.name)
    for kind in library.added_pages:
        yield PageEntry(kind.path, kind.name)
    for page in course.pages:
        if page.document is not None and not page.is_home:
            yield PageEntry(urls.page_path(page), "page", page.id)
    yield PageEntry(urls.NOT_FOUND, "notfound")


def page_title(library: Library, kind: PageKind) -> str:
    """The title of a page that a feature adds."""
    key = f"{kind.name}.title"
    return library.words(key) if library.words.has(key) else kind.name.capitalize()


def _added_inputs(kind: PageKind, library: Library) -> PageInputs:
    key = f"{kind.name}.description"
    description = library.words(key) if library.words.has(key) else ""
    title, home = page_title(library, kind), urls.Place(kind.path).href(urls.HOME)
    values = {"home": home, **kind.values(library)}
    template = "added.html" if kind.draw is not None else f"{kind.name}.html"
    head = PageHead(kind.path, kind.name, title, description, indexed=kind.indexed)
    return PageInputs(head, template, values)


def _course_inputs(entry: PageEntry, library: Library) -> PageInputs:
    # Imported only if there are inputs to make: after an edit these are few.
    from coursebuild.core.pages import lesson, pages

    match entry.kind:
        case "home":
            return pages.home_inputs(library, entry.document(library))
        case "level":
            return pages.level_inputs(library, library.levels[entry.id])
        case "lesson":
            entry_lesson = library.lessons[entry.id]
            if entry_lesson.document is None:
                return lesson.stub_inputs(library, entry_lesson)
            return lesson.lesson_inputs(library, entry_lesson, entry_lesson.document)
        case "models":
            return pages.gallery_inputs(library)
        case "model":
            model = next(model for model in library.course.models if model.name == entry.id)
            return pages.model_inputs(library, model)
        case "page":
            page = library.pages[entry.id]
            assert page.document is not None, "a page without a document is not in the list"
            return pages.page_inputs(library, page, page.document)
        case _:
            return pages.not_found_inputs(library)
