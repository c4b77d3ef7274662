"""Relative addresses in a document, and the anchors of listings, outputs and models.

Entry points: `local_file`, `resolve`; `listing_anchor`, `line_anchor`, `output_anchor` and
`model_anchors`. A link to the file of a lesson or page means the lesson or page itself, so that the
same link works on the site and where the files are read.
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
    """The target of a link: a lesson or page if the link names its file, else unchanged."""
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
    """The ids on a model's page, without those in its file, given its declared scenarios."""
    return ("facts", "measured", *map(scenario_anchor, scenarios), "diet", "used", "file")


def scenario_anchor(name: str) -> str:
    """The id of the measurements of a declared scenario."""
    return f"measured-{name}"


_LINES = re.compile(r"(?P<stem>.+)\.L(?P<first>[1-9][0-9]{0,8})(?:-L(?P<last>[1-9][0-9]{0,8}))?")


def linked_lines(anchor: str) -> tuple[str, int, int] | None:
    """The listing's stem and the first and last line that an anchor names.

    `l4_2_inertia.L12-L20` gives `("l4_2_inertia", 12, 20)`; any other anchor, or a range that ends
    before it begins, gives `None`.
    """
    match = _LINES.fullmatch(anchor)
    if match is None:
        return None
    first = int(match["first"])
    last = int(match["last"] or first)
    return (match["stem"], first, last) if first <= last else None
