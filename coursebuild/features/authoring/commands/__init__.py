"""The commands by which a course is begun and changed, each in a module of its name.

Entry point: `apply_changes`, what those do that change one.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from coursebuild.cli.output import CLEAN, write
from coursebuild.core.files.changes import FileChange, change_files
from coursebuild.core.files.errors import UsageError
from coursebuild.pipeline.progress import Progress


def apply_changes(root: Path, changes: Sequence[FileChange]) -> int:
    """Make all changes and say which; gives the exit status.

    Raises:
        UsageError: a new file is there already.
        EffectError: one cannot be written; then none is.
    """
    for change in changes:
        file = root / change.path
        if change.old is None and (file.exists() or file.is_symlink()):
            raise UsageError(f"there is a file {change.path} already")
    change_files(root, changes, Progress().say)
    said = []
    for change in changes:
        what = "wrote" if change.old is None else "removed" if change.new is None else "changed"
        said.append(f"{what} {change.path}\n")
    return write("".join(said), CLEAN)
