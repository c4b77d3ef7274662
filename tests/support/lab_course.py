"""The course in `tests/courses/labs`."""

from __future__ import annotations

PAGE = "lessons/1.1-one.html"
