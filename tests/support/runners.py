"""What the tests of the runner share: to run scripts in both ways, and to watch processes."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from coursebuild.effects import runner
from coursebuild.results import ScriptJob, ScriptRun

SOURCE_TREE = Path(runner.__file__).parents[2]
Run = Callable[..., ScriptRun]
way = {"fork": True}
TOOL = """
import sys
from pathlib import Path
from coursebuild.effects.runner import run_scripts
from coursebuild.results import ScriptJob
jobs = [ScriptJob(f"examples/x.py", (), 60.0, (), False)] * int(sys.argv[2])
try:
    fork = sys.argv[3] == "True"
    for run in run_scripts(Path(sys.argv[1]), jobs, parallel=2, fork=fork):
        print(run.outcome, run.stdout)
except KeyboardInterrupt:
    print("interrupted")
"""
"""A command that runs scripts; its arguments: a folder, how many, and whether forked."""


def run_scripts(*args: Any, **options: Any) -> tuple[ScriptRun, ...]:
    return runner.run_scripts(*args, **way, **options)


def job(
    path: str = "examples/x.py",
    *,
    args: Sequence[str] = (),
    timeout: float = 120.0,
    requires: Sequence[str] = (),
    norun: bool = False,
) -> ScriptJob:
    return ScriptJob(path, tuple(args), timeout, tuple(requires), norun)


def alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return False
        return not Path("/proc/self").exists()
    return state != "Z"


def wait_for(path: Path) -> int:
    """The process whose number a script writes into a file."""
    until = time.monotonic() + 120
    while time.monotonic() < until:
        if path.exists() and path.read_text():
            return int(path.read_text())
        time.sleep(0.005)
    raise AssertionError(f"{path} was never written")


def gone(pid: int, seconds: float = 120.0) -> bool:
    until = time.monotonic() + seconds
    while alive(pid) and time.monotonic() < until:
        time.sleep(0.005)
    return not alive(pid)
