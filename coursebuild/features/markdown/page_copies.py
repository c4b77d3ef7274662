"""Every page as plain Markdown, for people, feeds and language models, and the list `llms.txt`.

A lesson or page of the course is written from its document; all others (home, levels, models,
measured figures) from their HTML, so that both say the same.

There is no `llms-full.txt` (<https://llmstxt.org>): for thousands of lessons it would have tens of
megabytes, more than any model reads, and every edit would write it again.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import TypeAlias
from urllib.parse import urlsplit

from coursebuild.api import (
    CachedFile,
    Library,
    OutputFile,
    PageContext,
    PageInputs,
    SiteContext,
    SiteFile,
    urls,
)
from coursebuild.core.pages.document_inputs import LessonLink, LevelView
from coursebuild.core.pages.marks import code_span, escape_line, guard_lines, link
from coursebuild.core.pages.renderer import Strings
from coursebuild.core.registry import has_copies
from coursebuild.core.text.characters import visible
from coursebuild.features.markdown.from_html import html_to_markdown
from coursebuild.features.markdown.writer import DocumentWriter

Locate: TypeAlias = Callable[[str], str]
_EXTENSION = ".md"


def markdown_files(site: SiteContext) -> Iterator[SiteFile]:
    """Yield the copies of all pages, unless the author has a file of that name, and their list."""
    author_paths = {urls.file_path(path) for path in site.library.course.files}
    for page in site.pages:
        path = urls.copy_path(page.path, _EXTENSION)
        if path not in author_paths:
            yield CachedFile(path, page.digest, functools.partial(site.note, page.path))
    yield OutputFile(LLMS_PATH, write_llms(site.library))


def note_markdown(inputs: PageInputs, page: PageContext | None, body: str) -> bytes:
    """Return the text of a page; empty if it has no copy."""
    if not has_copies(inputs.head.path):
        return b""
    place = urls.Place(inputs.head.path)
    locate = functools.partial(markdown_href, place)
    if page is None or inputs.head.kind == "home":
        text = html_to_markdown(body, locate)
        return visible(f"{text}\n").encode()
    words, document = page.renderer.words, page.document
    writer = DocumentWriter(page, locate, place.href(place.path))
    rows = []
    scripts = inputs.values.get("scripts")
    if isinstance(scripts, tuple) and scripts:
        script_links = (link(code_span(path), href) for path, href in scripts)
        rows.append(f"{escape_line(words('lesson.scripts'))}: {', '.join(script_links)}")
    for name, key in (
        ("leads", "lesson.leads"),
        ("previous", "lesson.previous"),
        ("following", "lesson.next"),
    ):
        links = lesson_links(inputs.values.get(name), locate)
        if links:
            rows.append(f"{escape_line(words(key))}: {', '.join(links)}")
    parts = (
        *head(inputs, words, locate),
        writer.blocks(document.blocks),
        writer.footnotes(document.footnotes),
        writer.references(),
        *(["___", "\n".join(f"- {row}" for row in rows)] if rows else []),
    )
    text = "\n\n".join(filter(None, parts))
    return visible(f"{text}\n").encode()


def markdown_href(place: urls.Place, href: str) -> str:
    """Return the address for a link in a page's copy: links to pages lead to their copies."""
    path, _ = place.target(href)
    if path is None or path.startswith("files/") or not has_copies(path):
        return href
    parts = urlsplit(href)
    if not parts.path.endswith(".html"):
        return href
    return parts._replace(path=urls.copy_path(parts.path, _EXTENSION)).geturl()


def head(inputs: PageInputs, words: Strings, locate: Locate) -> list[str]:
    """Return the title, summary, facts and objectives of a lesson; of other pages the title."""
    lesson = inputs.values.get("lesson")
    if not isinstance(lesson, LessonLink):
        return [f"# {escape_line(inputs.head.title)}"]
    parts = [f"# {escape_line(f'{lesson.id} {lesson.title}')}"]
    if lesson.summary:
        parts.append(guard_lines(escape_line(lesson.summary)))
    facts = []
    level = inputs.values.get("level")
    if isinstance(level, LevelView):
        name = f"{words('level.label', id=level.id)}: {level.title}"
        facts.append(link(escape_line(name), locate(level.href)))
    if lesson.status != "complete":
        facts.append(escape_line(words(f"status.{lesson.status}")))
    if lesson.minutes:
        facts.append(escape_line(words("lesson.minutes", n=lesson.minutes)))
    if lesson.further:
        facts.append(escape_line(words("lesson.more_minutes", n=lesson.further)))
    needs = lesson_links(lesson.needs, locate)
    if needs:
        facts.append(f"{escape_line(words('lesson.needs'))} {', '.join(needs)}")
    parts.append(" · ".join(facts))
    if lesson.objectives:
        items = "\n".join(f"- {guard_lines(escape_line(text))}" for text in lesson.objectives)
        parts.append(f"{escape_line(words('lesson.objectives'))}\n\n{items}")
    return parts


def lesson_links(value: object, locate: Locate) -> list[str]:
    """Return links to the lessons in a value of a page's inputs: one, or a tuple of them."""
    lessons = value if isinstance(value, tuple) else (value,)
    return [
        link(escape_line(f"{lesson.id} {lesson.title}"), locate(lesson.href))
        for lesson in lessons
        if isinstance(lesson, LessonLink)
    ]


LLMS_PATH = "llms.txt"


def write_llms(library: Library) -> bytes:
    """Return the content of the file."""
    course, words = library.course, library.words
    parts = [f"# {escape_line(course.title)}"]
    if course.summary:
        parts.append(f"> {escape_line(course.summary)}")
    parts.append(words("exports.llms"))
    for level in course.written_levels:
        label = f"{words('level.label', id=level.id)}: {level.title}"
        rows = (
            _row(library, urls.lesson_path(lesson), f"{lesson.id} {lesson.title}", lesson.summary)
            for lesson in level.lessons
        )
        parts.append("\n".join((f"## {escape_line(label)}", "", *rows)))
    for section in dict.fromkeys(page.section for page in course.pages if page.section):
        pages = (page for page in course.pages if page.section == section)
        rows = (_row(library, urls.page_path(page), page.title, "") for page in pages)
        parts.append("\n".join((f"## {escape_line(section)}", "", *rows)))
    # What can be left out where there is little room
    optional_rows = [_row(library, urls.HOME, words("site.map"), "")]
    optional_rows += [
        _row(library, urls.page_path(page), page.title, "")
        for page in course.pages
        if not page.section and not page.is_home
    ]
    optional_rows += [
        _row(library, urls.model_page_path(m.name), words("model.title", name=m.name), "")
        for m in course.models
    ]
    if library.reports.cases:
        title, text = words("numerics.title"), words("numerics.description")
        optional_rows.append(_row(library, urls.NUMERICS, title, text))
    parts.append("\n".join(("## Optional", "", *optional_rows)))
    return visible("\n\n".join(parts) + "\n").encode()


def _row(library: Library, path: str, title: str, text: str) -> str:
    copy = urls.copy_path(path, ".md")
    address = urls.absolute(library.course.base_url, copy) or urls.encode(copy)
    return f"- {link(escape_line(title), address)}" + (f": {escape_line(text)}" if text else "")
