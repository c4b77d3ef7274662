"""What the tests of the runner share: scripts to be run in both ways, and processes to watch."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run import runner

SOURCE_TREE = Path(runner.__file__).parents[3]
Run = Callable[..., ScriptRun]
both_ways = pytest.mark.parametrize("server", ["forking", "spawning"], indirect=True)
"""Scripts are run forked from a server, and each with an interpreter of its own: a smoke test."""
TOOL = """
import sys
from pathlib import Path
from coursebuild.core.run.runner import ScriptServer
from coursebuild.core.model.results import ScriptJob
jobs = [ScriptJob(f"examples/x.py", (), 60.0, (), False)] * int(sys.argv[2])
try:
    with ScriptServer(fork=sys.argv[3] == "True") as server:
        for run in server.run(Path(sys.argv[1]), jobs, parallel=2):
            print(run.outcome, run.stdout)
except KeyboardInterrupt:
    print("interrupted")
"""
"""A command that runs scripts; its arguments: a folder, how many, and whether forked."""


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


def computed(pid: int) -> int:
    """The processor time that a process has taken, in hundredths of a second."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])


def wait_until(happened: Callable[[], object], what: str = "") -> None:
    """Look again and again; what takes two minutes hangs."""
    until = time.monotonic() + 120
    while not happened():
        assert time.monotonic() < until, f"this never came: {what}"
        time.sleep(0.005)


def wait_for(path: Path) -> int:
    """The process whose number a script writes into a file."""
    wait_until(lambda: path.exists() and path.read_text(), str(path))
    return int(path.read_text())


def gone(pid: int) -> bool:
    """That a process ends."""
    wait_until(lambda: not alive(pid), f"the end of process {pid}")
    return True


def hangs(run: Run, code: str, said: Callable[[str], object] = bool) -> ScriptRun:
    """What a script that does not end does, given a limit that lets it say something before."""
    for limit in (0.5, 8.0, 120.0):
        result = run(code, timeout=limit)
        assert result.outcome is Outcome.TIMEOUT
        assert result.seconds >= limit
        if said(result.stdout):
            break
    return result
