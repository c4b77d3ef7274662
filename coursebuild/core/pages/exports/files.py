"""The files beside the pages of a site: each page as Markdown, each lesson as a notebook.

Entry points: `page_byproducts`, what a drawn page gives to these files; `page_copies`, the files.

What a page gives depends on what the page depends on, and on nothing else: both have one key.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Protocol, TypeAlias

from msgspec import Struct

from coursebuild.core.model import Lesson
from coursebuild.core.model.results import CachedFile, OutputFile, SiteFile
from coursebuild.core.pages import urls, zips
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.exports.llms import PATH as LLMS
from coursebuild.core.pages.exports.llms import llms
from coursebuild.core.pages.exports.markdown_copy import markdown_copy
from coursebuild.core.pages.exports.notebook import Notebook, notebook
from coursebuild.core.pages.exports.notebook_file import Imports, notebook_file
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.core.text.source import key_of

Archives: TypeAlias = Mapping[str, tuple[str, Callable[[], zips.Archive | None]]]
"""Archives of lessons' scripts by site path, with their keys."""


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
    text = markdown_copy(inputs, page, body) if urls.markdown_path(inputs.path) else ""
    if page is None or inputs.kind != "lesson":
        return PageByproducts(text, None)
    return PageByproducts(text, notebook(inputs, page, base_url))


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


def page_copies(
    library: Library,
    source: PageSource,
    archives: Archives,
    imports: Imports,
    taken: frozenset[str],
) -> Iterator[SiteFile]:
    """The files; the pages may be only some of the course.

    `imports` says what a Python text imports, `taken` are the paths of files that authors have put
    there.
    """

    def markdown(page: str) -> bytes:
        return visible(source.byproducts(page).markdown).encode()

    def ipynb(lesson: Lesson) -> bytes:
        made = source.byproducts(urls.lesson_path(lesson)).notebook
        assert made is not None, "a written lesson has a notebook"
        packed = archives.get(urls.lesson_zip_path(lesson))
        return notebook_file(made, packed[1]() if packed else None, imports)

    for page in source.paths:
        path = urls.markdown_path(page)
        if path is not None and path not in taken:
            yield CachedFile(path, source.key(page), partial(markdown, page))
    yield OutputFile(LLMS, llms(library))
    pages = frozenset(source.paths)
    for lesson in library.order:
        page = urls.lesson_path(lesson)
        if lesson.document is not None and page in pages:
            archive_key, _ = archives.get(urls.lesson_zip_path(lesson), ("", None))
            key = key_of("notebook", source.key(page), archive_key)
            yield CachedFile(urls.notebook_path(lesson), key, partial(ipynb, lesson))
