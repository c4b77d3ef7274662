"""The whole course as pages to be printed.

Entry points: `books(library)`, which pages there are; `Book.texts`, the body of one in pieces, and
`Book.section`, a lesson in it, so that no more than a lesson is held at a time.

A course of at most `MOST` written lessons is one page. A longer one is a page for each level, and
the contents: no browser prints a page of thousands of lessons.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from markupsafe import Markup
from msgspec import Struct

from coursebuild.model import Lesson
from coursebuild.render import urls
from coursebuild.render.draft import Draft
from coursebuild.render.exports.addresses import filled, quoted
from coursebuild.render.exports.outline import Entry, LevelEntry, Part, facts, written
from coursebuild.render.exports.parts import anchor
from coursebuild.render.library import Library

MOST = 250
"""Written lessons that are on one page at most."""
_HERE = Markup("<!--lessons-->")


class Book(Struct, frozen=True):
    """A page of lessons."""

    path: str
    """Its site path."""
    title: str
    summary: str
    levels: tuple[Part, ...]
    """All that its contents name."""
    places: Mapping[str, tuple[str, str]]
    """Where each written lesson is, by the site path of its page: the page, and the lesson's id."""
    shown: tuple[Part, ...]
    """The levels whose lessons are on it."""

    @property
    def lessons(self) -> tuple[Lesson, ...]:
        """The lessons on it."""
        return tuple(lesson for part in self.shown for lesson in part.lessons)

    def draft(self, library: Library) -> Draft:
        """The page, but for its body."""
        title = library.words("exports.book_title", title=self.title)
        return Draft(self.path, "book", title, self.summary, Markup(), indexed=False)

    def texts(self, library: Library) -> Iterator[str | Lesson]:
        """Its body; a lesson stands for its section."""
        place = urls.Place(self.path)
        entries = {part.id: self._entry(part) for part in self.levels}
        whole = library.render(
            "exports/book.html",
            title=self.title,
            summary=self.summary,
            facts=facts(library, sum(len(part.lessons) for part in self.levels)),
            epub=place.href(urls.EPUB),
            levels=tuple(entries.values()),
            lessons=_HERE,
        )
        before, _, after = str(whole).partition(_HERE)
        yield before
        for part in self.shown:
            yield f"{library.render('exports/level.html', level=entries[part.id])}\n"
            yield from part.lessons
        yield after

    def section(self, part: str) -> str:
        """What a lesson gives to the course, with its links put in."""
        return filled(part, self._address)

    def _entry(self, part: Part) -> LevelEntry:
        page, _ = self.places[urls.lesson_path(part.lessons[0])]  # and so are the others
        there, href = self._page(page), urls.Place(self.path).href(page, part.anchor)
        lessons = tuple(
            Entry(lesson.id, lesson.title, f"{there}#{quoted(anchor(lesson.id))}")
            for lesson in part.lessons
        )
        return LevelEntry(part.id, part.title, part.summary, part.anchor, href, lessons)

    def _page(self, page: str) -> str:
        """Where one of these pages is, as seen from here."""
        return "" if page == self.path else urls.Place(self.path).href(page)

    def _address(self, path: str, id: str, shown: bool = False) -> str:
        """Where a site path is, as seen from here: lessons are on these pages."""
        if path not in self.places:
            return urls.Place(self.path).href(path, id or None)
        page, lesson = self.places[path]
        return f"{self._page(page)}#{quoted(anchor(lesson, id) if id else anchor(lesson))}"


def books(library: Library) -> tuple[Book, ...]:
    """The pages; none where nothing is written."""
    course, levels = library.course, written(library)
    if not levels:
        return ()
    one = sum(len(part.lessons) for part in levels) <= MOST
    places = {
        urls.lesson_path(lesson): (urls.COURSE_PAGE if one else _level_page(part), lesson.id)
        for part in levels
        for lesson in part.lessons
    }
    first = Book(
        urls.COURSE_PAGE, course.title, course.summary, levels, places, levels if one else ()
    )
    if one:
        return (first,)
    rest = (
        Book(
            _level_page(part),
            f"{library.words('level.label', id=part.id)}: {part.title}",
            part.summary,
            (part,),
            places,
            (part,),
        )
        for part in levels
    )
    return (first, *rest)


def _level_page(part: Part) -> str:
    return f"{urls.COURSE_PAGES}{part.id}.html"
