"""The topics of lessons: the files in `problems/`, filled with the numbers of one lesson.

Entry point: `topic_of`. Everything depends on the number of the lesson alone, so that two runs, and
two machines, make the same course.
"""

from __future__ import annotations

import functools
import tomllib
import zlib
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Any

FOLDER = Path(__file__).with_name("problems")


def pick(lesson: int, purpose: str, count: int) -> int:
    """A number from 0 to count - 1 that looks random and is not."""
    return zlib.crc32(f"{purpose} {lesson}".encode()) % count


class Fill(Template):
    """A text with numbers as `@{name}`: TeX needs the dollar sign and Python the braces."""

    delimiter = "@"


@dataclass(frozen=True, slots=True)
class Topic:
    """One problem with a known solution."""

    data: dict[str, Any]
    values: dict[str, str]
    """The numbers of this lesson, as they are written."""

    def text(self, *path: str) -> str:
        """A text of the file, with the numbers in it."""
        return self.fill(self.raw(*path))

    def texts(self, *path: str) -> tuple[str, ...]:
        """A list of texts, likewise."""
        return tuple(self.fill(text) for text in self.raw(*path))

    def raw(self, *path: str) -> Any:
        """The value of the file at a path."""
        value: Any = self.data
        for name in path:
            value = value[name]
        return value

    def fill(self, text: str) -> str:
        """The text with the numbers in it."""
        return Fill(text).substitute(self.values)


@functools.cache
def all_topics() -> tuple[dict[str, Any], ...]:
    """The files, in the order of their names."""
    return tuple(
        tomllib.loads(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.toml"))
    )


def topic_of(lesson: int) -> Topic:
    """The topic of a lesson with its numbers, which differ each time a topic returns."""
    topics = all_topics()
    data = topics[lesson % len(topics)]
    values = {}
    for name, (low, high, digits) in data["parameters"].items():
        steps = round((high - low) * 10**digits) + 1
        value = low + pick(lesson, f"{data['slug']} {name}", steps) / 10**digits
        values[name] = f"{value:.{digits}f}"
    return Topic(data, values)
