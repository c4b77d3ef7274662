"""What `builds.py` is asked for is measured, or refused."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[2] / "benchmarks/builds.py"


@pytest.mark.parametrize(
    ("option", "says"),
    [
        ("--parts=builds,memory", "there is no part `memory`: name some of builds, serve, scripts"),
        ("--tools=coursebuild,jekyll", "no tool is called jekyll: there are coursebuild, "),
    ],
)
def test_a_name_that_means_nothing_is_refused(option: str, says: str) -> None:
    done = subprocess.run([sys.executable, PROGRAM, option], capture_output=True, text=True)
    assert done.returncode != 0
    assert says in done.stderr
    assert done.stdout == ""
