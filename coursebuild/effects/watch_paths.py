"""Which files' changes are changes of a course: those that reading it does not leave out.

Entry points: `FOLDERS`, watched with all that is in them; `is_source`.
"""

from __future__ import annotations

FOLDERS = ("content", "features", "models", "mjcourse")
LOOK = 0.200
"""Seconds from one look for new and removed folders to the next."""


def is_source(path: str) -> bool:
    """Whether a path, POSIX and relative to the course, is none of an editor's or of Python's."""
    return bool(path) and not any(map(is_dropping, path.split("/")))


def is_dropping(name: str) -> bool:
    """Whether a file or folder of this name is an editor's, or Python's."""
    return name.startswith((".", "#")) or name.endswith("~") or name in ("4913", "__pycache__")
