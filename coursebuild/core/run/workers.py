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

from coursebuild.core.model.results import Outcome
from coursebuild.core.run import supervisor
from coursebuild.core.run.sandbox_watching import SandboxWatch

Enclose: TypeAlias = Callable[[Sequence[str], Mapping[str, str]], tuple[list[str], dict[str, str]]]
"""Makes, of a command and its environment, those that run it in a sandbox."""
_MAX_REPORT_SIZE = 256 << 20
"""Bytes that a report may have."""
_START = 60.0
"""Seconds that a sandbox may take to start its script."""
_GRACE = 5.0
"""Seconds that it may take to report, after its script's time limit."""


class ChildReport(Struct, frozen=True):
    """What a script did, as its supervisor reports it."""

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
    """A supervisor process, which gets jobs and sends reports; it starts when this is made.

    Args:
        environment: the environment of the scripts.
        python: the interpreter that runs them.
        fork: whether they may run in copies of the supervisor.
        enclose: makes a command that runs in a sandbox.

    Raises:
        OSError: the process cannot be started.
    """

    def __init__(
        self, environment: Mapping[str, str], python: str, *, fork: bool, enclose: Enclose | None
    ) -> None:
        self.environment = environment
        self.job: int | None = None
        """The index of the job that it works on."""
        self.is_reused = False
        """Whether it comes from an earlier run and has reported nothing in this one."""
        self.excess: tuple[Outcome, str] | None = None
        """Why its sandbox was ended: how its script counts as ended, and the end of a sentence."""
        self._buffer = bytearray()
        job_reader, job_writer = os.pipe()
        self.reports, report_writer = os.pipe()
        self.jobs: int | None = job_writer
        command = [python, supervisor.PROGRAM, str(job_reader), str(report_writer), str(int(fork))]
        if enclose is not None:
            command, environment = enclose(command, environment)
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                pass_fds=(job_reader, report_writer),
                env=dict(environment),
                start_new_session=True,  # Ctrl-C is for this process, which then ends it
            )
        except BaseException:
            os.close(job_writer)
            os.close(self.reports)
            raise
        finally:
            os.close(job_reader)
            os.close(report_writer)
        for pipe in (self._process.stdout, self._process.stderr):
            assert pipe is not None
            pipe.close()  # a script's streams are pipes too; the supervisor itself prints nothing
        self._watch = None if enclose is None else SandboxWatch(self._process.pid)
        self._start_time = time.monotonic()
        """When the script was started; until then, this process."""
        self._has_started = False

    def give(self, index: int, message: bytes) -> None:
        """Hand over a job."""
        self.job = index
        assert self.jobs is not None
        # The pipe is broken if the supervisor has died, which reading will show.
        with contextlib.suppress(BrokenPipeError), open(self.jobs, "wb", closefd=False) as pipe:
            pipe.write(supervisor.LENGTH.pack(len(message)) + message)

    def enforce_limits(self, timeout: float, memory: int) -> None:
        """End its sandbox if that takes too many seconds, too many MiB, or too many processes.

        The supervisor ends its script at the first of these limits; but it is inside.
        """
        if self._watch is None or self.excess is not None:
            return
        seconds = time.monotonic() - self._start_time
        if self._has_started and seconds > timeout + _GRACE:
            self.excess = Outcome.TIMEOUT, "did not end at its time limit"
        elif seconds > _START and not (self._has_started and self._watch.is_ready()):
            self.excess = Outcome.KILLED, f"did not begin within {_START:g} s"
        elif excess := self._watch.excess(memory):
            self.excess = Outcome.KILLED, excess
        if self.excess is not None:
            self._watch.kill()
            self.kill()

    def kill(self) -> None:
        """End it at once, on Linux with what it runs."""
        self._process.kill()

    def dismiss(self) -> None:
        """Close its input, so that it kills what it runs and ends."""
        if self.jobs is not None:
            os.close(self.jobs)
            self.jobs = None

    def read(self) -> bool:
        """Read what it has sent; `False` when it has ended."""
        data = os.read(self.reports, 1 << 16)
        self._buffer += data
        return bool(data)

    def take_report(self) -> ChildReport | None:
        """Take the next report if all of it has been read.

        Raises:
            ValueError: it is no report.
        """
        size = supervisor.LENGTH.size
        if not self._has_started and self._buffer.startswith(supervisor.STARTED):
            del self._buffer[:size]
            self._start_time, self._has_started = time.monotonic(), True
        if len(self._buffer) < size:
            return None
        (length,) = supervisor.LENGTH.unpack(self._buffer[:size])
        if length > _MAX_REPORT_SIZE:
            raise ValueError("too long")
        if len(self._buffer) < size + length:
            return None
        report = msgspec.json.decode(self._buffer[size:], type=ChildReport)
        self._buffer.clear()
        self._has_started = False
        return report

    def status(self) -> int:
        """Its exit status, or minus the number of the signal that ended it."""
        return self._process.wait()

    def close(self) -> None:
        """Dismiss it and wait until it has killed what it runs; end its sandbox at once."""
        self.dismiss()
        until = time.monotonic() + (10.0 if self._watch is None else 0.0)
        try:
            while (left := until - time.monotonic()) > 0 and wait([self.reports], left):
                if not os.read(self.reports, 1 << 16):
                    break
        finally:
            os.close(self.reports)
            self.kill()  # if it is still there
            self._process.wait()
            if self._watch is not None:
                self._watch.close()
