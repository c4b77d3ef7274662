"""Where a course is, what decides its results beside its files, and how a stranger's file is read.

A run with nothing to do loads this module, so it works by strings and stat alone.
"""

from __future__ import annotations

import errno
import os
import stat

MAP = "content/course.toml"
"""The file that makes a folder a course."""
FOLDERS = ("content", "features", "models", "mjcourse", "theme")
"""The folders that a course's author writes, and the library that a course may have."""
DECISIVE = tuple(
    """
    MUJOCO_GL MUJOCO_EGL_DEVICE_ID PYOPENGL_PLATFORM LD_LIBRARY_PATH DYLD_LIBRARY_PATH
    DYLD_FALLBACK_LIBRARY_PATH CUDA_HOME CUDA_PATH CUDA_VISIBLE_DEVICES NVIDIA_VISIBLE_DEVICES
    NVIDIA_DRIVER_CAPABILITIES
    """.split()
)
"""Environment variables that decide how scripts draw or compute something."""
LARGEST = 1 << 30
"""Bytes of a file that is read at once."""


def is_dropping(name: str) -> bool:
    """Whether a file or folder of this name is hidden, an editor's copy or Python's own."""
    is_copy = name.endswith("~") or (name.startswith("#") and name.endswith("#"))
    return is_copy or name.startswith(".") or name == "__pycache__"


def read_regular(path: str | os.PathLike[str]) -> bytes:
    """The bytes of a file, as `read_bytes` of a path; but a pipe or device is never waited for.

    Raises:
        OSError: it cannot be read, is no regular file, or is larger than `LARGEST`.
    """
    fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    try:
        status = os.fstat(fd)
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if not stat.S_ISREG(status.st_mode):
            raise OSError("it is not a regular file")
        if status.st_size > LARGEST:  # one of holes alone takes no room on the disk
            raise OSError(f"it is larger than {LARGEST >> 20:,} MiB")
        parts = [os.read(fd, status.st_size + 1)]
        while parts[-1]:
            parts.append(os.read(fd, 1 << 20))
        return b"".join(parts)
    finally:
        os.close(fd)


def find_course_root(start: str) -> str | None:
    """The nearest folder from `start` (links resolved) upwards that has a course map."""
    folder = os.path.realpath(start)
    while True:
        if os.path.exists(os.path.join(folder, MAP)):
            return folder
        parent = os.path.dirname(folder)
        if parent == folder:
            return None
        folder = parent
