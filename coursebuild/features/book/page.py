"""The whole course on one page, to be read without a network and to be printed.

Entry point: `page_file(context)`. The page contains its style sheet, fonts and pictures. It loads
nothing and runs nothing, as its security policy says.
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
from coursebuild.core.pages.context import ExportContext
from coursebuild.core.pages.html_tree import to_html
from coursebuild.core.pages.strings import direction
from coursebuild.core.text.characters import visible
from coursebuild.features.book.chapters import (
    PICTURES,
    RewriteRules,
    extension,
    render_lesson,
    site_address,
    style_path,
    summary_line,
)

_HEADING_SHIFT = 2
"""Levels that headings move down: the course is the first heading, its levels are the second."""
_ANSWERS = frozenset(("answer", "hint"))
_FOLDS = _ANSWERS | {"callout", "further-text", "lab-note"}
"""With what authors fold, where the map says that it stays folded."""
_TYPES = {**PICTURES, "avif": "image/avif", "woff2": "font/woff2"}


def page_file(context: ExportContext, *, page_numbers: bool = False) -> OutputFile:
    """Return the page; with `page_numbers` its contents have room for these."""
    course = context.course
    ids = {urls.lesson_path(lesson): lesson.id for lesson in course.written_lessons}
    picture = functools.cache(functools.partial(_data_address, context))

    def address(path: str, anchor: str) -> str:
        if path in ids:
            return f"#{urls.quote_anchor(_anchor(ids[path], anchor))}"
        return site_address(context, path, anchor)

    def text(lesson: Lesson) -> Markup:
        rules = RewriteRules(
            urls.Place(urls.lesson_path(lesson)),
            address,
            picture,
            functools.partial(_anchor, lesson.id),
            heading_shift=_HEADING_SHIFT,
            closed_classes=_ANSWERS if course.folds == "open" else _FOLDS,
            section=lesson.id,
        )
        return render_lesson(context, lesson, rules, to_html, _anchor(lesson.id))

    def level_anchor(level: Level) -> str:
        return _anchor("level", level.id)

    language = course.language or "en"
    html = context.library.render(
        "book/page.html",
        language=language,
        direction=direction(language),
        style=Markup(_embed_fonts(context)),
        head_title=context.library.words("exports.book_title", title=course.title),
        title=course.title,
        summary=course.summary,
        facts=summary_line(context),
        licence=course.licence,
        levels=course.written_levels,
        level_anchor=level_anchor,
        lesson_anchor=lambda lesson: _anchor(lesson.id),
        quoted=urls.quote_anchor,
        page_numbers=page_numbers,
        text=text,
    )
    return OutputFile("course.html", visible(html).encode())


def _anchor(lesson: str, id: str = "_top") -> str:
    """Return the id on this page for an id in a lesson, or for the lesson.

    It does not begin with a digit, since in a drawing it must be a name of XML.
    """
    return f"_{lesson}--{id or '_top'}"


def _embed_fonts(context: ExportContext) -> str:
    """Return the style sheet with its fonts, and without `</`, which could end the element."""
    path = style_path(context)
    folder = posixpath.dirname(path)

    def embed(match: re.Match[str]) -> str:
        return f'url("{_data_address(context, posixpath.join(folder, match[1]))}")'

    text = context.site()[path].make().decode()
    return re.sub(r'url\("([^"():]+)"\)', embed, text).replace("</", "<\\/")


def _data_address(context: ExportContext, path: str) -> str:
    """Return a file as a `data:` address; empty if it cannot be shown."""
    kind, file = _TYPES.get(extension(path)), context.site().get(path)
    if kind is None or file is None:
        return ""
    return f"data:{kind};base64,{base64.b64encode(file.make()).decode()}"
