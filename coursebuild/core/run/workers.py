"""The processes that run scripts, seen from the tool.

Entry point: `Worker`, which gives `ChildReport`s.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.connection import wait
from typing import TypeAlias

import msgspec
from msgspec import Struct

from coursebuild.core.run import supervisor

Enclose: TypeAlias = Callable[[Sequence[str], Mapping[str, str]], list[str]]
"""Of a command and an environment, the command that runs that in a sandbox."""
_MOST = 256 << 20
"""Bytes that a report may have."""


class ChildReport(Struct, frozen=True):
    """What a script did, as its supervisor says it."""

    outcome: str
    """The value of an `Outcome`."""
    status: int
    """Exit status; the signal's number where one ended it."""
    seconds: float
    missing: tuple[str, ...]
    parts: tuple[str | None, ...]
    """Bytes, as Latin-1: its output, the end of its error output, its trace (empty where nobody
    watched), and each figure of the job; `None` for one that it did not draw."""


class Worker:
    """A supervisor, started when this is made: it is given jobs and sends reports.

    Args:
        environment: what scripts find around them.
        python: the interpreter that runs them.
        fork: whether they may be copies of the supervisor.
        enclose: gives the command that runs another one in a sandbox.

    Raises:
        OSError: there is no place for another process.
    """

    def __init__(
        self, environment: Mapping[str, str], python: str, *, fork: bool, enclose: Enclose | None
    ) -> None:
        self.environment = environment
        self.job: int | None = None
        """What it works on: the index of a job."""
        self.is_reused = False
        """Whether it is as it was left by an earlier run, and has reported nothing since."""
        self.deadline = float("inf")
        """When it must have reported, by `time.monotonic`."""
        self._buffer = bytearray()
        theirs, jobs = os.pipe()
        self.reports, theirs_too = os.pipe()
        self.jobs: int | None = jobs
        command = [python, supervisor.PROGRAM, str(theirs), str(theirs_too), str(int(fork))]
        if enclose is not None:  # nothing that a course sets is for who makes the sandbox
            command, environment = enclose(command, environment), {}
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                pass_fds=(theirs, theirs_too),
                env=dict(environment),
                start_new_session=True,  # Ctrl-C is for this process, which then ends it
            )
        except BaseException:
            os.close(jobs)
            os.close(self.reports)
            raise
        finally:
            os.close(theirs)
            os.close(theirs_too)
        for pipe in (self._process.stdout, self._process.stderr):
            assert pipe is not None
            pipe.close()  # a script's streams are pipes too; the supervisor itself prints nothing

    def give(self, index: int, message: bytes) -> None:
        """Hand over a job."""
        self.job = index
        assert self.jobs is not None
        # A pipe that is broken is that of one that died, which reading tells.
        with contextlib.suppress(BrokenPipeError), open(self.jobs, "wb", closefd=False) as pipe:
            pipe.write(supervisor.LENGTH.pack(len(message)) + message)

    def kill(self) -> None:
        """End it at once; on Linux, what it runs with it."""
        self._process.kill()

    def dismiss(self) -> None:
        """Give it no more jobs; it ends, and kills what it runs."""
        if self.jobs is not None:
            os.close(self.jobs)
            self.jobs = None

    def read(self) -> bool:
        """Take what it says; `False` when it is gone."""
        data = os.read(self.reports, 1 << 16)
        self._buffer += data
        return bool(data)

    def take_report(self) -> ChildReport | None:
        """A whole report, if it is here.

        Raises:
            ValueError: it is none.
        """
        size = supervisor.LENGTH.size
        if len(self._buffer) < size:
            return None
        (length,) = supervisor.LENGTH.unpack(self._buffer[:size])
        if length > _MOST:
            raise ValueError("too long")
        if len(self._buffer) < size + length:
            return None
        report = msgspec.json.decode(self._buffer[size:], type=ChildReport)
        self._buffer.clear()
        return report

    def status(self) -> int:
        """What ended it, once it is gone: minus a signal's number, or an exit status."""
        return self._process.wait()

    def close(self) -> None:
        """Let it kill what it runs, and wait for that."""
        self.dismiss()
        until = time.monotonic() + 10.0
        try:
            while (left := until - time.monotonic()) > 0 and wait([self.reports], left):
                if not os.read(self.reports, 1 << 16):
                    break
        finally:
            os.close(self.reports)
            self.kill()  # if it is still there
            self._process.wait()
