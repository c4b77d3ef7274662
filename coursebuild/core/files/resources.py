"""Files that come with the tool and are not Python.

An installed package holds all of them; in a source tree they are in `site/dist`, `templates`,
`docs` and its root. Where a folder is missing, each function raises an `EffectError`: a source tree
was not built, or the installation is broken.

The modules `site/prepare_*.py` make the prepared files (fonts cut to their usual characters,
templates, copies) when site/dist is made. A file whose input has changed since then has another
key, is not found, and is made during the build.
"""

from __future__ import annotations

import functools
import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from coursebuild.core.files.errors import EffectError

_PACKAGE = Path(__file__).resolve().parents[2]


def assets_dir() -> Path:
    """The bundled scripts, styles and fonts."""
    return _find_folder("assets", "site/dist", "the browser's files are not built")


def templates_dir() -> Path:
    """The templates of the pages."""
    return _find_folder("templates", "templates", "the page templates are missing")


def rules_page() -> str:
    """The Markdown page with a section and an example for each rule."""
    folder = _find_folder("docs", "docs/reference", "the page of rules is missing")
    return (folder / "rules.md").read_text(encoding="utf-8")


def locked_requirements(names: Iterable[str]) -> str:
    """Packages and all that they need, as they were tested: with hashes, as pip reads them."""
    folder = _find_folder("locks", ".", "the locked requirements are missing")
    text = (folder / "requirements.lock").read_text(encoding="utf-8")
    entries = re.findall(r"(?m)^(([\w.-]+)==.*\n(?:    --hash.*\n)+)((?:    #.*\n)*)", text)
    # uv names below each package, in comments, those that it is locked for.
    asked_by = {(entry, name): {*re.findall(r"[\w.-]+", via)} for entry, name, via in entries}
    closure = {re.sub(r"[-_.]+", "-", name).lower() for name in names}
    while additions := {name for (_, name), via in asked_by.items() if via & closure} - closure:
        closure |= additions
    return "".join(entry for entry, name in asked_by if name in closure)


class Bundle(Mapping[str, bytes]):
    """The bundled files by path relative to `assets_dir()`, sorted; each is read on access."""

    def __init__(self) -> None:
        self._folder = assets_dir()

    def __getitem__(self, path: str) -> bytes:
        try:  # without listing all, since most runs read one or two
            return (self._folder / path).read_bytes()
        except (FileNotFoundError, NotADirectoryError, IsADirectoryError) as error:
            raise KeyError(path) from error

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)

    @functools.cached_property
    def _paths(self) -> tuple[str, ...]:
        return tuple(path for path in _paths(self._folder) if Path(path).name != "stamp.json")


def _paths(folder: Path) -> list[str]:
    def fail(error: OSError) -> None:
        raise error

    top = len(f"{folder}/")
    walk = os.walk(folder, onerror=fail)
    paths = (f"{place}/{name}"[top:] for place, _, names in walk for name in names)
    return sorted(paths, key=lambda path: path.split("/"))


def template_texts() -> tuple[tuple[str, str], ...]:
    """Every template and table of strings by path relative to `templates_dir()`, sorted."""
    folder = templates_dir()
    return tuple(
        (path, (folder / path).read_text(encoding="utf-8"))
        for path in _paths(folder)
        if path.endswith((".html", ".toml", ".svg", ".css", ".py"))
    )


def _find_folder(installed: str, in_tree: str, problem: str) -> Path:
    for folder in (_PACKAGE / installed, _PACKAGE.parent / in_tree):
        if folder.is_dir():
            return folder
    help = "in a source tree, run `make site`; otherwise install coursebuild again"
    raise EffectError(f"{problem}: there is no {_PACKAGE / installed}", help=help)


# --- what is prepared when the tool is made

PREPARED = "prepared"
"""Its name in the folder of the bundled files."""


def prepared_folder() -> Path:
    """The folder of the prepared files."""
    return assets_dir() / PREPARED


def prepared_file(kind: str, key: str) -> bytes | None:
    """A prepared file by its kind and key: of `fonts` the result of a job, of `copies` a copy."""
    file: str | None = _read_list(f"{kind}.json").get(key)
    return None if file is None else (prepared_folder() / file).read_bytes()


@functools.cache
def _read_list(name: str) -> dict[str, Any]:
    """The list of one kind of prepared files; empty in a bundle that was made without them."""
    path = prepared_folder() / name
    files: dict[str, Any] = json.loads(path.read_bytes()) if path.exists() else {}
    return files
