"""Scripts that several tests run stand beside them; ways to run them, and a user who may little."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from coursebuild.results import ScriptRun
from support.runners import Run, job, run_scripts, way

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


@pytest.fixture(params=[True, False], ids=["forked", "spawned"])
def both_ways(request: pytest.FixtureRequest) -> None:
    """Scripts are run forked from a server, and each with an interpreter of its own."""
    way["fork"] = request.param


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "a course"
    (root / "examples").mkdir(parents=True)
    return root


@pytest.fixture
def run(root: Path) -> Run:
    def run_one(code: str | bytes, **options: object) -> ScriptRun:
        data = code if isinstance(code, bytes) else code.encode()
        (root / "examples/x.py").write_bytes(data)
        (result,) = run_scripts(root, [job(**options)], parallel=1)  # type: ignore[arg-type]
        return result

    return run_one
