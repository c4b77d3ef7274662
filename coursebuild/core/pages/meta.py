"""Metadata for machines: titles, social cards, structured data, sitemap, robots.

Entry points: `head_title`, `social`, `course_data`, `lesson_data`, `sitemap`, `robots`.

Whatever needs the site's full address is left out if the course does not give that.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from html import escape
from typing import TypeAlias

from markupsafe import Markup

from coursebuild.core.model import Course, Lesson
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import PageHead
from coursebuild.core.text.characters import visible

Json: TypeAlias = "str | int | list[Json] | dict[str, Json]"


def head_title(course_title: str, title: str, kind: str) -> str:
    """The title for the browser's tab: the page, then the course."""
    return title if kind == "home" or title == course_title else f"{title} · {course_title}"


def social(course_title: str, base_url: str, head: PageHead) -> tuple[tuple[str, str], ...]:
    """Open Graph properties."""
    pairs = (
        ("og:type", "article" if head.kind == "lesson" else "website"),
        ("og:site_name", course_title),
        ("og:title", head.title),
        ("og:description", head.description),
        ("og:url", urls.absolute(base_url, head.path)),
    )
    return tuple((name, value) for name, value in pairs if value)


def course_data(library: Library) -> Markup:
    """Structured data of the home page: the course and its written lessons."""
    course = library.course
    parts: list[Json] = [
        _resource(library, lesson) for lesson in course.lessons if lesson.status != "planned"
    ]
    return _script({**_context("Course"), **_course(course), "hasPart": parts})


def lesson_data(library: Library, lesson: Lesson) -> Markup:
    """Structured data of a lesson."""
    return _script(
        {
            **_context("LearningResource"),
            **_resource(library, lesson),
            "isPartOf": {"@type": "Course", **_course(library.course)},
        }
    )


def _context(kind: str) -> dict[str, Json]:
    return {"@context": "https://schema.org", "@type": kind}


def _course(course: Course) -> dict[str, Json]:
    address = urls.absolute(course.base_url, urls.HOME)
    return _filled(
        {
            "name": course.title,
            "description": course.summary,
            "inLanguage": course.language,
            "url": address,
        }
    )


def _resource(library: Library, lesson: Lesson) -> dict[str, Json]:
    needs: list[Json] = [library.lessons[need].title for need in lesson.prerequisites]
    return _filled(
        {
            "@type": "LearningResource",
            "name": lesson.title,
            "description": lesson.summary,
            "url": urls.absolute(library.course.base_url, urls.lesson_path(lesson)),
            "inLanguage": library.course.language,
            "learningResourceType": "lesson",
            "teaches": list(lesson.objectives),
            "competencyRequired": needs,
            "timeRequired": f"PT{lesson.minutes}M" if lesson.minutes else "",
            "license": library.course.licence,
        }
    )


def _filled(data: dict[str, Json]) -> dict[str, Json]:
    return {key: value for key, value in data.items() if value not in ("", [])}


def _script(data: dict[str, Json]) -> Markup:
    """JSON for a `script` element, with nothing in it that could end the element."""
    text = visible(json.dumps(data, ensure_ascii=False, separators=(",", ":")))
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def sitemap(course: Course, paths: Iterable[str]) -> bytes:
    """The sitemap of the given pages; the course must have a base address."""
    rows = "".join(
        f"<url><loc>{escape(urls.absolute(course.base_url, path), quote=False)}</loc></url>\n"
        for path in paths
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<urlset xmlns="http://www.sitemaps.org/schemas/sitemap/0.9">\n' + rows + "</urlset>\n"
    ).encode()


def robots(course: Course) -> bytes:
    """A robots.txt that allows everything and names the sitemap."""
    lines = ["User-agent: *", "Allow: /"]
    if course.base_url:
        lines.append(f"Sitemap: {urls.absolute(course.base_url, urls.SITEMAP)}")
    return ("\n".join(lines) + "\n").encode()
