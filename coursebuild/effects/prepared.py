"""Fonts that come with the tool cut already: those that nearly every course needs.

Entry points: `prepared_cut`, `prepared_source`. `site/prepare_fonts.py` makes the files.

1. A font cut to the characters that are always kept is the result of a job, under the job's key.
2. A large font is there a second time, cut to the characters that are used at all often. What is
   cut from it is, byte for byte, what would be cut from the whole font, in less than half the time.

Where the bundled fonts, or the way of cutting, are others than when the files were made, no key is
found, and everything is cut from the whole fonts.
"""

from __future__ import annotations

import functools
import hashlib
import json
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parents[1] / "prepared"


def prepared_cut(key: str) -> bytes | None:
    """The result of a job, by its key."""
    file: str | None = _listing()["cuts"].get(key)
    return None if file is None else (FOLDER / file).read_bytes()


def prepared_source(font: bytes, characters: str, version: int) -> bytes | None:
    """A smaller font with these characters that may stand for a whole one.

    `version` is that of the way of cutting.
    """
    found = _listing()["smaller"].get(f"{version}/{hashlib.sha256(font).hexdigest()}")
    if found is None or not set(characters) <= set(found["characters"]):
        return None
    file: str = found["file"]
    return (FOLDER / file).read_bytes()


@functools.cache
def _listing() -> dict[str, Any]:
    listing: dict[str, Any] = json.loads((FOLDER / "fonts.json").read_text(encoding="utf-8"))
    return listing
