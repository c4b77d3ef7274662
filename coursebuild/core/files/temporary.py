"""Temporary folders; those that killed runs left are removed by the next run.

Entry point: `temporary_folder`.

A folder is locked as long as it is used. One that is not locked is removed only if it is empty, as
killed runs leave them, since it may be somebody else's in spite of its name.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.locks import is_abandoned, try_lock

_PREFIX = "coursebuild-"


@contextlib.contextmanager
def temporary_folder() -> Iterator[str]:
    """A new folder, removed at the end with everything in it.

    Raises:
        EffectError: there is no place for it.
    """
    try:
        _remove_abandoned(tempfile.gettempdir())
        folder, fd = _make()
    except OSError as error:
        raise EffectError(f"there is no place for temporary files: {reason(error)}") from None
    try:
        yield folder
    finally:
        os.close(fd)
        shutil.rmtree(folder, ignore_errors=True)


def _make() -> tuple[str, int]:
    """Make a folder and lock it; return it with the descriptor of its lock."""
    while True:
        folder = tempfile.mkdtemp(prefix=_PREFIX)
        with contextlib.suppress(FileNotFoundError):
            fd = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
            try_lock(fd)
            # Another run may have taken it for abandoned before it was locked.
            if os.path.exists(folder):  # noqa: PTH110
                return folder, fd
            os.close(fd)


def _remove_abandoned(place: str) -> None:
    with os.scandir(place) as entries:
        for entry in entries:
            if entry.name.startswith(_PREFIX) and entry.is_dir(follow_symlinks=False):
                with contextlib.suppress(OSError):
                    fd = os.open(entry.path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
                    try:
                        if is_abandoned(fd):
                            os.rmdir(entry.path)  # noqa: PTH106
                    finally:
                        os.close(fd)
