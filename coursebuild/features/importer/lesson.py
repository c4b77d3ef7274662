"""A lesson of another tool → its Markdown.

Entry points: `read_segments`, `lesson_text`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from coursebuild.core.pages.marks import fence
from coursebuild.features.importer.blocks import block_text
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
    """Markdown of coursebuild; its cells are the script of this path.

    The script stands where its last cell stood. Cells before are shown where they stood, but for
    those directly before it.
    """
    cells = [segment for segment in segments if segment.kind == "cell"]
    script, run = script_of(cells, title, context)
    parts: list[str] = []
    number, shown = 0, 0
    for segment in segments:
        if segment.kind != "cell":
            parts.append(block_text(segment, context).strip("\n"))
            shown = len(parts)
            continue
        if run and number == run[-1]:
            parts[shown:] = [fence(f"python file={script_path}", script)]
        else:
            parts.append(_shown(segment))
            shown = shown if number in run else len(parts)
        number += 1
    return "\n\n".join(part for part in parts if part.strip()) + "\n"


def _shown(cell: Segment) -> str:
    """A cell as a part of the script that stands below."""
    magic = re.match(r"\s*%%(\w+).*\n", cell.text)
    if magic is not None:
        return fence(magic[1], cell.text[magic.end() :].strip("\n"))
    text = shown_text(cell)
    return fence("python fragment", text) if text else ""
