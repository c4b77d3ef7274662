"""Whether anything has changed since a command last said that all is well: stat, compare, done.

Entry points: `Watcher`, made before the work begins, whose `keep` notes after it how all was;
`unchanged`, which gives what the command said then, where everything is as it was.

1. A command depends on whole folders (the course's, the tool's), on single files that scripts read,
   on the folders that packages are installed in, and on what it leaves behind (the extracted
   scripts, the site). Of all of these one hash is taken: of names, modes, sizes, times and inodes.
2. It is kept only where nothing changed while the command worked, and nothing so shortly before
   that the clock of the file system could not have told. In doubt the next run looks closer.

This is all that a run with nothing to do loads, so it imports little: paths are strings.
"""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import time

from coursebuild.core.files.course_root import FOLDERS, is_dropping

TYPE_CHECKING = False  # without `typing`, see `coursebuild.cli`
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

_HEADER = "coursebuild up to date 1"
_FINE = 50_000_000
"""ns: a file changed longer ago than this has a time that another change would not have."""
_COARSE = 2_100_000_000
"""The same where a file system counts whole milliseconds, or longer."""
DECISIVE = (
    "MUJOCO_GL",
    "MUJOCO_EGL_DEVICE_ID",
    "PYOPENGL_PLATFORM",
    "LD_LIBRARY_PATH",
    "DYLD_LIBRARY_PATH",
    "DYLD_FALLBACK_LIBRARY_PATH",
    "CUDA_HOME",
    "CUDA_PATH",
    "CUDA_VISIBLE_DEVICES",
    "NVIDIA_VISIBLE_DEVICES",
    "NVIDIA_DRIVER_CAPABILITIES",
)
"""Of the environment of scripts: what decides how something is drawn or computed."""
_PACKAGES = ("site-packages", "dist-packages")
"""What folders with installed packages are called."""
_VARIABLES = (*DECISIVE, "PYTHONPATH", "VIRTUAL_ENV")


class _UnclearError(Exception):
    """There is something here of which it cannot be told whether it has changed."""


class Watcher:
    """Looks at what a command depends on before it begins, and once more when it is done."""

    def __init__(self, root: str, command: Sequence[str]) -> None:
        self.root = root
        self.command = tuple(command)
        self.began = time.time_ns()
        self.before = self._look(())

    def keep(self, said: str, files: Iterable[str], made: Iterable[str]) -> bool:
        """Note how all is, where it is certain that it is as the command saw it.

        Args:
            said: what a later run with nothing to do says in the command's place.
            files: further files that it depends on, absolute or relative to the root; also such
                as are not there.
            made: what it left behind, folders or files, likewise.

        Returns:
            Whether it was noted.
        """
        further = sorted({os.path.join(self.root, path) for path in files})
        left = sorted(os.path.join(self.root, path) for path in made)
        if any("\n" in path for path in (*further, *left)):
            return False
        if self.before is None or self._look(()) != self.before or self._look(further) is None:
            return False
        try:
            state = _state(self.root, [*further, *left])
        except (OSError, _UnclearError):
            return False
        body = "\n".join((_HEADER, state, *further, *left, "", said))
        return _write(_path(self.root, self.command), body.encode("utf-8", "surrogateescape"))

    def _look(self, further: Sequence[str]) -> str | None:
        """The state of the inputs; none where it says nothing."""
        try:
            return _state(self.root, further, self.began)
        except (OSError, _UnclearError):
            return None


def unchanged(root: str, command: Sequence[str]) -> str | None:
    """What the command said when all was as it is now; `None` where that is not known."""
    try:
        with open(_path(root, command), "rb") as file:
            digest, _, body = file.read().partition(b"\n")
        head, _, said = body.decode("utf-8", "surrogateescape").partition("\n\n")
        header, *lines = head.split("\n")
        if digest != _digest(body) or header != _HEADER:
            return None
        return said if _state(root, lines[1:]) == lines[0] else None
    except (OSError, ValueError, _UnclearError):
        return None


def _state(root: str, further: Sequence[str], began: int | None = None) -> str:
    """A hash over the stat of all that counts.

    Raises:
        _UnclearError: there is a link to a folder, whose content is elsewhere; a file was changed
            so shortly before `began`, or after it, that its own time says nothing.
        OSError: something cannot be looked at.
    """
    digest = hashlib.blake2b(digest_size=32)

    def add(*parts: object) -> None:
        digest.update("\0".join(map(str, (*parts, ""))).encode("utf-8", "surrogateescape") + b"\n")

    add(sys.version, sys.executable, *(os.environ.get(name, "") for name in _VARIABLES))
    installed = (folder for folder in sys.path if folder.endswith(_PACKAGES))
    course = (os.path.join(root, name) for name in FOLDERS)
    for path in (*installed, *course, *_tool(), *further):
        for parts in _rows(path, began):
            add(*parts)
    return digest.hexdigest()


def _tool() -> list[str]:
    """Where the tool's own files are."""
    package = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    source = os.path.dirname(package)
    if not os.path.isdir(os.path.join(source, "site", "dist")):
        return [package]
    return [package, *(os.path.join(source, n) for n in ("mjcourse", "templates", "site/dist"))]


def _rows(path: str, began: int | None) -> Iterator[tuple[object, ...]]:
    """What there is at a path, a row each; of a folder all that is in it."""
    try:
        status = os.stat(path)
    except (FileNotFoundError, NotADirectoryError):
        yield path, "nothing"
        return
    if path.endswith(_PACKAGES):  # each has a folder there with its version in the name
        yield path, status.st_mtime_ns, status.st_ino
        return
    if not stat.S_ISDIR(status.st_mode):
        yield path, *_numbers(status, began)
        return
    folders = [path]
    for folder in folders:
        yield folder, "folder"
        with os.scandir(folder) as entries:
            found = sorted((entry.name, entry) for entry in entries if not is_dropping(entry.name))
        for name, entry in found:
            if entry.is_dir(follow_symlinks=False):
                folders.append(entry.path)
            elif not entry.is_symlink():
                yield name, *_numbers(entry.stat(follow_symlinks=False), began)
            elif entry.is_dir():
                raise _UnclearError
            else:
                yield name, os.readlink(entry.path)
                yield from _rows(entry.path, began)


def _numbers(status: os.stat_result, began: int | None) -> tuple[int, ...]:
    modified = status.st_mtime_ns
    if began is not None and modified > began - (_FINE if modified % 1_000_000 else _COARSE):
        raise _UnclearError
    # The time of the last change of any kind: who edits a file may put its own time back.
    return status.st_mode, status.st_size, modified, status.st_ctime_ns, status.st_ino


def _digest(data: bytes) -> bytes:
    return hashlib.blake2b(data, digest_size=32).hexdigest().encode()


def _path(root: str, command: Sequence[str]) -> str:
    name = _digest("\0".join(command).encode("utf-8", "surrogateescape")).decode()
    return os.path.join(root, ".coursebuild", "unchanged", name)


def _write(path: str, body: bytes) -> bool:
    new = f"{path}.{os.getpid()}"
    try:
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(new, "wb") as file:
            file.write(_digest(body) + b"\n" + body)
        os.replace(new, path)
    except OSError:
        return False
    return True
