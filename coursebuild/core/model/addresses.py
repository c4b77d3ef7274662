"""Relative addresses in a document, as the files of the course that they name.

Entry points: `local_file`, `resolve`; `listing_anchor` and its siblings, by which listings and
outputs are linked to on their page, and `model_anchors`, those of a model's. A link to the file of
a lesson or of a page means the lesson or the page, so that the same link works on the site and
where the files themselves are read.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable
from urllib.parse import unquote, urlsplit

from coursebuild.core.model.course import Course
from coursebuild.core.model.inlines import LessonTarget, PageTarget, Target, UrlTarget


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


def listing_anchor(path: str) -> str:
    """The anchor of a listing: `l4_2_inertia.py` for the script `examples/l4_2_inertia.py`.

    It has a dot, which no anchor made from a heading's text has.
    """
    return re.sub(r"\s", "\u2423", path.removeprefix("examples/").removeprefix("models/"))


def line_anchor(path: str, line: int) -> str:
    """The anchor of a line of a listing, from 1: `l4_2_inertia.L12`."""
    return f"{_stem(path)}.L{line}"


def output_anchor(path: str, number: int) -> str:
    """The anchor of an output of a script, from 1: `l4_2_inertia.out`, `l4_2_inertia.out-2`."""
    return f"{_stem(path)}.out" + (f"-{number}" if number > 1 else "")


def _stem(path: str) -> str:
    return listing_anchor(path).rpartition(".")[0]


def model_anchors(scenarios: Iterable[str]) -> tuple[str, ...]:
    """The ids of a model's page, but those of its file; `scenarios` are those that it declares."""
    return ("facts", "measured", *map(scenario_anchor, scenarios), "diet", "used", "file")


def scenario_anchor(name: str) -> str:
    """The id of what was measured in a scenario that is declared."""
    return f"measured-{name}"


_LINES = re.compile(r"(?P<stem>.+)\.L(?P<first>[1-9][0-9]{0,8})(?:-L(?P<last>[1-9][0-9]{0,8}))?")


def linked_lines(anchor: str) -> tuple[str, int, int] | None:
    """The stem of a listing's anchors, and the lines that an anchor names.

    `l4_2_inertia.L12-L20` gives `("l4_2_inertia", 12, 20)`; `None` for the anchor of something
    else, or of a range that ends before it begins.
    """
    found = _LINES.fullmatch(anchor)
    if found is None:
        return None
    first = int(found["first"])
    last = int(found["last"] or first)
    return (found["stem"], first, last) if first <= last else None
