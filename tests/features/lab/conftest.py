"""Scratch courses for the tests of labs."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.lab_lessons import Make
from support.scratch_course import Folder


@pytest.fixture
def make(tmp_path: Path, stores: Path) -> Make:
    """Makes a course of these lessons."""

    def make(*lessons: str) -> Folder:
        folder = Folder(tmp_path / "course")
        folder.fill(lessons, stores)
        return folder

    return make
