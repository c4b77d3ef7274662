"""Whether anything has changed since a command last said that all is well: stat, compare, done.

Entry points: `Watcher`, made before the work begins, whose `keep` leaves a stamp after it;
`unchanged`, which gives what the command said then, where everything is as it was.

1. A command depends on whole folders (the course's, the tool's), on single files that scripts read,
   on the listings of the folders that packages are installed in, and on what it leaves behind (the
   extracted scripts, the site). A signature is a hash over the names, sizes, times and inodes of
   them all; that of the course's folders alone is kept beside it.
2. A stamp is left only where nothing changed while the command worked, and nothing so shortly
   before that the clock of the file system could not have told. In doubt there is none, and the
   next run looks closer.

Nothing but the smallest parts of the standard library is imported here: this is all that a run with
nothing to do loads. (Paths are strings: importing pathlib takes longer than looking at the files of
a course.)
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
import sys
import time
from collections.abc import Iterable, Iterator, Sequence

FOLDERS = ("content", "models", "mjcourse")
"""What a course's author writes, and the library that a course may have of its own."""
_HEADER = "coursebuild stamp 2"
_FINE = 50_000_000
"""ns: a file changed longer ago than this has a time that another change would not have."""
_COARSE = 2_100_000_000
"""The same where a file system counts whole milliseconds, or longer."""
_VARIABLES = (
    "MUJOCO_GL",
    "MUJOCO_EGL_DEVICE_ID",
    "PYOPENGL_PLATFORM",
    "PYTHONPATH",
    "VIRTUAL_ENV",
    "LD_LIBRARY_PATH",
    "CUDA_VISIBLE_DEVICES",
)
"""Of the environment: what decides which code runs, or how."""


class _UnclearError(Exception):
    """There is something here of which no signature can be had."""


class Watcher:
    """Looks at what a command depends on before it begins, and once more when it is done."""

    def __init__(self, root: str, command: Sequence[str]) -> None:
        self.root = root
        self.command = tuple(command)
        self.began = time.time_ns()
        self.before = self._look()

    def _look(self) -> list[str]:
        """The signatures of the inputs; none where nothing can be told."""
        parts = (_course(self.root), _tool())
        try:
            return list(_signatures((part, self.began) for part in parts))
        except (OSError, _UnclearError):
            return []

    def keep(self, said: str, files: Iterable[str], made: Iterable[str]) -> bool:
        """Leave a stamp, where it is certain that all is as the command saw it.

        Args:
            said: what a later run with nothing to do says in the command's place.
            files: further files that it depends on, absolute or relative to the root; also such
                as are not there.
            made: what it left behind, folders or files, likewise.

        Returns:
            Whether there is a stamp now.
        """
        course, tool = _course(self.root), _tool()
        further = sorted({_absolute(self.root, path) for path in files})
        left = sorted(_absolute(self.root, path) for path in made)
        if any("\n" in path for path in (*course, *tool, *further, *left, *self.command)):
            return False
        dated = [(part, self.began) for part in (course, tool, further)]
        try:
            seen = list(_signatures([*dated, (left, None)]))
        except (OSError, _UnclearError):
            return False
        if seen[:2] != self.before:
            return False
        return _write(self.root, self.command, (seen[0], seen[-1]), (*further, *left), said)


def unchanged(root: str, command: Sequence[str]) -> str | None:
    """What the command said when all was as it is now; `None` where that is not known."""
    try:
        with open(_path(root, command), "rb") as file:
            digest, _, body = file.read().partition(b"\n")
    except OSError:
        return None
    if digest != hashlib.sha256(body).hexdigest().encode():
        return None
    head, _, said = body.decode("utf-8", "surrogateescape").partition("\n\n")
    header, *lines = head.split("\n")
    if header != _HEADER:
        return None
    own, whole, *further = lines
    found = _signatures((part, None) for part in (_course(root), _tool(), further))
    try:
        # Most often something is else in the course, where it is found soonest.
        return said if next(found) == own and [*found][-1] == whole else None
    except (OSError, _UnclearError):
        return None


