"""Several files of a course, changed together: all of them or none.

Entry points: `change_files(root, changes)`; `undo_changes(root)`, before a command reads a course.

1. A journal in `.coursebuild/` records the old and the new content of each file.
2. The files are written and removed one after the other, each whole (`write_atomic`).
3. The journal is removed, which completes the change.

If step 2 fails, the changes so far are undone. If the process was killed, the next command undoes
them: a file with the new content gets the old one back; one that was edited since stays.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
from msgspec import Struct

from coursebuild.core.files.errors import EffectError, FileChangedError, reason
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.write import check_unchanged, check_writable, write_atomic

JOURNAL = ".coursebuild/changes"


class FileChange(Struct, frozen=True):
    """The old and the new content of a file of the course; `None` where there is no file."""

    path: str
    old: bytes | None
    new: bytes | None


def change_files(
    root: Path, changes: Sequence[FileChange], on_wait: Callable[[str], None] | None = None
) -> None:
    """Make all changes, or none; `on_wait` gets a message if another command must end first.

    Raises:
        EffectError: a file cannot be written, or has changed since it was read.
    """
    with project_lock(root, on_wait):
        _undo(root)
        for change in changes:
            check_unchanged(check_writable(root, change.path), change.path, change.old)
        write_atomic(root, JOURNAL, msgspec.msgpack.encode(changes), expected=None)
        try:
            for change in changes:
                _replace(root, change.path, change.old, change.new)
        except BaseException:
            _undo(root)
            raise
        (root / JOURNAL).unlink()


def undo_changes(root: Path) -> None:
    """Undo the changes of a command that was killed."""
    if (root / JOURNAL).exists():
        with project_lock(root):  # a command still at work holds it
            _undo(root)


def _undo(root: Path) -> None:
    try:
        journal = (root / JOURNAL).read_bytes()
    except OSError:
        return
    for change in reversed(msgspec.msgpack.decode(journal, type=tuple[FileChange, ...])):
        with contextlib.suppress(FileChangedError):
            _replace(root, change.path, change.new, change.old)
    (root / JOURNAL).unlink()


def _replace(root: Path, path: str, old: bytes | None, new: bytes | None) -> None:
    """Replace the content `old` of a file by `new`."""
    if new is not None:
        write_atomic(root, path, new, expected=old)
        return
    file = root / path
    try:
        check_unchanged(file, path, old)
        file.unlink()
        for folder in file.relative_to(root).parents:  # remove those that are empty now
            with contextlib.suppress(OSError):
                (root / folder).rmdir()
    except OSError as error:
        raise EffectError(f"{path} cannot be removed: {reason(error)}") from None
