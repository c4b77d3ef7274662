"""Python code in a process of its own, which finds the tool as this checkout has it."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

from support.fixture_cases import fixture_text

ROOT = Path(__file__).parents[2]


def program(name: str) -> str:
    """One of the programs that tests start."""
    text: str = tomllib.loads(fixture_text("scripts/programs.toml"))[name]
    return text


def run_code(
    code: str, *arguments: object, cwd: Path = ROOT, **env: str
) -> subprocess.CompletedProcess[str]:
    """Run it to its end; `env` is what its environment has beside that of the tests."""
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT), **env},
        capture_output=True,
        text=True,
        timeout=600,
    )
