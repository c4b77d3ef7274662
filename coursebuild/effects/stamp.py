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
a course. `hashlib` loads OpenSSL, of which nothing is needed.)
"""

from __future__ import annotations

import marshal
import os
import stat
import sys
import time

try:
    from _blake2 import blake2b
except ImportError:  # a Python without its own: `hashlib` knows what there is
    from hashlib import blake2b

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from typing import Any

FOLDERS = ("content", "models", "mjcourse")
"""What a course's author writes, and the library that a course may have of its own."""
_HEADER = "coursebuild stamp 3"
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
    "DYLD_LIBRARY_PATH",
    "DYLD_FALLBACK_LIBRARY_PATH",
    "CUDA_HOME",
    "CUDA_PATH",
    "CUDA_VISIBLE_DEVICES",
    "NVIDIA_VISIBLE_DEVICES",
    "NVIDIA_DRIVER_CAPABILITIES",
)
"""Of the environment: what decides which code runs, or how."""
State = tuple[str, int, int, int, int]
"""Of a file: its path in a folder, with slashes; mode, size, time of change in ns, inode."""
_NOTHING: Mapping[str, Iterable[State]] = {}
_RELATIVE = os.stat in os.supports_dir_fd and os.listdir in os.supports_fd
"""Whether a folder's files can be looked at without their whole paths, which the system would
follow for each of them."""
_FOLDER, _NOWHERE = "folder", "nowhere"
"""What is noted in the place of a state: of a folder, of a link that leads to nothing."""


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

    def keep(
        self,
        said: str,
        files: Iterable[str],
        made: Iterable[str],
        known: Mapping[str, Iterable[State]] = _NOTHING,
    ) -> bool:
        """Leave a stamp, where it is certain that all is as the command saw it.

        Args:
            said: what a later run with nothing to do says in the command's place.
            files: further files that it depends on, absolute or relative to the root; also such
                as are not there.
            made: what it left behind, folders or files, likewise.
            known: all files in such folders, as it left them. They are not looked at again: who has
                changed them by now has changed them since, which the next run sees.

        Returns:
            Whether there is a stamp now.
        """
        course, tool = _course(self.root), _tool()
        further = sorted({_absolute(self.root, path) for path in files})
        folders = {_absolute(self.root, path): states for path, states in known.items()}
        left = sorted(_absolute(self.root, path) for path in made)
        if any("\n" in path for path in (*course, *tool, *further, *left, *self.command)):
            return False
        dated = [(part, self.began) for part in (course, tool, further)]
        try:
            seen = list(_signatures([*dated, (left, None)], folders))
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
    if digest != _digest(body):
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


def _signatures(
    parts: Iterable[tuple[Sequence[str], int | None]],
    known: Mapping[str, Iterable[State]] = _NOTHING,
) -> Iterator[str]:
    """After each part, a hash over the stat of all files so far, and of folders with their content.

    A part comes with a time, in ns since 1970, or none. What is known of folders is not looked at.
    Of the first part, which authors write, it counts as well when a file or its name was changed
    last: who edits it may put its time back. (Of a site's files, links to them change that.)

    Raises:
        _UnclearError: there is a link to a folder, whose content is elsewhere; a file was changed
            so shortly before the time of its part, or after it, that its own says nothing.
        OSError: something cannot be looked at.
    """
    digest = blake2b(digest_size=32)
    for text in (sys.version, sys.executable, *(os.environ.get(v, "") for v in _VARIABLES)):
        digest.update(text.encode("utf-8", "surrogateescape") + b"\0")
    for folder in _package_folders():
        digest.update(_listing(folder))
    for number, (paths, began) in enumerate(parts):
        for path in paths:
            looked = _known(path, known[path]) if path in known else None
            for found in looked or _found(path, began, written=number == 0):
                digest.update(found)
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


def _found(path: str, began: int | None, *, written: bool = False) -> Iterator[bytes]:
    """What there is at a path; of a folder what is in it, and in each folder in that.

    `written`: with the times of the last change of any kind.
    """
    try:
        status = os.stat(path)
    except (FileNotFoundError, NotADirectoryError):
        yield _packed(path, _NOWHERE)
        return
    if stat.S_ISDIR(status.st_mode):
        yield from _below(path, began, written=written)
    else:
        if began is not None:
            _be_certain(status.st_mtime_ns, began)
        row = status.st_mode, status.st_size, status.st_mtime_ns, status.st_ino
        yield _packed(path, row)


