"""What comes with the tool made ahead: fonts cut to what is always kept, templates, copies.

Entry points: `prepared_file`, by its key; `prepared_folder`. The modules `site/prepare_*.py` make
the files when site/dist is made. What is not there under its key, since it was changed since, is
made again.
"""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import Any

from coursebuild.core.files.resources import assets_dir

FOLDER = "prepared"
"""In the folder of the bundled files."""


def prepared_folder() -> Path:
    """Where it all lies."""
    return assets_dir() / FOLDER


def prepared_file(kind: str, key: str) -> bytes | None:
    """A result of a kind by its key: of `fonts` that of a job, of `copies` a compressed file."""
    file: str | None = _made_ahead(f"{kind}.json").get(key)
    return None if file is None else (prepared_folder() / file).read_bytes()


@functools.cache
def _made_ahead(name: str) -> dict[str, Any]:
    """A list of what was made ahead; empty in a bundle that somebody made without."""
    try:
        text = (prepared_folder() / name).read_text(encoding="utf-8")
    except FileNotFoundError:
        return {}
    found: dict[str, Any] = json.loads(text)
    return found
