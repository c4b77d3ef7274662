"""What comes with the tool made ahead: fonts cut or ready to be cut, templates, compressed copies.

Entry points: `prepared_cut`, `prepared_source`; `prepared_copy`; `prepared_folder`. The modules
`site/prepare_*.py` make the files when site/dist is made.

1. A font cut to the characters that are always kept is the result of a job, under the job's key.
2. Every font is there a second time, with all done that does not depend on the course: what is cut
   from it takes a tenth of the time. The largest has the characters only that are used at all
   often.

Where the way of cutting is another than when the files were made, no key is found, and everything
is cut from the whole fonts. So it is with templates that were changed since, which are compiled,
and with what is to be compressed.
"""

from __future__ import annotations

import functools
import hashlib
import json
from pathlib import Path
from typing import Any

from coursebuild.core.files.resources import assets_dir

FOLDER = "prepared"
"""In the folder of the bundled files."""


def prepared_folder() -> Path:
    """Where it all lies."""
    return assets_dir() / FOLDER


def prepared_cut(key: str) -> bytes | None:
    """The result of a job, by its key."""
    file: str | None = _listing()["cuts"].get(key)
    return None if file is None else (prepared_folder() / file).read_bytes()


def prepared_source(font: bytes, characters: str, version: int) -> bytes | None:
    """A smaller font with these characters that may stand for a whole one.

    `version` is that of the way of cutting.
    """
    found = _listing()["smaller"].get(f"{version}/{hashlib.sha256(font).hexdigest()}")
    if found is None or not set(characters) <= set(found["characters"]):
        return None
    file: str = found["file"]
    return (prepared_folder() / file).read_bytes()


def prepared_copy(key: str) -> bytes | None:
    """A compressed copy, by the key that `render.compressed` gives it."""
    file = _copies().get(key)
    return None if file is None else (prepared_folder() / file).read_bytes()


def _copies() -> dict[str, str]:
    return _made_ahead("copies.json")


def _listing() -> dict[str, Any]:
    return _made_ahead("fonts.json") or {"cuts": {}, "smaller": {}}


@functools.cache
def _made_ahead(name: str) -> dict[str, Any]:
    """A list of what was made ahead; empty in a bundle that somebody made without."""
    try:
        text = (prepared_folder() / name).read_text(encoding="utf-8")
    except FileNotFoundError:
        return {}
    found: dict[str, Any] = json.loads(text)
    return found
