"""Course maps, and what an author is told of them."""

from __future__ import annotations

from coursebuild.core.model import Course
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Source
from support.positioned_nodes import shown


def parse(text: str) -> Parsed[Course | None]:
    return parse_course_map(Source("content/course.toml", text))


def told(text: str) -> list[str]:
    return shown(parse(text).diagnostics)
