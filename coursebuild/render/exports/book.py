"""The whole course as pages to be printed.

Entry points: `books(library)`, which pages there are; `Book.texts`, the body of one in pieces, so
that no more than a lesson is held at a time.

A course of at most `MOST` written lessons is one page. A longer one is a page for each level, and
the contents: no browser prints a page of thousands of lessons.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from markupsafe import Markup

from coursebuild.model import Lesson
from coursebuild.render import urls
from coursebuild.render.draft import Draft
from coursebuild.render.exports.addresses import filled, quoted
from coursebuild.render.exports.outline import Entry, LevelEntry, Part, facts, written
from coursebuild.render.exports.parts import anchor
from coursebuild.render.library import Library
from coursebuild.values import dataclass

MOST = 250
"""Written lessons that are on one page at most."""
_HERE = Markup("<!--lessons-->")


@dataclass(frozen=True, slots=True)
class Book:
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

    def texts(self, library: Library, section: Callable[[Lesson], str]) -> Iterator[str]:
        """Its body; `section` gives a lesson's part."""
        place = urls.Place(self.path)
        whole = library.render(
            "exports/book.html",
            title=self.title,
            summary=self.summary,
            facts=facts(library, sum(len(part.lessons) for part in self.levels)),
            epub=place.href(urls.EPUB),
            levels=tuple(map(self._entry, self.levels)),
            lessons=_HERE,
        )
        before, _, after = str(whole).partition(_HERE)
        yield before
        for part in self.shown:
            yield f"{library.render('exports/level.html', level=self._entry(part))}\n"
            for lesson in part.lessons:
                yield filled(section(lesson), self._address)
        yield after

    def _entry(self, part: Part) -> LevelEntry:
        lessons = tuple(
            Entry(lesson.id, lesson.title, self._address(urls.lesson_path(lesson), ""))
            for lesson in part.lessons
        )
        page, _ = self.places[urls.lesson_path(part.lessons[0])]
        href = urls.Place(self.path).href(page, part.anchor)
        return LevelEntry(part.id, part.title, part.summary, part.anchor, href, lessons)

    def _address(self, path: str, id: str, shown: bool = False) -> str:
        """Where a site path is, as seen from here: lessons are on these pages."""
        place = urls.Place(self.path)
        if path not in self.places:
            return place.href(path, id or None)
        page, lesson = self.places[path]
        there = quoted(anchor(lesson, id) if id else anchor(lesson))
        return f"{'' if page == self.path else place.href(page)}#{there}"


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
