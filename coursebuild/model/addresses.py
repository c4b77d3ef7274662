"""Relative addresses in a document, as the files of the course that they name.

Entry points: `local_file`, `resolve`. A link to the file of a lesson or of a page means the lesson
or the page, so that the same link works on the site and where the files themselves are read.
"""

from __future__ import annotations

import posixpath
from urllib.parse import unquote, urlsplit

from coursebuild.model.course import Course
from coursebuild.model.inlines import LessonTarget, PageTarget, Target, UrlTarget


def local_file(url: str, document_path: str) -> str:
    """The path, from the project root, of the file that a relative address in a document names."""
    path = unquote(url.split("#", 1)[0].split("?", 1)[0])
    base = "" if path.startswith("/") else posixpath.dirname(document_path)
    return posixpath.normpath(posixpath.join(base, path.lstrip("/")))


def resolve(target: Target, course: Course, document_path: str) -> Target:
    """What a link leads to: a lesson or page where it names the file of one, else as it was."""
    if not isinstance(target, UrlTarget) or ".md" not in target.url:
        return target
    try:
        parts = urlsplit(target.url)
    except ValueError:
        return target
    if parts.scheme or parts.netloc or not parts.path.endswith(".md"):
        return target
    path, anchor = local_file(target.url, document_path), parts.fragment or None
    for page in course.pages:
        if page.path == path:
            return PageTarget(page.id, anchor)
    for lesson in course.lessons:
        if lesson.path == path:
            return LessonTarget(lesson.id, anchor)
    return target
