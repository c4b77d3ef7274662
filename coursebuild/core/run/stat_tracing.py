"""Note what a script asks about files without opening them: whether they exist, their sizes, times.

Python has no audit event for this, so `os.stat`, `os.lstat`, `os.access` and `os.readlink` are
wrapped in the script's own process; `os.path` and `pathlib` call these. What is noted is the answer
at the time of the question. An import asks in another way (`posix.stat`), and is as fast as before.

What is asked decides what counts as a change:

- `existence`: what kind of thing lies at a path. So ask functions of Python's own library that give
  no more than that to their caller, as `os.path.exists` does.
- `status`: also its size, times and mode. That is for whoever calls `os.stat` itself.
- the content, which determines a size: `os.path.getsize`.
"""

from __future__ import annotations

import os
import posix
import sys
from collections.abc import Callable, Mapping
from stat import S_IMODE, S_ISDIR, S_ISLNK, S_ISREG
from types import FrameType
from typing import Any

_OF_KIND = frozenset(
    "exists lexists isfile isdir islink ismount isjunction samefile realpath _joinrealpath"
    " resolve is_file is_dir is_symlink is_mount is_junction _stat copymode copystat"
    " checkcache updatecache select_exists".split()
)
"""Functions of Python's that give their caller no size and no time: of `os.path`, `pathlib`,
`shutil`, `glob`, and `linecache`, which reads the file as well."""
_PASSING = ("stat", "lstat", "readlink")
"""Methods of `pathlib` that give all to their caller."""


def existence(path: str) -> str:
    """What kind of thing lies at a path; of a link also where it leads."""
    link = ""
    try:
        mode = posix.lstat(path).st_mode
        if S_ISLNK(mode):
            link = f"link to {posix.readlink(path)}: "
            mode = posix.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError, ValueError):
        return f"{link}absent"
    except OSError:
        return f"{link}unreadable"
    return link + ("folder" if S_ISDIR(mode) else "file" if S_ISREG(mode) else "special")


def status(path: str) -> str:
    """The kind, mode, size and time of change of what lies at a path."""
    kind = existence(path)
    try:
        result = posix.stat(path)
    except (OSError, ValueError):
        return kind
    return f"{kind} {S_IMODE(result.st_mode):o} {result.st_size} {result.st_mtime_ns}"


class QuestionNotes:
    """Wraps the functions, and notes what is asked, each question once; see `tracing.Tracer`."""

    def __init__(
        self,
        root: str,
        note_question: Callable[[str, object, Callable[[str], str]], None],
        note_read: Callable[[object], None],
    ) -> None:
        self._root, self._note_question, self._note_read = root, note_question, note_read
        self._noted_keys: set[tuple[object, ...]] = set()

    def install(self) -> None:
        """Wrap the functions in this process."""
        for name in ("stat", "lstat", "access", "readlink"):
            real, new = getattr(posix, name), self._wrap(name)
            setattr(os, name, new)
            # What a script finds in these sets says what it may ask of the function.
            for functions in (
                os.supports_dir_fd,
                os.supports_fd,
                os.supports_follow_symlinks,
                os.supports_effective_ids,
            ):
                if real in functions:
                    functions.add(new)
        # Python 3.13 keeps the function itself for `Path.glob`.
        globber = getattr(sys.modules.get("glob"), "_StringGlobber", None)
        if hasattr(globber, "lstat"):
            setattr(globber, "lstat", os.lstat)  # noqa: B010 (no type checker knows it)

    def forget(self) -> None:
        """Take questions anew, as must be where relative paths mean something else."""
        self._noted_keys.clear()

    def _wrap(self, name: str) -> Callable[..., Any]:
        real = getattr(posix, name)
        keys, get_frame, note = self._noted_keys, sys._getframe, self._note

        def wrapper(path: Any, *args: Any, **keywords: Any) -> Any:
            try:
                code = get_frame(1).f_code
                if (path, name, args, code.co_name, code.co_filename) not in keys:
                    note(path, name, args, keywords)
            except Exception:
                pass
            try:
                return real(path, *args, **keywords)
            except BaseException as error:
                if error.__traceback__ is not None:
                    error.__traceback__ = error.__traceback__.tb_next
                raise  # without an entry for this frame, as in `mujoco_tracing`

        for attribute in ("__name__", "__qualname__", "__doc__", "__text_signature__"):
            setattr(wrapper, attribute, getattr(real, attribute))
        wrapper.__module__ = "os"
        # As an attribute of a class it takes no object, like the function in C.
        return staticmethod(wrapper)

    def _note(
        self, path: Any, name: str, args: tuple[Any, ...], keywords: Mapping[str, Any]
    ) -> None:
        frame: FrameType | None = sys._getframe(2)
        assert frame is not None
        code, root = frame.f_code, self._root
        key = path, name, args, code.co_name, code.co_filename
        while code.co_name in _PASSING and not code.co_filename.startswith(root):
            frame = frame.f_back
            if frame is None:
                break
            code = frame.f_code
        is_direct = code.co_name == key[3]
        full_path, descriptor = posix.fspath(path), keywords.get("dir_fd")
        if isinstance(descriptor, int):
            folder = posix.readlink(f"/proc/self/fd/{descriptor}")
            full_path = full_path if full_path[:1] == "/" else f"{folder}/{full_path}"
        elif is_direct and "mode" not in keywords:
            self._noted_keys.add(key)
        mode = keywords.get("mode", *args[:1]) if name == "access" else None
        is_library = not code.co_filename.startswith(root)
        if is_library and code.co_name == "getsize":
            self._note_read(full_path)
        elif name == "readlink" or mode == posix.F_OK or (is_library and code.co_name in _OF_KIND):
            self._note_question("e", full_path, existence)
        else:
            self._note_question("t", full_path, status)
