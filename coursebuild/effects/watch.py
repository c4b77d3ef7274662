"""Waiting for the author to save: changes below the course's folder.

Entry point: `changes(root, stop)`. Derived folders, caches and editors' own files are no changes.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

_DERIVED = frozenset(
    {"public", "examples", ".coursebuild", ".git", ".venv", "node_modules", "__pycache__"}
)


def changes(root: Path, stop: threading.Event) -> Iterator[frozenset[str]]:
    """Sets of changed paths (POSIX, relative to `root`), one for each burst of saves."""
    from watchfiles import watch

    def wanted(_: object, path: str) -> bool:
        return _is_source(root, path)

    folders = [root / name for name in ("content", "models", "mjcourse") if (root / name).is_dir()]
    for batch in watch(
        *folders,
        watch_filter=wanted,
        stop_event=stop,
        debounce=300,
        step=20,
        yield_on_timeout=False,
    ):
        yield frozenset(Path(path).relative_to(root).as_posix() for _, path in batch)


def _is_source(root: Path, path: str) -> bool:
    try:
        parts = Path(path).relative_to(root).parts
    except ValueError:
        return False
    name = parts[-1] if parts else ""
    editor = (
        name.startswith((".", "#"))
        or name.endswith(("~", ".swp", ".swx", ".tmp"))
        or name == "4913"
    )
    return bool(parts) and not editor and not _DERIVED.intersection(parts)
