"""A Jupyter notebook → segments.

Entry point: `read_notebook`.
"""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Mapping
from typing import Any

from coursebuild.core.files.errors import UsageError
from coursebuild.features.importer.segments import read_markdown
from coursebuild.features.importer.values import Segment


def read_notebook(text: str, name: str) -> tuple[list[Segment], dict[str, bytes]]:
    """Return its cells as segments, and the pictures that are attached to them, by name.

    Raises:
        UsageError: it is no notebook of format 4.
    """
    try:
        return _read_cells(json.loads(text)["cells"])
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise UsageError(f"{name} is no notebook of format 4") from None


def _read_cells(cells: list[dict[str, Any]]) -> tuple[list[Segment], dict[str, bytes]]:
    segments: list[Segment] = []
    attachments: dict[str, bytes] = {}
    for number, cell in enumerate(cells, 1):
        place, source = f"cell {number}", _join_lines(cell.get("source", ""))
        if cell.get("cell_type") == "markdown":
            pictures = _decode_attachments(cell.get("attachments") or {})
            for picture, data in pictures.items():
                source = source.replace(f"attachment:{picture}", f"attachment:{number}-{picture}")
                attachments[f"{number}-{picture}"] = data
            segments += read_markdown(source, place=place)
        elif cell.get("cell_type") == "code" and source.strip():
            outputs = cell.get("outputs") or ()
            tags = " ".join((cell.get("metadata") or {}).get("tags") or ())
            shows_value = any(output.get("output_type") == "execute_result" for output in outputs)
            cell_segment = Segment(
                kind="cell", place=place, text=source, head=tags, shows_value=shows_value
            )
            segments.append(cell_segment)
        elif source.strip():
            segments.append(Segment(kind="block", place=place, text=source, head="text"))
    return segments, attachments


def _join_lines(source: str | list[str]) -> str:
    return source if isinstance(source, str) else "".join(source)


def _decode_attachments(attachments: Mapping[str, Any]) -> dict[str, bytes]:
    pictures = {}
    for name, kinds in attachments.items():
        for data in kinds.values():
            try:
                pictures[name] = base64.b64decode(_join_lines(data))
            except (binascii.Error, ValueError):
                continue
    return pictures
