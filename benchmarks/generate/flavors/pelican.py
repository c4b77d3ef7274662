"""The course for Pelican, with Python-Markdown.

Formulas by the plugin render-math, which leaves them to MathJax in the reader's browser. Codehilite
highlights; the theme is the one that Pelican comes with. Feeds and the pages by author, category
and tag, which a course has no use for, are off. Content is cached, as the manual says to be quick.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.generate.document import Lesson
from benchmarks.generate.flavors.common import indent, write_text
from benchmarks.generate.flavors.markdown import Dialect

CONFIG = """SITENAME = "Methods and their errors"
SITEURL = ""
PATH = "content"
TIMEZONE = "UTC"
DEFAULT_LANG = "en"
THEME = "simple"
FEED_ALL_ATOM = None
CATEGORY_FEED_ATOM = None
TRANSLATION_FEED_ATOM = None
AUTHOR_FEED_ATOM = None
AUTHOR_FEED_RSS = None
STATIC_PATHS = []
DIRECT_TEMPLATES = ["index"]
AUTHOR_SAVE_AS = CATEGORY_SAVE_AS = TAG_SAVE_AS = ""
ARTICLE_URL = ARTICLE_SAVE_AS = "{slug}.html"
PLUGINS = ["pelican.plugins.render_math"]
DEFAULT_PAGINATION = False
CACHE_CONTENT = True
LOAD_CONTENT_CACHE = True
CONTENT_CACHING_LAYER = "reader"
CHECK_MODIFIED_METHOD = "mtime"
MARKDOWN = {
    "extension_configs": {
        "markdown.extensions.admonition": {},
        "markdown.extensions.codehilite": {"css_class": "highlight"},
        "markdown.extensions.extra": {},
        "markdown.extensions.toc": {},
    },
    "output_format": "html5",
}
"""


def callout(kind: str, title: str, folded: bool, body: str) -> str:
    """An admonition of Python-Markdown, which cannot fold."""
    return f'!!! {kind} "{title}"\n{indent(body)}'


def write(lessons: list[Lesson], folder: Path) -> None:
    """The settings, and an article for each lesson."""
    names = {lesson.id: lesson.name for lesson in lessons}
    dialect = Dialect(callout, lambda id_: f"{{filename}}{names[id_]}.md")
    for lesson in lessons:
        slug = lesson.name.replace(".", "-")
        hour, minute = divmod(lesson.number, 60)
        date = f"2026-01-{hour // 24 + 1:02d} {hour % 24:02d}:{minute:02d}"
        head = (
            f"Title: {lesson.title}\nDate: {date}\nSlug: {slug}\n"
            f"Category: part {lesson.id.split('.')[0]}\nSummary: {lesson.summary}\n"
        )
        text = f"{head}\n{dialect.lesson(lesson)}"
        write_text(folder / "content" / f"{lesson.name}.md", text)
    write_text(folder / "pelicanconf.py", CONFIG)
