"""The whole course on one page, to be read without a network and to be printed.

Entry point: `page_file(context)`. The page needs no other file: its style sheet, fonts and pictures
are in it. It loads nothing and runs nothing, as its policy says.
"""

from __future__ import annotations

import base64
import functools
import posixpath
import re

from markupsafe import Markup

from coursebuild.core.model import Lesson, Level
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.added_files import ExportContext
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.direction import direction
from coursebuild.core.pages.html_tree import to_html
from coursebuild.features.book.lessons import (
    PICTURES,
    ending,
    facts,
    lesson_text,
    levels,
    site_address,
    style_path,
)
from coursebuild.features.book.rewrite import Rules

_LOWERED = 2
"""Levels that headings go down: the course is the first heading, its levels are the second."""
_ANSWERS = frozenset(("answer", "hint"))
_TYPES = {**PICTURES, "avif": "image/avif", "woff2": "font/woff2"}


def page_file(context: ExportContext) -> OutputFile:
    """The page."""
    course, found = context.course, levels(context)
    place = {urls.lesson_path(lesson): lesson.id for _, lessons in found for lesson in lessons}
    picture = functools.cache(functools.partial(_data_address, context))

    def address(path: str, anchor: str) -> str:
        if path in place:
            return f"#{urls.quoted(_anchor(place[path], anchor))}"
        return site_address(context, path, anchor)

    def text(lesson: Lesson) -> Markup:
        rules = Rules(
            urls.lesson_path(lesson),
            address,
            picture,
            functools.partial(_anchor, lesson.id),
            lowered=_LOWERED,
            closed=_ANSWERS,
            section=lesson.id,
        )
        return lesson_text(context, lesson, rules, to_html, _anchor(lesson.id))

    def level_anchor(level: Level) -> str:
        return _anchor("level", level.id)

    language = course.language or "en"
    html = context.library.render(
        "book/page.html",
        language=language,
        direction=direction(language),
        style=Markup(_style(context)),
        head_title=context.library.words("exports.book_title", title=course.title),
        title=course.title,
        summary=course.summary,
        facts=facts(context),
        licence=course.licence,
        levels=found,
        level_anchor=level_anchor,
        lesson_anchor=lambda lesson: _anchor(lesson.id),
        quoted=urls.quoted,
        text=text,
    )
    return OutputFile("course.html", visible(html).encode())


def _anchor(lesson: str, id: str = "_top") -> str:
    """The id on the page of what has an id in a lesson; of the lesson.

    In a drawing an id must be a name of XML, which does not begin with a digit.
    """
    return f"_{lesson}--{id or '_top'}"


def _style(context: ExportContext) -> str:
    """The style sheet, with the fonts in it. Nothing in it ends the element that it stands in."""
    path = style_path(context)
    folder = posixpath.dirname(path)

    def inside(match: re.Match[str]) -> str:
        return f'url("{_data_address(context, posixpath.join(folder, match[1]))}")'

    text = context.site()[path].make().decode()
    return re.sub(r'url\("([^"():]+)"\)', inside, text).replace("</", "<\\/")


def _data_address(context: ExportContext, path: str) -> str:
    """A file as an address that holds it; empty where it cannot be shown."""
    kind, file = _TYPES.get(ending(path)), context.site().get(path)
    if kind is None or file is None:
        return ""
    return f"data:{kind};base64,{base64.b64encode(file.make()).decode()}"