def _course(root: str) -> list[str]:
    """What of a course every command depends on."""
    return [os.path.join(root, name) for name in FOLDERS]


def _tool() -> list[str]:
    """What else every command depends on."""
    package = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    tool = [package]
    beside = os.path.dirname(package)
    if os.path.isdir(os.path.join(beside, "site", "dist")):  # a source tree
        tool += [os.path.join(beside, name) for name in ("mjcourse", "templates", "site/dist")]
    return tool


def _signatures(parts: Iterable[tuple[Sequence[str], int | None]]) -> Iterator[str]:
    """After each part, a hash over the stat of all files so far, and of folders with their content.

    A part comes with a time, in ns since 1970, or none.

    Raises:
        _UnclearError: there is a link to a folder, whose content is elsewhere; a file was changed
            so shortly before the time of its part, or after it, that its own says nothing.
        OSError: something cannot be looked at.
    """
    digest = hashlib.sha256()
    for text in (sys.version, sys.executable, *(os.environ.get(v, "") for v in _VARIABLES)):
        digest.update(text.encode("utf-8", "surrogateescape") + b"\0")
    for folder in _package_folders():
        digest.update(_listing(folder))
    for paths, began in parts:
        for path in paths:
            for line in _lines(path, began):
                digest.update(line.encode("utf-8", "surrogateescape"))
        yield digest.hexdigest()


def _package_folders() -> list[str]:
    """Where packages are installed: each has a folder there with its version in the name."""
    return [path for path in sys.path if path.endswith(("site-packages", "dist-packages"))]


def _listing(folder: str) -> bytes:
    try:
        status = os.stat(folder)
    except FileNotFoundError:
        return b"-\0"
    return f"{status.st_mtime_ns} {status.st_ino} {folder}\0".encode("utf-8", "surrogateescape")


def _lines(path: str, began: int | None) -> Iterator[str]:
    """One line for a file, and for everything in a folder, in an order that is always the same."""
    try:
        status = os.stat(path)
    except (FileNotFoundError, NotADirectoryError):
        yield f"-\0{path}\0"
        return
    if stat.S_ISDIR(status.st_mode):
        yield f"/\0{path}\0"
        yield from _below(path, began)
    else:
        yield _line(path, status, began)


def _below(folder: str, began: int | None) -> Iterator[str]:
    with os.scandir(folder) as entries:
        found = sorted(entries, key=lambda entry: entry.name)
    for entry in found:
        name = entry.name
        if name == "__pycache__" or name[0] == "." or name[-1] == "~":
            continue
        if entry.is_dir():
            if entry.is_symlink():
                raise _UnclearError
            yield f"/\0{entry.path}\0"
            yield from _below(entry.path, began)
        else:
            try:
                status = entry.stat()
            except FileNotFoundError:  # a link that leads nowhere
                yield f"-\0{entry.path}\0"
            else:
                yield _line(entry.path, status, began)


def _line(path: str, status: os.stat_result, began: int | None) -> str:
    modified = status.st_mtime_ns
    if began is not None:
        wait = _FINE if modified % 1_000_000 else _COARSE
        if modified > began - wait:
            raise _UnclearError
    return f"{status.st_mode} {status.st_size} {modified} {status.st_ino}\0{path}\0"


def _absolute(root: str, path: str) -> str:
    return os.path.join(root, path)


def _path(root: str, command: Sequence[str]) -> str:
    name = hashlib.sha256("\0".join(command).encode("utf-8", "surrogateescape")).hexdigest()
    return os.path.join(root, ".coursebuild", "unchanged", name)


def _write(
    root: str, command: Sequence[str], signatures: Sequence[str], further: Sequence[str], said: str
) -> bool:
    head = "\n".join((_HEADER, *signatures, *further))
    body = f"{head}\n\n{said}".encode("utf-8", "surrogateescape")
    data = hashlib.sha256(body).hexdigest().encode() + b"\n" + body
    path = _path(root, command)
    new = f"{path}.{os.getpid()}"
    try:
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(new, "wb") as file:
            file.write(data)
        os.replace(new, path)
    except OSError:
        with contextlib.suppress(OSError):
            os.unlink(new)
        return False
    return True
