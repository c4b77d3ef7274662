"""Make the helpers of this folder, and the kit of scratch courses, importable."""

from collections.abc import Callable
from pathlib import Path

import pytest

from support.question_zoo import furnish
from support.scratch_course import Folder


@pytest.fixture
def make(tmp_path: Path, stores: Path) -> Callable[..., Folder]:
    """Makes a course of these lessons, with a model and a picture."""

    def make(*lessons: str, name: str = "a cöurse") -> Folder:
        folder = Folder(tmp_path / name)
        folder.fill(lessons, stores)
        furnish(folder)
        return folder

    return make
