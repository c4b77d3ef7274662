"""Takes the lessons of a course from the pages of its site.

Entry point: `render_lesson`, one of them for use elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable

from markupsafe import Markup

from coursebuild.core.model import Lesson
from coursebuild.core.pages import urls
from coursebuild.core.pages.added_files import ExportContext
from coursebuild.core.pages.html_tree import HtmlContent, parse_html
from coursebuild.features.book.rewrite import RewriteRules, rewrite

PICTURES = {
    "gif": "image/gif",
    "jpeg": "image/jpeg",
    "jpg": "image/jpeg",
    "png": "image/png",
    "svg": "image/svg+xml",
    "webp": "image/webp",
}
"""Media types of the pictures that every reading system shows, by extension."""
_TEXT_START, _TEXT_END = '<div class="prose">\n', '\n</div>\n<div class="lesson-end"'
"""What surrounds the text of a lesson, see `templates/lesson.html`."""


def summary_line(context: ExportContext) -> str:
    """Return the number of lessons, and the versions that they were verified with."""
    words, results = context.library.words, context.library.results
    verified = words("site.verified", engine=results.engine, python=results.python)
    lessons = words("exports.lessons", n=len(context.course.written_lessons))
    return f"{lessons}. {verified}."


def render_lesson(
    context: ExportContext,
    lesson: Lesson,
    rules: RewriteRules,
    write: Callable[[list[HtmlContent]], str],
    top: str,
) -> Markup:
    """Render a lesson for use elsewhere; `write` writes its tree, `top` is its own id there."""
    page = context.site()[rules.place.path].make().decode()
    text = page.partition(_TEXT_START)[2].rpartition(_TEXT_END)[0]
    return context.library.render(
        "book/lesson.html",
        lesson=lesson,
        draft=lesson.status == "draft",
        article=Markup(write(list(rewrite(parse_html(text), rules)))),
        top=top,
        heading=1 + rules.heading_shift,
    )


def site_address(context: ExportContext, path: str, anchor: str) -> str:
    """Return the address of a page on the site; empty if the course has none."""
    address = urls.absolute(context.course.base_url, path)
    return f"{address}#{urls.quote_anchor(anchor)}" if address and anchor else address


def style_path(context: ExportContext) -> str:
    """Return the path of the style sheet of the site's pages."""
    paths = (path for path in context.site() if path.startswith("assets/site."))
    return next(path for path in paths if path.endswith(".css"))


def extension(path: str) -> str:
    """Return the extension of a file in lower case."""
    return path.lower().rpartition(".")[2]
