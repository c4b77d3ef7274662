"""The whole course on one page, to be read without a network and to be printed.

Entry point: `book(course, style)`, the bytes of the page. The page needs no other file: its style
sheet, fonts and pictures are in it. It loads nothing and runs nothing, as its policy says.
"""

from __future__ import annotations

import base64
import functools
import posixpath
import re

from markupsafe import Markup

from coursebuild.core.model import Lesson
from coursebuild.core.pages import urls
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.direction import direction
from coursebuild.core.pages.exports.rewrite import Rules
from coursebuild.core.pages.exports.whole_course import WholeCourse
from coursebuild.core.pages.html_tree import to_html
from coursebuild.core.text.patterns import pattern

MARK = b'<meta name="generator" content="coursebuild: the whole course">'
"""Stands near the beginning of each such page, and in no page of a site."""
_LOWERED = 2
"""Levels that headings go down: the course is the first heading, its levels are the second."""
_ANSWERS = frozenset(("answer", "hint"))
_URL = pattern(r'url\("([^"():]+)"\)')
_TYPES = {
    "gif": "image/gif",
    "jpeg": "image/jpeg",
    "jpg": "image/jpeg",
    "png": "image/png",
    "svg": "image/svg+xml",
    "webp": "image/webp",
    "avif": "image/avif",
    "woff2": "font/woff2",
}


def book(course: WholeCourse, style: str) -> bytes:
    """The page; `style` is the site path of the style sheet."""
    library, words = course.library, course.library.words
    about = library.course
    contents = course.contents(
        lambda level: f"#{urls.quoted(_anchor('level', level.id))}",
        lambda lesson: f"#{urls.quoted(_anchor(lesson.id))}",
    )
    place = {urls.lesson_path(lesson): lesson.id for lesson in course.lessons}
    picture = functools.cache(functools.partial(_data_address, course))

    def address(path: str, anchor: str) -> str:
        if path in place:
            return f"#{urls.quoted(_anchor(place[path], anchor))}"
        return course.site_address(path, anchor)

    def section(lesson: Lesson) -> Markup:
        rules = Rules(
            urls.lesson_path(lesson),
            address,
            picture,
            functools.partial(_anchor, lesson.id),
            lowered=_LOWERED,
            closed=_ANSWERS,
            section=lesson.id,
        )
        return course.lesson(lesson, rules, to_html, _anchor(lesson.id))

    language = about.language or "en"
    levels = (
        (level, _anchor("level", level.id), map(section, lessons))
        for level, lessons in course.levels
    )
    page = library.render(
        "exports/book.html",
        mark=Markup(MARK.decode()),
        language=language,
        direction=direction(language),
        style=Markup(_style(course, style)),
        head_title=words("exports.book_title", title=about.title),
        title=about.title,
        summary=about.summary,
        facts=course.facts(),
        licence=about.licence,
        contents=contents,
        levels=levels,
    )
    return visible(page).encode()


def _anchor(lesson: str, id: str = "_top") -> str:
    """The id on the page of what has an id in a lesson; of the lesson.

    In a drawing an id must be a name of XML, which does not begin with a digit.
    """
    return f"_{lesson}--{id or '_top'}"


def _style(course: WholeCourse, path: str) -> str:
    """The style sheet, with the fonts in it. Nothing in it ends the element that it stands in."""
    folder = posixpath.dirname(path)

    def inside(match: re.Match[str]) -> str:
        return f'url("{_data_address(course, posixpath.join(folder, match[1]))}")'

    return _URL.sub(inside, course.files[path]().decode()).replace("</", "<\\/")


def _data_address(course: WholeCourse, path: str) -> str:
    """A file as an address that holds it; empty where it cannot be shown."""
    kind = _TYPES.get(path.lower().rpartition(".")[2])
    if kind is None or path not in course.files:
        return ""
    return f"data:{kind};base64,{base64.b64encode(course.files[path]()).decode()}"
