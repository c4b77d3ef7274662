"""`llms.txt`: the course in one Markdown file of links, for language models.

Entry point: `write_llms(library)`. Format: <https://llmstxt.org>.

There is no `llms-full.txt`: for thousands of lessons it would have tens of megabytes, more than any
model reads, and every edit would write it again. The links lead to pages in Markdown, one for each
lesson.
"""

from __future__ import annotations

from coursebuild.core.model import Lesson
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.marks import escape_line, link
from coursebuild.core.text.characters import visible

PATH = "llms.txt"


def write_llms(library: Library) -> bytes:
    """Return the content of the file."""
    course, words = library.course, library.words
    parts = [f"# {escape_line(course.title)}"]
    if course.summary:
        parts.append(f"> {escape_line(course.summary)}")
    parts.append(words("exports.llms"))
    for level in course.written_levels:
        label = f"{words('level.label', id=level.id)}: {level.title}"
        rows = (_lesson_row(library, lesson) for lesson in level.lessons)
        parts.append("\n".join((f"## {escape_line(label)}", "", *rows)))
    parts += _optional_part(library)
    return visible("\n\n".join(parts) + "\n").encode()


def _lesson_row(library: Library, lesson: Lesson) -> str:
    path = urls.lesson_path(lesson)
    return _row(library, path, f"{lesson.id} {lesson.title}", lesson.summary)


def _optional_part(library: Library) -> list[str]:
    """Return the list of pages that can be left out where there is little room."""
    course, words = library.course, library.words
    rows = [_row(library, urls.HOME, words("site.map"), "")]
    rows += [_row(library, urls.page_path(page), page.title, "") for page in course.pages]
    rows += [
        _row(library, urls.model_page_path(m.name), words("model.title", name=m.name), "")
        for m in course.models
    ]
    if library.reports.cases:
        title, text = words("numerics.title"), words("numerics.description")
        rows.append(_row(library, urls.NUMERICS, title, text))
    return ["\n".join(("## Optional", "", *rows))]


def _row(library: Library, path: str, title: str, text: str) -> str:
    copy = urls.copy_path(path, ".md")
    address = urls.absolute(library.course.base_url, copy) or urls.encode(copy)
    return f"- {link(escape_line(title), address)}" + (f": {escape_line(text)}" if text else "")
