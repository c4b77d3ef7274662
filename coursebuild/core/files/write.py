"""Replacing a file of the course whole, or not at all.

Entry points: `write_atomic`, `check_writable`, `check_unchanged`, `remove_leftovers`.

1. The new bytes go into a temporary file in the same folder, locked as long as its writer is alive.
2. They are synced to the disk, with the permissions and the owner of the file that they replace.
3. If the file is still what the caller read, the temporary file is renamed over it.

A read-only file is left alone, though a rename could replace it: its author meant it. If the tool
is killed at any instant, the file is whole, old or new; at most a temporary file is left, which the
next run removes.
"""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterable
from pathlib import Path

from coursebuild.core.files.errors import EffectError, FileChangedError, OutsideProjectError, reason
from coursebuild.core.files.locks import is_abandoned, try_lock

PREFIX = ".coursebuild-tmp-"
"""What names of temporary files begin with; the dot keeps them out of the course."""


def write_atomic(
    root: Path, path: str, data: bytes, *, expected: bytes | None, durable: bool = True
) -> None:
    """Make `data` the content of a file of the course, or of the file that a link there leads to.

    Args:
        root: the course folder.
        path: POSIX path relative to it.
        data: the new content.
        expected: the file's content when it was read; `None` if there was none, and perhaps no
            folder either.
        durable: whether it is an author's file, whose bytes must survive a power cut and which is
            left alone if it is read-only. (A derived file can be made again.)

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
            _fill(fd, data, target)
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
    """Resolve a path of the course, with all links.

    Raises:
        OutsideProjectError: it leads out of the project.
    """
    try:
        target = Path(os.path.realpath(root / path))
    except ValueError:  # NUL
        raise OutsideProjectError(f"{path!r} is no path") from None
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
                if entry.name.startswith(PREFIX) and entry.is_file(follow_symlinks=False):
                    _remove_if_abandoned(Path(entry.path))


def _remove_if_abandoned(path: Path) -> None:
    with contextlib.suppress(OSError):
        fd = os.open(path, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
        try:
            if is_abandoned(fd):
                path.unlink()
        finally:
            os.close(fd)


def _open_temporary(folder: Path) -> tuple[int, str]:
    """Make a new locked file in a folder; return its descriptor and path."""
    while True:
        path = folder / f"{PREFIX}{os.urandom(6).hex()}"
        fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        try_lock(fd)
        # Another run may have taken it for abandoned before it was locked.
        if os.fstat(fd).st_nlink > 0:
            return fd, str(path)
        os.close(fd)


def _fill(fd: int, data: bytes, target: Path) -> None:
    rest = memoryview(data)
    while rest:
        rest = rest[os.write(fd, rest) :]
    with contextlib.suppress(FileNotFoundError):
        old = target.stat()
        with contextlib.suppress(PermissionError):  # only root may give a file away
            if (old.st_uid, old.st_gid) != (os.geteuid(), os.getegid()):
                os.fchown(fd, old.st_uid, old.st_gid)
        os.fchmod(fd, stat.S_IMODE(old.st_mode))


def _move(temporary: str, target: Path, path: str, *, new: bool) -> None:
    if new:  # a link, unlike a rename, never replaces a file that somebody just made
        try:
            os.link(temporary, target)
            return
        except FileExistsError:
            raise FileChangedError(f"{path} was made by somebody else in the meantime") from None
        except OSError:
            pass  # a file system without links
    Path(temporary).replace(target)


def check_unchanged(target: Path, path: str, expected: bytes | None) -> None:
    """Check that a file has the expected content; `None` stands for no file.

    Raises:
        FileChangedError: it has another.
        EffectError: it cannot be read.
    """
    try:
        current: bytes | None = target.read_bytes()
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
        raise FileChangedError(f"{path} was made by somebody else in the meantime")
    raise FileChangedError(
        f"{path} was changed in the meantime", help="nothing was written; run the command again"
    )
