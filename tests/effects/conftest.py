"""Scripts that several tests run stand beside them; and a user whom permissions hold back."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
NOBODY = 65534


@pytest.fixture
def held_back() -> Iterator[Path]:
    """A folder of a user whom permissions hold back, as whom the test runs: root is not held."""
    with tempfile.TemporaryDirectory() as name:
        root = os.geteuid() == 0
        if root:
            os.chown(name, NOBODY, NOBODY)
            os.seteuid(NOBODY)
        try:
            yield Path(name)
        finally:
            if root:
                os.seteuid(0)
