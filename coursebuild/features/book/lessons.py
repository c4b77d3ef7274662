"""The written lessons of a course, out of the pages of its site.

Entry points: `levels`, which lessons there are; `lesson_text`, one of them for another place.
"""

from __future__ import annotations

from collections.abc import Callable

from markupsafe import Markup

from coursebuild.core.model import Lesson, Level
from coursebuild.core.pages import urls
from coursebuild.core.pages.added_files import ExportContext
from coursebuild.core.pages.html_tree import HtmlContent, parse_html
from coursebuild.features.book.rewrite import Rules, rewritten

PICTURES = {
    "gif": "image/gif",
    "jpeg": "image/jpeg",
    "jpg": "image/jpeg",
    "png": "image/png",
    "svg": "image/svg+xml",
    "webp": "image/webp",
}
"""Of the pictures that every reading system shows, by ending."""
_BEFORE, _AFTER = '<div class="prose">\n', '\n</div>\n<div class="lesson-end"'
"""What stands around the text of a lesson, see `templates/lesson.html`."""


def levels(context: ExportContext) -> list[tuple[Level, list[Lesson]]]:
    """The levels that have written lessons, with these."""
    found = ((one, [x for x in one.lessons if x.document]) for one in context.course.levels)
    return [(level, lessons) for level, lessons in found if lessons]


def facts(context: ExportContext) -> str:
    """How many lessons there are, and with what they were verified."""
    words, results = context.library.words, context.library.results
    verified = words("site.verified", engine=results.engine, python=results.python)
    count = sum(len(lessons) for _, lessons in levels(context))
    return f"{words('exports.lessons', n=count)}. {verified}."


def lesson_text(
    context: ExportContext,
    lesson: Lesson,
    rules: Rules,
    write: Callable[[list[HtmlContent]], str],
    top: str,
) -> Markup:
    """A lesson for another place; `write` writes its tree, `top` is its own id there."""
    page = context.site()[rules.path].make().decode()
    text = page.partition(_BEFORE)[2].rpartition(_AFTER)[0]
    return context.library.render(
        "book/lesson.html",
        lesson=lesson,
        draft=lesson.status == "draft",
        article=Markup(write(list(rewritten(parse_html(text), rules)))),
        top=top,
        heading=1 + rules.lowered,
    )


def site_address(context: ExportContext, path: str, anchor: str) -> str:
    """Where something is on the site; empty where the course has no address."""
    address = urls.absolute(context.course, path)
    return f"{address}#{urls.quoted(anchor)}" if address and anchor else address


def style_path(context: ExportContext) -> str:
    """The style sheet of the site's pages."""
    paths = (path for path in context.site() if path.startswith("assets/site."))
    return next(path for path in paths if path.endswith(".css"))


def ending(path: str) -> str:
    """By which the kind of a file is known."""
    return path.lower().rpartition(".")[2]
