"""What the tests of the runner share: scripts to be run in both ways, and processes to watch."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run import script_server
from coursebuild.core.run.script_server import ScriptServer
from support.fixture_cases import fixture_text
from support.waiting import wait_for_file, wait_until

SOURCE_TREE = Path(script_server.__file__).parents[3]
Run = Callable[..., ScriptRun]
both_ways = pytest.mark.parametrize("server", ["forking", "spawning"], indirect=True)
"""Scripts are run forked from a server, and each with an interpreter of its own: a smoke test."""
forked_or_not = pytest.mark.parametrize("fork", [True, False], ids=["forked", "spawned"])
TOOL = fixture_text("scripts/run_one.txt")
"""A command that runs a script; its arguments: a folder, and whether forked."""


def job(
    path: str = "examples/x.py",
    *,
    args: Sequence[str] = (),
    timeout: float = 120.0,
    requires: Sequence[str] = (),
    perturbation: int = 0,
    part_lines: Sequence[int] = (),
) -> ScriptJob:
    requirements = tuple(requires)
    return ScriptJob(
        path, tuple(args), timeout, requirements, perturbation, part_lines=tuple(part_lines)
    )


def is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return False
        return not Path("/proc/self").exists()
    return state != "Z"


def processor_time(pid: int) -> int:
    """The processor time that a process has taken, in hundredths of a second."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])


def wait_for(path: Path) -> int:
    """Wait for a script to write a process's number into a file, and return the number."""
    wait_for_file(path, 1)
    return int(path.read_text())


def wait_until_ended(pid: int) -> bool:
    wait_until(lambda: not is_alive(pid), f"the end of process {pid}")
    return True


def run_hanging(
    server: ScriptServer, root: Path, *codes: str, is_done: Callable[[str], object] = bool
) -> list[ScriptRun]:
    """Run scripts that do not end, with a limit that lets each print enough before."""
    paths = [f"examples/hanging{number}.py" for number in range(len(codes))]
    for path, code in zip(paths, codes, strict=True):
        (root / path).write_text(code)
    for limit in (0.5, 8.0, 120.0):
        jobs = [job(path, timeout=limit) for path in paths]
        runs = server.run(root, jobs, parallel=len(jobs))
        assert all(run.outcome is Outcome.TIMEOUT and run.seconds >= limit for run in runs)
        if all(is_done(run.stdout) for run in runs):
            break
    return list(runs)
