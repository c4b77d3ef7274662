"""Where a course is, and what decides its results beside its files.

A run with nothing to do loads this module, so it works by strings and stat alone.
"""

from __future__ import annotations

import os

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


def is_dropping(name: str) -> bool:
    """Whether a file or folder of this name is hidden, an editor's copy or Python's own."""
    is_copy = name.endswith("~") or (name.startswith("#") and name.endswith("#"))
    return is_copy or name.startswith(".") or name == "__pycache__"


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
