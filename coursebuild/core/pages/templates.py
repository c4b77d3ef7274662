"""The templates of pages, in Jinja's language.

Entry points: `templates_of`; `compile_templates`, for who bundles the tool.

1. What is not `Markup` is escaped where it is written.
2. A name or an attribute that is not there is an error.
3. Templates that are those which the tool was bundled with are loaded from the Python that they
   were compiled to then. Others, in a source tree, are compiled when they are asked for.
"""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path
from typing import TypeAlias

from jinja2 import BaseLoader, DictLoader, Environment, ModuleLoader, StrictUndefined

Texts: TypeAlias = tuple[tuple[str, str], ...]
"""Files of `templates/` by path."""


@functools.lru_cache(maxsize=8)
def templates_of(texts: Texts, folder: Path | None = None) -> Environment:
    """The templates among files of the tool; `folder` has those that were compiled before."""
    pages = _pages(texts)
    archive = None if folder is None else folder / archive_name(texts)
    if archive is not None and archive.is_file():
        return _environment(ModuleLoader(archive))
    return _environment(DictLoader(pages))


def compile_templates(texts: Texts, folder: Path) -> None:
    """Write templates into a folder as Python that `templates_of` loads."""
    environment = _environment(DictLoader(_pages(texts)))
    environment.compile_templates(folder / archive_name(texts), ignore_errors=False)


def archive_name(texts: Texts) -> str:
    """The name of the archive of these templates as Python."""
    digest = hashlib.sha256(repr(sorted(_pages(texts).items())).encode())
    return f"templates-{digest.hexdigest()[:16]}.zip"


def _pages(texts: Texts) -> dict[str, str]:
    return {name: text for name, text in texts if name.endswith(".html")}


def _environment(loader: BaseLoader) -> Environment:
    return Environment(
        loader=loader,
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        auto_reload=False,
    )
