"""Whether modules could be imported, found out without importing any.

Entry point: `missing_modules`.
"""

from __future__ import annotations

import contextlib
import importlib.machinery
import sys
from collections.abc import Sequence
from pathlib import Path


def missing_modules(names: Sequence[str], folder: Path | None, library: str) -> list[str]:
    """Which of these modules a script in `folder` could not import; none is imported."""
    if not names:
        return []
    path = [*([str(folder)] if folder else []), *sys.path, *([library] if library else [])]
    _look_again()
    return [name for name in names if not _exists(name, path)]


def _look_again() -> None:
    """Forget what folders held; `importlib.invalidate_caches` would import much to do the same."""
    for entry, finder in list(sys.path_importer_cache.items()):
        if finder is None:
            del sys.path_importer_cache[entry]
        elif hasattr(finder, "invalidate_caches"):
            finder.invalidate_caches()


def _exists(name: str, path: list[str]) -> bool:
    prefix = ""
    where: Sequence[str] | None = path
    for part in name.split("."):
        prefix = f"{prefix}.{part}" if prefix else part
        if where is None or not part.isidentifier():
            return False
        spec = _find(prefix, where, top=prefix == part)
        if spec is None:
            return False
        where = spec.submodule_search_locations
    return True


def _find(name: str, path: Sequence[str], *, top: bool) -> importlib.machinery.ModuleSpec | None:
    saved = sys.path
    try:
        if top:
            sys.path = list(path)
        for finder in sys.meta_path:
            # A finder of some installed package may do anything.
            with contextlib.suppress(Exception):
                spec = finder.find_spec(name, None if top else path)
                if spec is not None:
                    return spec
        return None
    finally:
        sys.path = saved
