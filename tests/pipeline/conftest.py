"""Scratch courses for the tests of the commands."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.scratch_course import Folder, Make


@pytest.fixture
def make(tmp_path: Path, stores: Path) -> Make:
    """Makes a course of these lessons, in a folder whose name has unusual characters."""

    def make(*lessons: str | bytes, name: str = "a cöurse") -> Folder:
        folder = Folder(tmp_path / name)
        folder.fill(lessons, stores)
        return folder

    return make
