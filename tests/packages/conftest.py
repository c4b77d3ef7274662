"""Make the helpers of this folder, and the kit of scratch courses, importable."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "pipeline"))

from collections.abc import Callable

import pytest
from coursekit import Folder
from zoo import furnish


@pytest.fixture
def make(tmp_path: Path, stores: Path) -> Callable[..., Folder]:
    """Makes a course of these lessons, with a model and a picture."""

    def make(*lessons: str, name: str = "a cöurse") -> Folder:
        folder = Folder(tmp_path / name)
        folder.fill(lessons, stores)
        furnish(folder)
        return folder

    return make