def _below(folder: str, began: int | None, *, written: bool) -> Iterator[bytes]:
    """One row for each name in a folder, then the same of the folders in it, by their names."""
    rows: list[tuple[str | int, ...]] = []
    inner: list[str] = []
    opened = os.open(folder, os.O_RDONLY) if _RELATIVE else None
    start = "" if _RELATIVE else os.path.join(folder, "")
    try:
        for name in sorted(filter(_counts, os.listdir(folder if opened is None else opened))):
            status = os.lstat(start + name, dir_fd=opened)
            leads: tuple[str, ...] = ()
            if stat.S_ISLNK(status.st_mode):
                leads = (os.readlink(start + name, dir_fd=opened),)
                try:
                    status = os.stat(start + name, dir_fd=opened)
                except FileNotFoundError:
                    rows.append((name, _NOWHERE, *leads))
                    continue
            mode, modified = status.st_mode, status.st_mtime_ns
            if stat.S_ISDIR(mode):
                if leads:
                    raise _UnclearError
                rows.append((name, _FOLDER))
                inner.append(name)
            else:
                if began is not None:
                    _be_certain(modified, began)
                changed = (status.st_ctime_ns,) if written else ()
                rows.append((name, mode, status.st_size, modified, status.st_ino, *leads, *changed))
    finally:
        if opened is not None:
            os.close(opened)
    yield _packed(folder, rows)
    for name in inner:
        yield from _below(os.path.join(folder, name), began, written=written)


def _known(folder: str, files: Iterable[State]) -> Iterator[bytes]:
    """The same of a folder in which there are these files."""
    rows: dict[str, dict[str, tuple[str | int, ...]]] = {"": {}}
    for path, *state in files:
        parent, _, name = path.rpartition("/")
        _add_folder(rows, parent)
        rows[parent][name] = (name, *state)
    yield from _known_below(folder, "", rows)


def _add_folder(rows: dict[str, dict[str, tuple[str | int, ...]]], path: str) -> None:
    """Give a folder a place, and those that it lies in."""
    if path not in rows:
        rows[path] = {}
        above, _, name = path.rpartition("/")
        _add_folder(rows, above)
        rows[above][name] = name, _FOLDER


def _known_below(
    folder: str, path: str, rows: Mapping[str, Mapping[str, tuple[str | int, ...]]]
) -> Iterator[bytes]:
    """`path` is where the folder has its rows."""
    found = [row for name, row in sorted(rows[path].items()) if _counts(name)]
    yield _packed(folder, found)
    for name, *state in found:
        if state == [_FOLDER]:
            assert isinstance(name, str)
            inner = f"{path}/{name}" if path else name
            yield from _known_below(os.path.join(folder, name), inner, rows)


def _packed(path: str, found: Any) -> bytes:
    """What was found at a path, as bytes that say nothing else."""
    # From version 3 on, what is the same object is written once: then bytes depend on more.
    return marshal.dumps((path, found), 2)


def _counts(name: str) -> bool:
    """Whether what is called so counts: not what is hidden, an editor's copy or compiled."""
    return name[0] != "." and name[-1] != "~" and name != "__pycache__"


def _be_certain(modified: int, began: int) -> None:
    """That a file with this time of change is what it was when the work began."""
    wait = _FINE if modified % 1_000_000 else _COARSE
    if modified > began - wait:
        raise _UnclearError


def _digest(data: bytes) -> bytes:
    """A hash of bytes, as text."""
    return blake2b(data, digest_size=32).hexdigest().encode()


def _absolute(root: str, path: str) -> str:
    return os.path.join(root, path)


def _path(root: str, command: Sequence[str]) -> str:
    name = _digest("\0".join(command).encode("utf-8", "surrogateescape")).decode()
    return os.path.join(root, ".coursebuild", "unchanged", name)


def _write(
    root: str, command: Sequence[str], signatures: Sequence[str], further: Sequence[str], said: str
) -> bool:
    head = "\n".join((_HEADER, *signatures, *further))
    body = f"{head}\n\n{said}".encode("utf-8", "surrogateescape")
    data = _digest(body) + b"\n" + body
    path = _path(root, command)
    new = f"{path}.{os.getpid()}"
    try:
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(new, "wb") as file:
            file.write(data)
        os.replace(new, path)
    except OSError:
        try:
            os.unlink(new)
        except OSError:
            return False
        return False
    return True
