"""Commands that die, or lack files or memory, at a given call of the system."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from support.scratch_course import Folder, wait_until_alone

KILLED_STATUS = 137


class Mortals:
    """Commands that die at a given call; see `support/killed_commands.py`."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.exchanges = True
        """Whether two folders can be swapped in one step."""
        self.output = ""
        """What the last one wrote for its user."""
        self.status = 0
        self.seconds = self.megabytes = 0.0
        """The processor time that the last one took, and the memory of its largest process."""

    def run(
        self, folder: Folder, *arguments: str, fatal: int = 0, fault: str = "", patience: int = 0
    ) -> tuple[int, list[str]]:
        """The exit status, that of a signal after `patience` seconds, and the calls that worked."""
        assert self.process.stdin is not None and self.process.stdout is not None
        request = {"folder": str(folder.root), "arguments": arguments, "fatal": fatal}
        request |= {"exchanges": self.exchanges, "fault": fault, "patience": patience}
        print(json.dumps(request), file=self.process.stdin, flush=True)
        reply = json.loads(self.process.stdout.readline())
        self.output = reply["said"]
        self.seconds, self.megabytes = reply["seconds"], reply["megabytes"]
        self.status = reply["status"]
        return self.status, reply["calls"]

    def die(self, folder: Folder, *arguments: str, fatal: int) -> None:
        """Run a command that dies at this call.

        What was saved a moment ago is not noted down, so that a run may have a few calls less: it
        got through then, which leaves what a whole run leaves.
        """
        status, calls = self.run(folder, *arguments, fatal=fatal)
        has_survived = status == 0 and fatal - 4 <= len(calls) < fatal
        assert status == KILLED_STATUS or has_survived, (status, fatal)
        wait_until_alone(folder)


@contextlib.contextmanager
def mortal_commands(folder: Folder) -> Iterator[Mortals]:
    """What runs them, in an environment with this folder's temporary one."""
    folder.tmp.mkdir()
    process = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("killed_commands.py"))],
        env=folder.environment(),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with process:
        yield Mortals(process)
        process.kill()
