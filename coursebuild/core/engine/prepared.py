"""Files that come with the tool ready-made: fonts cut to their usual characters, templates, copies.

Entry points: `prepared_file`, by its key; `prepared_folder`. The modules `site/prepare_*.py` make
the files when site/dist is made. A file whose input has changed since then has another key, is not
found, and is made during the build.
"""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import Any

from coursebuild.core.files.resources import assets_dir

FOLDER = "prepared"
"""Its name in the folder of the bundled files."""


def prepared_folder() -> Path:
    """The folder of the prepared files."""
    return assets_dir() / FOLDER


def prepared_file(kind: str, key: str) -> bytes | None:
    """A prepared file by its kind and key: of `fonts` the result of a job, of `copies` a copy."""
    file: str | None = _read_list(f"{kind}.json").get(key)
    return None if file is None else (prepared_folder() / file).read_bytes()


@functools.cache
def _read_list(name: str) -> dict[str, Any]:
    """The list of one kind of prepared files; empty in a bundle that was made without them."""
    try:
        text = (prepared_folder() / name).read_text(encoding="utf-8")
    except FileNotFoundError:
        return {}
    files: dict[str, Any] = json.loads(text)
    return files
