"""A supervisor ends with the process that has forked it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from support.runners import SOURCE_TREE

pytestmark = pytest.mark.site

ORPHANED = """
import json, os, signal, time
from coursebuild.core.run.supervisor import LENGTH, Slot
from coursebuild.core.run.watching import Launched

class Forker:
    def can_run(self, job):
        return True

    def fork(self, job, environment, notes):
        "A script that ends the server before its supervisor gets to do anything more."
        (out, stdout), (err, stderr) = os.pipe(), os.pipe()
        server = os.getppid()
        script = os.fork()
        if script == 0:
            os.setsid()
            signal.pause()
        os.close(stdout)
        os.close(stderr)
        os.kill(server, signal.SIGKILL)
        while os.getppid() == server:
            time.sleep(0.001)
        return Launched(script, out, err, lambda: None)

(theirs, jobs), (reports, theirs_too) = os.pipe(), os.pipe()
if os.fork() == 0:
    if os.fork() == 0:
        try:
            os.close(jobs)
            Slot(theirs, theirs_too, Forker(), has_library=True).work()
        finally:
            os._exit(0)
    signal.pause()
os.close(theirs_too)
job = {"root": os.getcwd(), "path": "x.py", "args": [], "timeout": 20.0, "requires": [],
       "environment": {}, "scratch": os.getcwd() + "/scratch", "library": "", "perturbation": 0}
message = json.dumps(job).encode()
os.write(jobs, LENGTH.pack(len(message)) + message)
print(os.read(reports, 1 << 16))
"""


def test_supervisor_ends_when_script_ends_server_at_once(tmp_path: Path) -> None:
    """Where it took the script's time limit to notice, a report of that would come."""
    (tmp_path / "x.py").touch()
    done = subprocess.run(
        [sys.executable, "-c", ORPHANED],
        cwd=tmp_path,
        env={"PYTHONPATH": str(SOURCE_TREE)},
        capture_output=True,
        text=True,
    )
    assert (done.stdout, done.stderr) == ("b''\n", "")
