"""Temporary folders, and the end of those that a killed process has left.

Entry points: `temporary_folder`; `remove_folder`.

1. A folder is locked as long as the process that made it lives. So one that can be locked is
   abandoned; it is removed by the next process that makes one, if it is the same user's.
2. In a folder for temporary files others may put what they like. Only folders are removed that are
   private to this user and have a name as given here, and only where nobody else can have moved
   them there. Links are not followed.
3. A new folder may be taken for an abandoned one before it is locked; then another one is made.
"""

from __future__ import annotations

import contextlib
import functools
import os
import re
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.locks import try_lock

_PREFIX = "coursebuild.tmp."
_NAME = re.compile(re.escape(_PREFIX) + r"[a-z0-9_]{8}")
_OPEN_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


@contextlib.contextmanager
def temporary_folder() -> Iterator[str]:
    """A new folder, removed at the end with everything in it.

    Raises:
        EffectError: there is no place for it.
    """
    import tempfile  # not above: processes that run scripts import this module, and not that

    try:
        _remove_abandoned(tempfile.gettempdir())
        while True:
            folder = tempfile.mkdtemp(prefix=_PREFIX)
            if (fd := _lock(folder)) is not None:
                break
    except OSError as error:
        raise EffectError(f"there is no place for temporary files: {reason(error)}") from None
    try:
        yield folder
    finally:
        remove_folder(folder)
        os.close(fd)


def _lock(folder: str) -> int | None:
    """Lock a new folder; `None` if another process has taken it for abandoned."""
    try:
        fd = os.open(folder, _OPEN_FOLDER)
    except FileNotFoundError:
        return None
    if try_lock(fd) is not False and Path(folder).exists():
        return fd
    os.close(fd)
    return None


@functools.cache
def _remove_abandoned(place: str) -> None:
    """Remove the folders here that this user's processes have left; once in a process."""
    with contextlib.suppress(OSError), os.scandir(place) as entries:
        status, me = os.stat(place), os.geteuid()  # noqa: PTH116
        is_shared = status.st_mode & _OTHERS_WRITE and not status.st_mode & stat.S_ISVTX
        if is_shared or status.st_uid not in (0, me):
            return  # others can move this user's folders
        for entry in entries:
            if _NAME.fullmatch(entry.name):
                with contextlib.suppress(OSError):
                    _remove_if_abandoned(entry.path, me)


def _remove_if_abandoned(folder: str, me: int) -> None:
    fd = os.open(folder, _OPEN_FOLDER)
    try:
        status = os.fstat(fd)
        is_ours = status.st_uid == me and stat.S_IMODE(status.st_mode) == stat.S_IRWXU
        if is_ours and try_lock(fd):
            remove_folder(folder)
    finally:
        os.close(fd)


def remove_folder(folder: str) -> None:
    """Remove a temporary folder, even if a script has removed permissions in it."""
    try:
        os.rmdir(folder)  # noqa: PTH106 (mostly it is empty)
        return
    except FileNotFoundError:
        return
    except OSError:
        pass
    shutil.rmtree(folder, ignore_errors=True)
    if Path(folder).exists():
        with contextlib.suppress(OSError):
            for parent, _, _ in os.walk(folder):
                Path(parent).chmod(0o700)
        shutil.rmtree(folder, ignore_errors=True)
