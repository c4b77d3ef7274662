"""The files beside pages, and those of the whole course: Markdown, notebooks, the e-book.

Entry points: `Exports(…).files(…)`; `Source`, where what pages give to them comes from, and
`OnDemand`, a source that makes it when it is asked for.

What a page gives depends on what the page depends on. Of each file only its key is known until it
is written: an edit of one lesson makes that lesson's files, and those of the whole course are put
together again without drawing anything.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Generic, Protocol, TypeAlias, TypeVar

from msgspec import Struct

from coursebuild.model import Document, Lesson
from coursebuild.render import urls, zips
from coursebuild.render.characters import visible
from coursebuild.render.exports.archive import Deflated, File, deflate, packed
from coursebuild.render.exports.book import Book, books
from coursebuild.render.exports.chapters import Chapters, Keep, Note
from coursebuild.render.exports.epub import Epub
from coursebuild.render.exports.llms import PATH as LLMS
from coursebuild.render.exports.llms import llms
from coursebuild.render.exports.notebook_file import finished
from coursebuild.render.exports.page import Beside, PageExports, page_exports
from coursebuild.render.exports.parts import LessonPart, OpenChapter
from coursebuild.render.exports.twin import twin_of
from coursebuild.render.frame import Frames, Names
from coursebuild.render.library import Library
from coursebuild.render.page_list import page_list
from coursebuild.results import KeptFile, OutputFile, SiteFile
from coursebuild.source import key_of

Of = TypeVar("Of")
Archives: TypeAlias = Mapping[str, tuple[str, Callable[[], zips.Archive | None]]]
"""Archives of scripts by site path, with their keys."""


class Source(Protocol):
    """The pages of a site."""

    @property
    def paths(self) -> tuple[str, ...]:
        """The site paths of all pages."""
        ...

    def key(self, path: str) -> str:
        """All that a page depends on."""
        ...

    def beside(self, path: str) -> Beside:
        """What a page gives to the files beside it."""
        ...

    def section(self, path: str) -> str:
        """What a lesson gives to the page of the whole course."""
        ...

    def chapter(self, path: str) -> OpenChapter:
        """What a lesson gives to the e-book."""
        ...


class Around(Struct, frozen=True):
    """What files need besides the pages."""

    style: str
    """The style sheet of the e-book."""
    picture: Callable[[str], bytes]
    """The bytes of the picture at a site path."""
    pictures: str
    """Another text where a picture is another."""
    archives: Archives
    """Those of the lessons."""
    imports: Callable[[str], frozenset[str]]
    """What a Python text imports."""
    declarations: Iterable[str]
    """Styles that were written in elements of pages."""
    taken: frozenset[str]
    """Paths of files that authors have put there."""
    keep: Keep = lambda key, make: make()
    note: Note = Note()
    """What was known of the chapters of the last e-book."""


def export_paths(library: Library, pages: Iterable[str], taken: frozenset[str]) -> Iterator[str]:
    """The site paths of what `Exports` makes, in no order; `pages` are those of all pages."""
    twins = map(urls.twin_path, pages)
    yield from (path for path in twins if path is not None and path not in taken)
    yield LLMS
    lessons = [lesson for lesson in library.order if lesson.document is not None]
    yield from map(urls.notebook_path, lessons)
    yield from (book.path for book in books(library))
    if lessons:
        yield urls.EPUB


class Exports:
    """What a site gives away besides its pages."""

    def __init__(self, library: Library, source: Source, around: Around) -> None:
        self._library = library
        self._source = source
        self._around = around
        self._lessons = [one for one in library.order if one.document is not None]

    def files(self, names: Names) -> Iterator[SiteFile]:
        """All of them; `names` are those of what every page refers to."""
        yield from self._twins()
        yield OutputFile(LLMS, llms(self._library))
        for lesson in self._lessons:
            yield self._notebook(lesson)
        if self._lessons:
            yield from self._books(names)
            yield self._epub()

    def _page_key(self, lesson: Lesson) -> str:
        return self._source.key(urls.lesson_path(lesson))

    def _twins(self) -> Iterator[SiteFile]:
        twin = self._twin
        for page in self._source.paths:
            path = urls.twin_path(page)
            if path is not None and path not in self._around.taken:
                yield KeptFile(path, self._source.key(page), _Made(twin, page))

    def _twin(self, page: str) -> bytes:
        return visible(self._source.beside(page).twin).encode()

    # --- notebooks

    def _notebook(self, lesson: Lesson) -> KeptFile:
        key, _ = self._around.archives.get(urls.lesson_zip_path(lesson), ("", None))
        key = key_of("notebook", self._page_key(lesson), key)
        return KeptFile(urls.notebook_path(lesson), key, _Made(self._notebook_made, lesson))

    def _notebook_made(self, lesson: Lesson) -> bytes:
        made = self._source.beside(urls.lesson_path(lesson)).notebook
        assert made is not None, "a written lesson has a notebook"
        packed = self._around.archives.get(urls.lesson_zip_path(lesson))
        return finished(made, packed[1]() if packed else None, self._around.imports)

    # --- the whole course on pages

    def _books(self, names: Names) -> Iterator[KeptFile]:
        frames = Frames(self._library, names)
        places = ""
        for book in books(self._library):
            before, after = frames.around(book.draft(self._library), ())
            places = places or key_of(repr(sorted(book.places.items())))  # of all the same
            texts = (before, *map(_shown, book.texts(self._library)), after)
            keys = (t if isinstance(t, str) else self._page_key(t) for t in texts)
            key = key_of("book", places, *keys)
            pieces = functools.partial(self._book, book, texts)
            yield KeptFile(book.path, key, functools.partial(_joined, pieces), pieces)

    def _book(self, book: Book, texts: tuple[str | Lesson, ...]) -> Iterator[bytes]:
        for text in texts:
            if isinstance(text, str):
                yield text.encode("utf-8", "replace")
            else:
                yield self._section(book, text)

    def _section(self, book: Book, lesson: Lesson) -> bytes:
        part = self._source.section(urls.lesson_path(lesson))
        return visible(book.section(part)).encode()

    # --- the e-book

    def _epub(self) -> KeptFile:
        course, results = self._library.course, self._library.results
        shown = (
            (course.key, course.title, course.summary, course.language, course.licence),
            course.base_url,
            [(level.id, level.title, level.summary) for level in course.levels],
            [(lesson.id, lesson.slug, lesson.title) for lesson in self._lessons],
            (results.engine, results.python),
            sorted(self._around.declarations),
        )
        lessons = map(self._page_key, self._lessons)
        key = key_of("epub", repr(shown), self._around.style, self._around.pictures, *lessons)
        return KeptFile(
            urls.EPUB, key, functools.partial(_joined, self._epub_pieces), self._epub_pieces
        )

    def _epub_pieces(self) -> Iterator[bytes]:
        around = self._around
        epub = Epub(self._library, around.style, around.declarations)
        links = key_of(epub.places, self._library.course.language)
        by_path = {epub.file_of(lesson): lesson for lesson in self._lessons}

        def key(lesson: Lesson) -> str:
            return key_of(epub.file_of(lesson), self._page_key(lesson), lesson.title, links)

        def part(lesson: Lesson) -> OpenChapter:
            return self._source.chapter(urls.lesson_path(lesson))

        chapters = Chapters(epub, key, part, around.keep, around.note)

        def pack(file: File) -> Deflated:
            lesson = by_path.get(file.path)
            return deflate(file.make()) if lesson is None else chapters.deflated(lesson)

        return packed(epub.files(chapters.facts(), around.picture), pack)


class _Made(Struct, Generic[Of], frozen=True):
    """Gives the bytes of a file; a course has many, so that they are small."""

    make: Callable[[Of], bytes]
    of: Of

    def __call__(self) -> bytes:
        return self.make(self.of)


def _shown(text: str | Lesson) -> str | Lesson:
    return visible(text) if isinstance(text, str) else text


def _joined(pieces: Callable[[], Iterator[bytes]]) -> bytes:
    return b"".join(pieces())


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

    def beside(self, path: str) -> Beside:
        """What a page gives to the files beside it, made now."""
        if self._entries[path].document(self._library) is not None:
            return self._exports(path).beside
        return Beside(twin_of(path, self._body(path)), None)

    def section(self, path: str) -> str:
        """What a lesson gives to the page of the whole course, made now."""
        return self._part(path).section

    def chapter(self, path: str) -> OpenChapter:
        """What a lesson gives to the e-book, made now."""
        return self._part(path).chapter

    def _part(self, path: str) -> LessonPart:
        part = self._exports(path).part
        assert part is not None, "a written lesson has a part"
        return part

    def _exports(self, path: str) -> PageExports:
        from coursebuild.render.draw import draw_whole
        from coursebuild.render.settling import settle_with

        body, tools, entry = self._body(path), self._library.tools, self._entries[path]
        found = entry.document(self._library)
        assert found is not None, "a page without a document gives nothing but its twin"
        sheet, document = entry.sheet(self._library), self._whole(found)
        _, text, page = draw_whole(sheet, document, tools)
        base = self._library.course.base_url
        return page_exports(sheet, page, tools, base, body, settle_with(text, text)[1])
