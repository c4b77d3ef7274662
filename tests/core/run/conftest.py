"""Servers that run scripts, shared by all tests of a session."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from coursebuild.core.model.results import ScriptRun
from coursebuild.core.run.script_server import ScriptServer
from support.runners import Run, job


@pytest.fixture(scope="session")
def forking() -> Iterator[ScriptServer]:
    """Runs scripts forked from one process that is started once."""
    with ScriptServer() as server:
        yield server


@pytest.fixture(scope="session")
def spawning() -> Iterator[ScriptServer]:
    """Runs each script with an interpreter of its own."""
    with ScriptServer(fork=False) as server:
        yield server


@pytest.fixture
def server(request: pytest.FixtureRequest) -> ScriptServer:
    """Runs scripts forked; in both ways where a test is marked `both_ways`."""
    script_server: ScriptServer = request.getfixturevalue(getattr(request, "param", "forking"))
    return script_server


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "a course"
    (root / "examples").mkdir(parents=True)
    return root


@pytest.fixture
def run(root: Path, server: ScriptServer) -> Run:
    def run_one(code: str | bytes, **options: object) -> ScriptRun:
        data = code if isinstance(code, bytes) else code.encode()
        (root / "examples/x.py").write_bytes(data)
        (result,) = server.run(root, [job(**options)], parallel=1)
        return result

    return run_one
