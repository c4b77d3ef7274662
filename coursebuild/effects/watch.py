"""Waiting for the author to save: changes below the course's folder.

Entry point: `changes(root, stop)`. What reading a course leaves out (caches, editors' own files) is
no change.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

_FOLDERS = ("content", "models", "mjcourse")
_LOOK = 200
"""Milliseconds from one look for new and removed folders to the next."""


def changes(root: Path, stop: threading.Event) -> Iterator[frozenset[str]]:
    """Sets of changed paths (POSIX, relative to `root`), one for each burst of saves.

    The first set is empty: it says that from now on no change is missed, also while the caller does
    something else.
    """
    begun: frozenset[str] | None = frozenset()
    while not stop.is_set():
        folders = _present(root)
        for changed in _below(root, folders, stop):
            if begun is not None:
                yield begun | changed
                begun = None
            elif changed:
                yield changed
            if _present(root) != folders:
                # Told of once these folders are watched: a file may still be put into a new one.
                begun = frozenset(path.name for path in {*folders} ^ {*_present(root)})
                break


def _present(root: Path) -> tuple[Path, ...]:
    return tuple(root / name for name in _FOLDERS if (root / name).is_dir())


def _below(
    root: Path, folders: tuple[Path, ...], stop: threading.Event
) -> Iterator[frozenset[str]]:
    """Changes in these folders; an empty set now and then."""
    from watchfiles import watch

    if not folders:
        while not stop.wait(_LOOK / 1000):
            yield frozenset()
        return
    for batch in watch(
        *folders,
        watch_filter=lambda _, path: _is_source(root, path),
        stop_event=stop,
        debounce=300,
        step=20,
        rust_timeout=_LOOK,
        yield_on_timeout=True,
    ):
        yield frozenset(Path(path).relative_to(root).as_posix() for _, path in batch)


def _is_source(root: Path, path: str) -> bool:
    try:
        parts = Path(path).relative_to(root).parts
    except ValueError:
        return False
    return bool(parts) and not any(map(_is_dropping, parts))


def _is_dropping(name: str) -> bool:
    """Whether a file or folder of this name is an editor's, or Python's."""
    return name.startswith((".", "#")) or name.endswith("~") or name in ("4913", "__pycache__")
