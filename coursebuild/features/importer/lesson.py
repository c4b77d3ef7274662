"""A lesson of another tool → its Markdown.

Entry point: `read_segments`, `lesson_text`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from coursebuild.features.importer.blocks import block_text, plain_fence
from coursebuild.features.importer.cells import script_of, shown_text
from coursebuild.features.importer.context import LessonContext
from coursebuild.features.importer.notebook import read_notebook
from coursebuild.features.importer.segments import front_matter, read_markdown, split_title
from coursebuild.features.importer.values import Segment, read_text


def read_segments(path: Path, name: str) -> tuple[str, list[Segment], dict[str, bytes]]:
    """The title that a file gives itself, its segments, and pictures that it holds.

    Raises:
        UsageError: it cannot be read.
    """
    text = read_text(path, name)
    attached: dict[str, bytes] = {}
    matter: Mapping[str, object] = {}
    if name.endswith(".ipynb"):
        segments, attached = read_notebook(text, name)
    else:
        matter, size = front_matter(text)
        segments = list(read_markdown(text[size:], 1 + text.count("\n", 0, size)))
    title, segments = split_title(segments)
    return str(matter.get("title") or title), segments, attached


def lesson_text(
    segments: Sequence[Segment], title: str, script_path: str, context: LessonContext
) -> str:
    """Markdown of coursebuild; its cells are the script of this path."""
    cells = [segment for segment in segments if segment.kind == "cell"]
    script, last = script_of(cells, title, context)
    row = _row(segments, last)
    parts: list[str] = []
    number = -1
    for segment in segments:
        if segment.kind != "cell":
            parts.append(block_text(segment, context).strip("\n"))
            continue
        number += 1
        if number == last:
            parts.append(plain_fence(f"python file={script_path}", script.rstrip("\n")))
        elif number not in row:
            parts.append(_shown(segment))
    return "\n\n".join(part for part in parts if part.strip()) + "\n"


def _row(segments: Sequence[Segment], last: int) -> frozenset[int]:
    """Numbers of the cells directly before the last one of the script, which shows them."""
    row: set[int] = set()
    number = -1
    for segment in segments:
        if segment.kind != "cell":
            row = set() if number < last else row
            continue
        number += 1
        if number <= last:
            row.add(number)
    return frozenset(row)


def _shown(cell: Segment) -> str:
    """A cell as a part of the script that stands below."""
    magic = re.match(r"\s*%%(\w+).*\n", cell.text)
    if magic is not None:
        return plain_fence(magic[1], cell.text[magic.end() :].strip("\n"))
    text = shown_text(cell)
    return plain_fence("python fragment", text) if text else ""
