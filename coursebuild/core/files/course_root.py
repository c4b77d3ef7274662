"""Where a course is, by strings and stat alone: a run with nothing to do loads no more than this.

Entry point: `find_course_root`.
"""

from __future__ import annotations

import os

MAP = "content/course.toml"
"""By this file a folder is a course."""


def find_course_root(start: str) -> str | None:
    """The nearest folder from `start` (links resolved) upwards that has a course map."""
    folder = os.path.realpath(start)
    while True:
        if os.path.exists(os.path.join(folder, MAP)):
            return folder
        above = os.path.dirname(folder)
        if above == folder:
            return None
        folder = above
