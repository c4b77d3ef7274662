"""A course as one thing: what its page and its e-book are both made of.

Entry point: `WholeCourse`. Both are made from the files of the finished site: a lesson is what its
page says, and its pictures are those of the site.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.model import Lesson, Level, Status
from coursebuild.core.pages import urls
from coursebuild.core.pages.exports.rewrite import Rules, lesson_html, rewritten
from coursebuild.core.pages.html_tree import HtmlContent, parse_html
from coursebuild.core.pages.library import Library


class ContentsLesson(Struct, frozen=True):
    """A lesson in the contents."""

    id: str
    title: str
    href: str


class ContentsLevel(Struct, frozen=True):
    """A level with its written lessons, of which there is at least one."""

    id: str
    title: str
    summary: str
    href: str
    lessons: tuple[ContentsLesson, ...]


class WholeCourse(Struct, frozen=True):
    """A course and the files of its site."""

    library: Library
    files: Mapping[str, Callable[[], bytes]]
    """What makes a file, by its site path."""

    @property
    def levels(self) -> tuple[tuple[Level, tuple[Lesson, ...]], ...]:
        """The levels that have written lessons, with these."""
        course = self.library.course
        levels = ((level, tuple(filter(_is_written, level.lessons))) for level in course.levels)
        return tuple((level, lessons) for level, lessons in levels if lessons)

    @property
    def lessons(self) -> tuple[Lesson, ...]:
        """The written lessons, in order."""
        return tuple(lesson for _, lessons in self.levels for lesson in lessons)

    def contents(
        self, level_href: Callable[[Level], str], lesson_href: Callable[[Lesson], str]
    ) -> tuple[ContentsLevel, ...]:
        """The contents, with where each level and each lesson is."""

        def entry(lesson: Lesson) -> ContentsLesson:
            return ContentsLesson(lesson.id, lesson.title, lesson_href(lesson))

        return tuple(
            ContentsLevel(
                level.id, level.title, level.summary, level_href(level), tuple(map(entry, lessons))
            )
            for level, lessons in self.levels
        )

    def facts(self) -> str:
        """How much there is, and with what it was verified."""
        words, results = self.library.words, self.library.results
        verified = words("site.verified", engine=results.engine, python=results.python)
        return f"{words('exports.lessons', n=len(self.lessons))}. {verified}."

    def lesson(
        self, lesson: Lesson, rules: Rules, write: Callable[[list[HtmlContent]], str], top: str
    ) -> Markup:
        """A lesson for another place; `write` writes its tree, `top` is its own id there."""
        page = self.files[rules.path]().decode()
        article = write(list(rewritten(parse_html(lesson_html(page)), rules)))
        return self.library.render(
            "exports/lesson.html",
            lesson=lesson,
            draft=lesson.status is Status.DRAFT,
            article=Markup(article),
            top=top,
            heading=1 + rules.lowered,
        )

    def site_address(self, path: str, anchor: str) -> str:
        """Where something is on the site; empty where the course has no address."""
        address = urls.absolute(self.library.course, path)
        return f"{address}#{urls.quoted(anchor)}" if address and anchor else address


def _is_written(lesson: Lesson) -> bool:
    return lesson.document is not None
