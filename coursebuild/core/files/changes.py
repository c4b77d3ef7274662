"""Several files of a course, changed together: all of them or none.

Entry points: `change_files(root, changes)`; `undo_changes(root)`, before a command reads a course.

1. A journal records the old and the new content of each file. It lies in the user's own state
   folder, so that no course can bring one along, and is sealed.
2. The files are written and removed one after the other, each whole (`write_atomic`).
3. The journal is removed, which completes the change.

If step 2 fails, the changes so far are undone. If the process was killed, the next command undoes
them: a file with the new content gets the old one back; one that was edited since stays. Where the
user has no state folder, there is no journal, and a kill leaves what was changed until then.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
from msgspec import Struct

from coursebuild.core.files.errors import EffectError, FileChangedError, OutsideProjectError, reason
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.trust import FOLDER, replace_file, seal, state_folder, store_key, unseal
from coursebuild.core.files.write import (
    check_unchanged,
    check_writable,
    remove_leftovers,
    write_atomic,
)
from coursebuild.core.values import DAMAGE

_CLOSED = frozenset({".git", ".venv", FOLDER})
"""Folders of the project in which nothing is made."""
_NAME = "changes"


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
        _undo(root, on_wait)
        for change in changes:
            check_unchanged(_check_path(root, change), change.path, change.old)
        journal = journal_path(root)
        if journal is not None:
            data = seal(_NAME, msgspec.msgpack.encode(changes), store_key(str(root)))
            try:
                journal.parent.mkdir(exist_ok=True)
                replace_file(str(journal), data)
            except OSError as error:
                raise EffectError(f"{journal} cannot be written: {reason(error)}") from None
        try:
            for change in changes:
                _replace(root, change.path, change.old, change.new)
        except BaseException:
            _restore(root, changes)
            if journal is not None:  # it stays if not all could be restored
                journal.unlink()
            raise
        if journal is not None:
            journal.unlink()


def undo_changes(root: Path, tell: Callable[[str], None] | None = None) -> None:
    """Undo the changes of a command that was killed; `tell` gets a line that says what was undone.

    Raises:
        EffectError: a file cannot be written.
    """
    journal = journal_path(root)
    if journal is not None and journal.exists():
        with project_lock(root):  # a command still at work holds it
            _undo(root, tell)


def journal_path(root: Path) -> Path | None:
    """Where the journal of a course lies; `None` where the user has no place for it."""
    folder = state_folder(str(root))
    if folder is None or not store_key(str(root)):
        return None
    name = hashlib.sha256(os.fsencode(os.path.realpath(root))).hexdigest()
    return Path(folder, "journals", name)


def _undo(root: Path, tell: Callable[[str], None] | None) -> None:
    journal = journal_path(root)
    try:
        data = journal.read_bytes() if journal is not None else b""
    except OSError:
        return
    if journal is None:
        return
    journaled = unseal(_NAME, data, store_key(str(root)))
    try:
        changes = msgspec.msgpack.decode(journaled or b"", type=tuple[FileChange, ...])
        for change in changes:
            _check_path(root, change)
    except (*DAMAGE, OutsideProjectError):
        journal.replace(journal.with_suffix(".damaged"))
        message = (
            "a command that was interrupted has left a damaged journal, so nothing was undone: "
            "look at what it was changing"
        )
    else:
        message = _restore(root, changes)
        remove_leftovers({(root / change.path).parent for change in changes})
        journal.unlink()
    if tell is not None and message:
        tell(message)


def _restore(root: Path, changes: Sequence[FileChange]) -> str:
    """Give files with their new content the old one back; return what was done, in words."""
    restored_paths, edited_paths = [], []
    for change in reversed(changes):
        file = _check_path(root, change)
        try:
            check_unchanged(file, change.path, change.old)
        except FileChangedError:
            try:
                _replace(root, change.path, change.new, change.old)
                restored_paths.append(change.path)
            except FileChangedError:
                edited_paths.append(change.path)
    message = ""
    if restored_paths:
        message = f"undid a change that was interrupted: {', '.join(sorted(restored_paths))}"
    if edited_paths:
        names = ", ".join(sorted(edited_paths))
        message += f"{'; ' if message else ''}left as edited since: {names}"
    return message


def _check_path(root: Path, change: FileChange) -> Path:
    """Resolve the path of a file that may be changed.

    Raises:
        OutsideProjectError: it leads out of the project, or to what commands do not write: a
            hidden file that is there already, an environment, the folder of Git.
        EffectError: the file is read-only.
    """
    file = check_writable(root, change.path)
    parts = file.relative_to(os.path.realpath(root)).parts
    is_hidden = any(part.startswith(".") for part in parts)
    if not _CLOSED.isdisjoint(parts) or (is_hidden and change.old is not None):
        raise OutsideProjectError(f"{change.path} is no file that a command may change")
    return file


def _replace(root: Path, path: str, old: bytes | None, new: bytes | None) -> None:
    """Replace the content `old` of a file by `new`."""
    if new is not None:
        write_atomic(root, path, new, expected=old)
        return
    file = check_writable(root, path)
    try:
        check_unchanged(file, path, old)
        file.unlink()
        for folder in file.relative_to(os.path.realpath(root)).parents:  # remove empty ones
            with contextlib.suppress(OSError):
                Path(os.path.realpath(root), folder).rmdir()
    except OSError as error:
        raise EffectError(f"{path} cannot be removed: {reason(error)}") from None
