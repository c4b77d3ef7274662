"""Scratch courses for the commands that begin and change courses."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.scratch_course import Make, maker


@pytest.fixture
def make(tmp_path: Path, stores: Path) -> Make:
    """Makes a course of these lessons, in a folder with no simple name."""
    return maker(tmp_path, stores)
