"""Writing files of a course: one, whole or not at all, or several together, all or none.

1. The new bytes go into a temporary file in the same folder, locked as long as its writer is alive.
2. They are synced to the disk, with the permissions and the owner of the file that they replace.
3. If the file is still what the caller read, the temporary file is renamed over it.

A read-only file is left alone, though a rename could replace it: its author meant it. If the tool
is killed at any instant, the file is whole, old or new; at most a temporary file is left, which the
next run removes. Of several files,

1. A journal records the old and the new content of each. It lies in the user's own state folder, so
   that no course can bring one along, and is sealed.
2. The files are written and removed one after the other, each whole.
3. The journal is removed, or put beside as the last change that can be taken back, which completes
   the change. Earlier ones stay, so that one after the other can be taken back.

If step 2 fails, the changes so far are undone. If the process was killed, the next command undoes
them: a file with the new content gets the old one back; one that was edited since stays. Where the
user has no state folder, there is no journal, and a kill leaves what was changed until then; the
user is told so before.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import msgspec
from msgspec import Struct

from coursebuild.core.files.course_root import read_regular
from coursebuild.core.files.errors import EffectError, FileChangedError, OutsideProjectError, reason
from coursebuild.core.files.locks import is_abandoned, project_lock, try_lock
from coursebuild.core.files.trust import FOLDER, replace_file, seal, state_folder, store_key, unseal
from coursebuild.core.text.source import Source
from coursebuild.core.values import DAMAGE

PREFIX = ".coursebuild-tmp-"
"""What names of temporary files begin with; the dot keeps them out of the course."""


def write_atomic(
    root: Path, path: str, data: bytes, *, expected: bytes | None, durable: bool = True
) -> None:
    """Make `data` the content of a file of the course, or of the file that a link there leads to.

    `expected` is the file's content when it was read; `None` if there was none, and perhaps no
    folder either. `durable`: it is an author's file, whose bytes must survive a power cut and which
    is left alone if it is read-only. (A derived file can be made again.)

    Raises:
        FileChangedError: the file has changed since; it stays as it is.
        OutsideProjectError: the path, or a link there, leads out of the project.
        EffectError: it cannot be written.
    """
    target = check_writable(root, path) if durable else resolve_inside(root, path)
    temporary = ""  # its path, as soon as it has to be removed
    try:
        if target.exists() and not target.is_file():
            raise EffectError(f"{path} is not a regular file")
        if expected is None:
            target.parent.mkdir(parents=True, exist_ok=True)
        fd, temporary = _open_temporary(target.parent)
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(fd, rest) :]
            with contextlib.suppress(FileNotFoundError):
                old = target.stat()
                with contextlib.suppress(PermissionError):  # only root may give a file away
                    if (old.st_uid, old.st_gid) != (os.geteuid(), os.getegid()):
                        os.fchown(fd, old.st_uid, old.st_gid)
                os.fchmod(fd, stat.S_IMODE(old.st_mode))
            if durable:
                os.fsync(fd)
            check_unchanged(target, path, expected)
            _move(temporary, target, path, new=expected is None)
            if durable:
                with contextlib.suppress(OSError):  # without, the file is whole all the same
                    folder = os.open(target.parent, os.O_RDONLY | os.O_CLOEXEC)
                    try:
                        os.fsync(folder)
                    finally:
                        os.close(folder)
                remove_leftovers([target.parent])
        finally:
            os.close(fd)
    except OSError as error:
        raise EffectError(f"{path} cannot be written: {reason(error)}") from None
    finally:
        if temporary:
            with contextlib.suppress(FileNotFoundError):  # it has become the target
                Path(temporary).unlink()


def resolve_inside(root: Path, path: str) -> Path:
    """Resolve a path with all links; an `OutsideProjectError` where it leads out of the course."""
    try:
        target = Path(os.path.realpath(root / path))
    except ValueError:  # NUL
        raise OutsideProjectError(f"{path!r} is not a path") from None
    if not target.is_relative_to(os.path.realpath(root)):
        raise OutsideProjectError(f"{path} leads out of the project")
    return target


def check_writable(root: Path, path: str) -> Path:
    """Resolve a path of the course like `resolve_inside`, if the file there may be replaced.

    The owner's permission decides, since root may write every file.

    Raises:
        OutsideProjectError: it leads out of the project.
        EffectError: the file is read-only.
    """
    target = resolve_inside(root, path)
    with contextlib.suppress(OSError):  # writing will report it
        if not target.stat().st_mode & stat.S_IWUSR:
            help = "nothing was written to it; make it writable, and run the command again"
            raise EffectError(f"{path} is read-only", help=help)
    return target


def remove_leftovers(folders: Iterable[Path]) -> None:
    """Remove the temporary files that killed runs left in these folders (not below them)."""
    for folder in folders:
        with contextlib.suppress(OSError), os.scandir(folder) as entries:
            for entry in entries:
                with contextlib.suppress(OSError), contextlib.ExitStack() as resources:
                    if entry.name.startswith(PREFIX) and entry.is_file(follow_symlinks=False):
                        fd = os.open(entry.path, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
                        resources.callback(os.close, fd)
                        if is_abandoned(fd):
                            Path(entry.path).unlink()


def _open_temporary(folder: Path) -> tuple[int, str]:
    while True:
        path = folder / f"{PREFIX}{os.urandom(6).hex()}"
        fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        try_lock(fd)
        # Another run may have taken it for abandoned before it was locked.
        if os.fstat(fd).st_nlink > 0:
            return fd, str(path)
        os.close(fd)


def _move(temporary: str, target: Path, path: str, *, new: bool) -> None:
    try:
        if new:  # a link, unlike a rename, never replaces a file that somebody just made
            os.link(temporary, target)
            return
    except FileExistsError:
        raise FileChangedError(f"{path} was created by another program in the meantime") from None
    except OSError:
        pass  # a file system without links
    Path(temporary).replace(target)


def check_unchanged(target: Path, path: str, expected: bytes | None) -> None:
    """Raise a `FileChangedError` unless a file has this content, or there is none (`None`).

    One that cannot be read is an `EffectError`.
    """
    try:
        current: bytes | None = read_regular(target)
    except (FileNotFoundError, NotADirectoryError):
        current = None
    except IsADirectoryError:
        raise FileChangedError(f"{path} has become a folder in the meantime") from None
    except OSError as error:
        raise EffectError(f"{path} cannot be read: {reason(error)}") from None
    if current == expected:
        return
    if current is None:
        raise FileChangedError(f"{path} was removed in the meantime")
    if expected is None:
        raise FileChangedError(f"{path} was created by another program in the meantime")
    help = "nothing was written; run the command again"
    raise FileChangedError(f"{path} was changed in the meantime", help=help)


# --- several files

_CLOSED = frozenset({".git", ".venv", FOLDER})
"""Folders of the project in which nothing is made."""
_NAME = "changes"
_LOCK = "changes-lock"
"""The lock of journals, which is held for a moment; that of the course before it, if both are."""
_KEPT = 20
"""How many changes can be taken back."""


class FileChange(Struct, frozen=True):
    """The old and the new content of a file of the course; `None` where there is no file."""

    path: str
    old: bytes | None
    new: bytes | None

    @classmethod
    def of(cls, source: Source, text: str) -> FileChange:
        """The change of a file that gets another text."""
        return cls(source.path, source.text.encode(), text.encode())


def change_files(
    root: Path,
    changes: Sequence[FileChange],
    on_wait: Callable[[str], None] | None = None,
    *,
    keep: bool = False,
    beside_commands: bool = False,
) -> bool:
    """Make all changes, or none; return whether `take_back` can undo them, as with `keep` it can.

    `on_wait` gets a message if another command must end first, and if there is no journal. With
    `beside_commands` no other must end, as if the changes were made in an editor.

    Raises:
        EffectError: a file cannot be written, or has changed since it was read.
    """
    course_lock = contextlib.nullcontext() if beside_commands else project_lock(root, on_wait)
    with course_lock, project_lock(root, name=_LOCK):
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
        elif on_wait is not None and len(changes) > 1:
            on_wait(
                "there is no place for a journal: if this command is killed, it stays half done "
                "(set HOME or XDG_STATE_HOME to a folder outside the course)"
            )
        try:
            for change in changes:
                _replace(root, change.path, change.old, change.new)
        except BaseException:
            _restore(root, changes)
            if journal is not None:  # it stays if not all could be restored
                journal.unlink()
            raise
        if journal is not None and keep:
            kept_journals = _kept_journals(journal)
            last = int(kept_journals[-1].suffix[1:]) if kept_journals else 0
            journal.replace(journal.with_name(f"{journal.name}.{last + 1:09}"))
            for old_journal in kept_journals[: 1 - _KEPT]:
                old_journal.unlink(missing_ok=True)
        elif journal is not None:
            journal.unlink()
    return keep and journal is not None


def take_back(
    root: Path, on_wait: Callable[[str], None] | None = None
) -> tuple[list[str], list[str]] | None:
    """Undo the last changes that were kept; return the paths of the files that are as before.

    The second list has those that were edited since, which stay. `None`: nothing was kept. The next
    call undoes the changes before.

    Raises:
        EffectError: a file cannot be written; then none is.
    """
    current_journal = journal_path(root)
    for journal in reversed(_kept_journals(current_journal) if current_journal else []):
        try:
            changes = _unseal_changes(root, journal.read_bytes())
        except (*DAMAGE, FileNotFoundError):
            journal.unlink(missing_ok=True)
            continue
        unedited, edited_paths = [], []
        for change in changes:
            try:
                check_unchanged(_check_path(root, change), change.path, change.new)
                unedited.append(FileChange(change.path, change.new, change.old))
            except FileChangedError:
                edited_paths.append(change.path)
        change_files(root, unedited, on_wait)
        journal.unlink(missing_ok=True)
        return [change.path for change in unedited], edited_paths
    return None


def _unseal_changes(root: Path, journal: bytes) -> tuple[FileChange, ...]:
    """The changes of a journal; one of `DAMAGE` is raised where it is damaged, or not ours."""
    data = unseal(_NAME, journal, store_key(str(root)))
    return msgspec.msgpack.decode(data or b"", type=tuple[FileChange, ...])


def _kept_journals(journal: Path) -> list[Path]:
    """The journals of changes that can be taken back, the last one at the end."""
    return sorted(journal.parent.glob(f"{journal.name}.{'[0-9]' * 9}"))


def undo_changes(root: Path, tell: Callable[[str], None] | None = None) -> None:
    """Undo the changes of a command that was killed; `tell` gets a line that says which.

    Raises:
        EffectError: a file cannot be written.
    """
    journal = journal_path(root)
    if journal is not None and journal.exists():
        with project_lock(root), project_lock(root, name=_LOCK):  # whoever is at work holds it
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
    if journal is None:
        return
    try:
        data = journal.read_bytes()
    except OSError:
        return
    try:
        changes = _unseal_changes(root, data)
        for change in changes:
            _check_path(root, change)
    except (*DAMAGE, OutsideProjectError):
        journal.replace(journal.with_suffix(".damaged"))
        message = "an interrupted command left a damaged journal, so nothing was undone"
        message += ": check the files that it was changing"
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
    outcomes = {
        "undid a change that was interrupted": restored_paths,
        "left as edited since": edited_paths,
    }
    return "; ".join(f"{verb}: {', '.join(sorted(p))}" for verb, p in outcomes.items() if p)


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
        raise OutsideProjectError(f"{change.path} is not a file that a command may change")
    return file


def _replace(root: Path, path: str, old: bytes | None, new: bytes | None) -> None:
    if new is not None:
        write_atomic(root, path, new, expected=old)
        return
    file = check_writable(root, path)
    try:
        check_unchanged(file, path, old)
        _remove(file, path, old)
        for folder in file.relative_to(os.path.realpath(root)).parents:  # remove empty ones
            with contextlib.suppress(OSError):
                Path(os.path.realpath(root), folder).rmdir()
    except OSError as error:
        raise EffectError(f"{path} cannot be removed: {reason(error)}") from None


def _remove(file: Path, path: str, old: bytes | None) -> None:
    """Remove a file that still has this content.

    An editor that saves in place may have begun after the last look. So the file is first moved
    aside, where it is looked at once more; what is saved from then on is a new file.
    """
    aside = file.with_name(f"{PREFIX}{os.urandom(6).hex()}")
    with file.open("rb") as moved_file:
        try_lock(moved_file.fileno())  # or another command might take it for a killed one's
        file.rename(aside)
        try:
            check_unchanged(aside, path, old)
        except EffectError:
            try:
                _move(str(aside), file, path, new=True)
            except FileChangedError:  # it was saved twice, here and in the file's place
                aside.replace(file.with_name(f"{file.name}~"))
            else:
                aside.unlink(missing_ok=True)
            raise
        aside.unlink()
