"""The commands that begin and change a course, each in a module of its name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from coursebuild.api import CLEAN, UsageError, write
from coursebuild.core.files.write import FileChange, change_files
from coursebuild.pipeline.options import Progress


def apply_changes(root: Path, changes: Sequence[FileChange]) -> int:
    """Make all changes, report them, and return the exit status.

    Raises:
        UsageError: a new file is there already.
        EffectError: one cannot be written; then none is.
    """
    for change in changes:
        file = root / change.path
        if change.old is None and (file.exists() or file.is_symlink()):
            raise UsageError(f"there is already a file {change.path}")
    change_files(root, changes, Progress().say)
    lines = []
    for change in changes:
        verb = "wrote" if change.old is None else "removed" if change.new is None else "changed"
        lines.append(f"{verb} {change.path}\n")
    return write("".join(lines), CLEAN)
