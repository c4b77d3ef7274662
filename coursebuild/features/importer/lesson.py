"""A lesson of another tool → its Markdown.

Entry points: `read_segments`, `write_lesson`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from coursebuild.core.pages.marks import fence
from coursebuild.features.importer.blocks import convert_segment
from coursebuild.features.importer.cells import build_script, code_for_readers
from coursebuild.features.importer.context import LessonContext
from coursebuild.features.importer.notebook import read_notebook
from coursebuild.features.importer.segments import read_front_matter, read_markdown, split_title
from coursebuild.features.importer.values import Segment, read_text


def read_segments(path: Path, name: str) -> tuple[str, list[Segment], dict[str, bytes]]:
    """Return the title that a file states, its segments, and the pictures in it.

    Raises:
        UsageError: it cannot be read.
    """
    text = read_text(path, name)
    pictures: dict[str, bytes] = {}
    metadata: Mapping[str, object] = {}
    if name.endswith(".ipynb"):
        segments, pictures = read_notebook(text, name)
    else:
        metadata, size = read_front_matter(text)
        segments = list(read_markdown(text[size:], 1 + text.count("\n", 0, size)))
    title, segments = split_title(segments)
    return str(metadata.get("title") or title), segments, pictures


def write_lesson(
    segments: Sequence[Segment], title: str, script_path: str, context: LessonContext
) -> str:
    """Return a lesson in Markdown of coursebuild, with its cells as the script of this path.

    The script takes the place of its last cell. Earlier cells are shown where they stood, except
    for those directly before the script, which would only repeat it.
    """
    cells = [segment for segment in segments if segment.kind == "cell"]
    script, script_cells = build_script(cells, title, context)
    parts: list[str] = []
    number, shown_end = 0, 0
    for segment in segments:
        if segment.kind != "cell":
            parts.append(convert_segment(segment, context).strip("\n"))
            shown_end = len(parts)
            continue
        if script_cells and number == script_cells[-1]:
            parts[shown_end:] = [fence(f"python file={script_path}", script)]
        else:
            parts.append(_write_cell(segment))
            shown_end = shown_end if number in script_cells else len(parts)
        number += 1
    return "\n\n".join(part for part in parts if part.strip()) + "\n"


def _write_cell(cell: Segment) -> str:
    """Return a cell to be read: a part of the script below, or code that is not run."""
    magic = re.match(r"\s*%%(\w+).*\n", cell.text)
    if magic is not None:
        return fence(magic[1], cell.text[magic.end() :].strip("\n"))
    text = code_for_readers(cell)
    return fence("python fragment", text) if text else ""
