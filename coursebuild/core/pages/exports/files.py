"""The files beside the pages of a site: each page as Markdown, each lesson as a notebook.

Entry points: `page_byproducts`, what a drawn page gives to these files; `Exports(…).files()`, the
files; `OnDemand`, which draws pages when their files are asked for.

What a page gives depends on what the page depends on, and on nothing else: both have one key.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Protocol, TypeAlias

from msgspec import Struct

from coursebuild.core.model import Document, Lesson
from coursebuild.core.model.results import CachedFile, OutputFile, SiteFile
from coursebuild.core.pages import urls, zips
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.exports.llms import PATH as LLMS
from coursebuild.core.pages.exports.llms import llms
from coursebuild.core.pages.exports.markdown import Same
from coursebuild.core.pages.exports.markdown_copy import html_copy, markdown_copy
from coursebuild.core.pages.exports.notebook import Notebook, notebook
from coursebuild.core.pages.exports.notebook_file import finished
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.text.source import key_of

Archives: TypeAlias = Mapping[str, tuple[str, Callable[[], zips.Archive | None]]]
"""Archives of scripts by site path, with their keys."""


class PageByproducts(Struct, frozen=True):
    """What a page gives to the files beside it."""

    markdown: str
    """The page as Markdown; empty where it has no copy."""
    notebook: Notebook | None
    """Of a lesson."""


def page_byproducts(
    inputs: PageInputs, page: PageContext | None, base_url: str, body: str
) -> PageByproducts:
    """All of it; `page` is the context of the page's document, if it has one.

    `body` is the page's HTML as published.
    """
    same: Same = {}
    text = (
        markdown_copy(inputs, page, body, same)
        if urls.markdown_path(inputs.path) is not None
        else ""
    )
    if inputs.kind != "lesson" or page is None:
        return PageByproducts(text, None)
    return PageByproducts(text, notebook(inputs, page, base_url, same))


class PageSource(Protocol):
    """The pages of a site."""

    @property
    def paths(self) -> tuple[str, ...]:
        """The site paths of all pages."""
        ...

    def key(self, path: str) -> str:
        """All that a page depends on."""
        ...

    def byproducts(self, path: str) -> PageByproducts:
        """What a page gives to the files beside it."""
        ...


class ExportContext(Struct, frozen=True):
    """What files need besides the pages."""

    archives: Archives
    """Those of the lessons."""
    imports: Callable[[str], frozenset[str]]
    """What a Python text imports."""
    taken: frozenset[str]
    """Paths of files that authors have put there."""


def export_paths(library: Library, pages: Iterable[str], taken: frozenset[str]) -> Iterator[str]:
    """The site paths of what `Exports` makes, in no order; `pages` are those of all pages."""
    copies = map(urls.markdown_path, pages)
    yield from (path for path in copies if path is not None and path not in taken)
    yield LLMS
    yield from (urls.notebook_path(one) for one in library.order if one.document is not None)


class Exports:
    """What a site gives away besides its pages."""

    def __init__(self, library: Library, source: PageSource, context: ExportContext) -> None:
        self._library = library
        self._source = source
        self._context = context

    def files(self) -> Iterator[SiteFile]:
        """All of them; the pages may be only some of the course."""
        pages = frozenset(self._source.paths)
        for page in self._source.paths:
            path = urls.markdown_path(page)
            if path is not None and path not in self._context.taken:
                yield CachedFile(path, self._source.key(page), partial(self._markdown, page))
        yield OutputFile(LLMS, llms(self._library))
        for lesson in self._library.order:
            if lesson.document is not None and urls.lesson_path(lesson) in pages:
                yield self._notebook(lesson)

    def _markdown(self, page: str) -> bytes:
        return visible(self._source.byproducts(page).markdown).encode()

    def _notebook(self, lesson: Lesson) -> CachedFile:
        key, _ = self._context.archives.get(urls.lesson_zip_path(lesson), ("", None))
        key = key_of("notebook", self._source.key(urls.lesson_path(lesson)), key)
        return CachedFile(urls.notebook_path(lesson), key, partial(self._notebook_file, lesson))

    def _notebook_file(self, lesson: Lesson) -> bytes:
        made = self._source.byproducts(urls.lesson_path(lesson)).notebook
        assert made is not None, "a written lesson has a notebook"
        packed = self._context.archives.get(urls.lesson_zip_path(lesson))
        return finished(made, packed[1]() if packed else None, self._context.imports)


class OnDemand:
    """A source that makes what it is asked for, and keeps nothing."""

    def __init__(
        self,
        library: Library,
        body: Callable[[str], str],
        whole: Callable[[Document], Document] = lambda document: document,
    ) -> None:
        """`body` gives the HTML of a page as published; `whole` a document with its text."""
        self._library = library
        self._body = body
        self._whole = whole
        self._entries = {entry.path: entry for entry in page_list(library)}
        self.paths = tuple(self._entries)

    def key(self, path: str) -> str:
        """Its path: nothing is kept."""
        return path

    def byproducts(self, path: str) -> PageByproducts:
        """What a page gives to the files beside it, made now."""
        from coursebuild.core.pages.draw import draw_whole

        entry = self._entries[path]
        document = entry.document(self._library)
        if document is None:
            return PageByproducts(html_copy(path, self._body(path)), None)
        inputs = entry.inputs(self._library)
        _, page = draw_whole(inputs, self._whole(document), self._library.tools)
        return page_byproducts(inputs, page, self._library.course.base_url, self._body(path))
