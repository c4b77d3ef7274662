"""The course for Hugo with the formulas left to KaTeX in the reader's browser."""

from __future__ import annotations

from pathlib import Path

from benchmarks.generate.document import Lesson
from benchmarks.generate.flavors import hugo


def write(lessons: list[Lesson], folder: Path) -> None:
    """The same course as `hugo` has, but for one hook."""
    hugo.write(lessons, folder, hugo.HOOK_READER)
