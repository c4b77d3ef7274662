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
    """What stands in its cells, and the pictures that are attached to them, by name.

    Raises:
        UsageError: it is no notebook of format 4.
    """
    try:
        return _read(json.loads(text)["cells"])
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise UsageError(f"{name} is no notebook of format 4") from None


def _read(cells: list[dict[str, Any]]) -> tuple[list[Segment], dict[str, bytes]]:
    segments: list[Segment] = []
    attached: dict[str, bytes] = {}
    for number, cell in enumerate(cells, 1):
        place, source = f"cell {number}", _joined(cell.get("source", ""))
        if cell.get("cell_type") == "markdown":
            pictures = _attachments(cell.get("attachments") or {})
            for picture, data in pictures.items():
                source = source.replace(f"attachment:{picture}", f"attachment:{number}-{picture}")
                attached[f"{number}-{picture}"] = data
            segments += read_markdown(source, place=place)
        elif cell.get("cell_type") == "code" and source.strip():
            outputs = cell.get("outputs") or ()
            tags = " ".join((cell.get("metadata") or {}).get("tags") or ())
            shown = any(one.get("output_type") == "execute_result" for one in outputs)
            segments.append(Segment(kind="cell", place=place, text=source, head=tags, value=shown))
        elif source.strip():
            segments.append(Segment(kind="block", place=place, text=source, head="text"))
    return segments, attached


def _joined(source: str | list[str]) -> str:
    return source if isinstance(source, str) else "".join(source)


def _attachments(cell: Mapping[str, Any]) -> dict[str, bytes]:
    found = {}
    for name, kinds in cell.items():
        for data in kinds.values():
            try:
                found[name] = base64.b64decode(_joined(data))
            except (binascii.Error, ValueError):
                continue
    return found
