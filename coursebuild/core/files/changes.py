"""Several files of a course, changed together: all of them or none.

Entry points: `change_files(root, changes)`; `undo_changes(root)`, before a command reads a course.

1. What each file holds and is to hold goes into a journal in `.coursebuild/`.
2. The files are written and removed one after the other, each whole (`write_atomic`).
3. The journal is removed: from this instant all is done.

Where 2 fails, what was done is undone. Where the process was killed, the next command does that: a
file that is as the journal wanted it becomes what it was, one that somebody has edited since stays.
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
    """A file of the course: what it holds and what it is to hold; `None` is no file."""

    path: str
    old: bytes | None
    new: bytes | None


def change_files(
    root: Path, changes: Sequence[FileChange], on_wait: Callable[[str], None] | None = None
) -> None:
    """Make all changes, or none; `on_wait` hears that another command is waited for.

    Raises:
        EffectError: a file cannot be written, or is no longer what was read.
    """
    with project_lock(root, on_wait):
        _undo(root)
        for change in changes:
            check_unchanged(check_writable(root, change.path), change.path, change.old)
        write_atomic(root, JOURNAL, msgspec.msgpack.encode(changes), expected=None)
        try:
            for change in changes:
                _put(root, change.path, change.old, change.new)
        except BaseException:
            _undo(root)
            raise
        (root / JOURNAL).unlink()


def undo_changes(root: Path) -> None:
    """Undo what a killed command had begun."""
    if (root / JOURNAL).exists():
        with project_lock(root):  # a command that is at work has it
            _undo(root)


def _undo(root: Path) -> None:
    try:
        journal = (root / JOURNAL).read_bytes()
    except OSError:
        return
    for change in reversed(msgspec.msgpack.decode(journal, type=tuple[FileChange, ...])):
        with contextlib.suppress(FileChangedError):
            _put(root, change.path, change.new, change.old)
    (root / JOURNAL).unlink()


def _put(root: Path, path: str, old: bytes | None, new: bytes | None) -> None:
    """Let a file that holds `old` hold `new`."""
    if new is not None:
        write_atomic(root, path, new, expected=old)
        return
    file = root / path
    try:
        check_unchanged(file, path, old)
        file.unlink()
        for folder in file.relative_to(root).parents:  # that nothing is left in
            with contextlib.suppress(OSError):
                (root / folder).rmdir()
    except OSError as error:
        raise EffectError(f"{path} cannot be removed: {reason(error)}") from None
