"""The processes that run scripts, seen from the tool.

Entry points: `ForkServer`, which makes them where processes can be forked; `spawn_worker`.
"""

from __future__ import annotations

import abc
import contextlib
import json
import os
import select
import selectors
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from coursebuild.core.run import forkserver, supervisor
from coursebuild.core.run.surroundings import library_folder

_PATIENCE = 120.0
"""Seconds in which the fork server answers; importing may take long on a cold disk."""
_WARM = Path(__file__).with_name("warm")
_SUPERVISOR = (
    "import sys; sys.path.insert(0, sys.argv[1])\n"
    "from coursebuild.core.run import supervisor\n"
    "sys.path.pop(0); supervisor.main(int(sys.argv[2]))"
)
_SUPERVISED = ("-E", "-P", "-c", _SUPERVISOR)
"""Its search path is a script's, without the script's folder."""


class ServerLostError(Exception):
    """The fork server has gone."""


class Worker(abc.ABC):
    """A supervisor: it is given jobs and sends reports."""

    def __init__(self, environment: Mapping[str, str], jobs: int, reports: int) -> None:
        self.environment = environment
        """What it was started with."""
        self.jobs: int | None = jobs
        self.reports = reports
        self.job: int | None = None
        """What it works on: the index of a job."""
        self.rested = False
        """Whether it is as it was left by an earlier run, and has reported nothing since."""
        self._buffer = bytearray()

    def fileno(self) -> int:
        """Where its reports are read."""
        return self.reports

    def give(self, index: int, message: bytes) -> None:
        """Hand over a job."""
        self.job = index
        rest = memoryview(supervisor.LENGTH.pack(len(message)) + message)
        assert self.jobs is not None
        with contextlib.suppress(BrokenPipeError):  # it died; reading tells
            while rest:
                rest = rest[os.write(self.jobs, rest) :]

    def is_there(self) -> bool:
        """Whether it waits for a job: while it does it says nothing, unless it ends."""
        return self.job is None and not select.select([self.reports], [], [], 0)[0]

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

    def take_report(self) -> tuple[supervisor.ChildReport, bytes, bytes, bytes] | None:
        """A whole report with the script's output, error output and trace, if it is here."""
        size = supervisor.LENGTH.size
        if len(self._buffer) < size:
            return None
        (length,) = supervisor.LENGTH.unpack(self._buffer[:size])
        at = size + length
        if len(self._buffer) < at:
            return None
        report: supervisor.ChildReport = json.loads(self._buffer[size:at])
        ends = [at + report["stdout"]]
        ends += [ends[-1] + report["stderr"]]
        ends += [ends[-1] + report["trace"]]
        if len(self._buffer) < ends[-1]:
            return None
        data = bytes(self._buffer)
        self._buffer.clear()
        return report, data[at : ends[0]], data[ends[0] : ends[1]], data[ends[1] :]

    @abc.abstractmethod
    def status(self) -> int:
        """What ended it, once it is gone: minus a signal's number, or an exit status."""

    def close(self) -> None:
        """Let it kill what it runs, and wait for that."""
        self.dismiss()
        try:
            with contextlib.suppress(OSError):
                self._wait(10.0)
        finally:
            os.close(self.reports)

    def _wait(self, seconds: float) -> None:
        until = time.monotonic() + seconds
        with selectors.DefaultSelector() as selector:
            selector.register(self.reports, selectors.EVENT_READ)
            while (left := until - time.monotonic()) > 0 and selector.select(left):
                if not os.read(self.reports, 1 << 16):
                    return


class _SpawnedWorker(Worker):
    def __init__(
        self,
        environment: Mapping[str, str],
        process: subprocess.Popen[bytes],
        jobs: int,
        reports: int,
    ) -> None:
        super().__init__(environment, jobs, reports)
        self._process = process

    def status(self) -> int:
        return self._process.wait()

    def close(self) -> None:
        super().close()
        self._process.kill()  # if it is still there; on Linux the script dies with it
        self._process.wait()


@contextlib.contextmanager
def _pipes() -> Iterator[tuple[int, int, int, int]]:
    """Ends of two pipes: a supervisor's for jobs and reports, and ours, which alone stay open.

    Where it does not come to a supervisor, none stays open.
    """
    theirs, jobs = os.pipe()
    reports, theirs_too = os.pipe()
    try:
        yield theirs, theirs_too, jobs, reports
    except BaseException:
        os.close(jobs)
        os.close(reports)
        raise
    finally:
        os.close(theirs)
        os.close(theirs_too)


def spawn_worker(environment: Mapping[str, str], python: str | None = None) -> Worker:
    """A supervisor with an interpreter of its own, which starts one for each script.

    `python` is another interpreter than the one that runs this.
    """
    with _pipes() as (theirs, theirs_too, jobs, reports):
        process = subprocess.Popen(
            [python or sys.executable, *_SUPERVISED, library_folder(), str(theirs_too)],
            stdin=theirs,
            stdout=subprocess.DEVNULL,
            pass_fds=(theirs_too,),
            env=dict(environment),
            start_new_session=True,  # Ctrl-C is for this process, which then ends it
        )
    return _SpawnedWorker(environment, process, jobs, reports)


class _ForkedWorker(Worker):
    def __init__(self, server: ForkServer, pid: int, jobs: int, reports: int) -> None:
        super().__init__(server.environment, jobs, reports)
        self._server = server
        self._pid = pid

    def status(self) -> int:
        return self._server.status_of(self._pid)


class ForkServer:
    """The fork server, started when this is made.

    `python` is another interpreter than the one that runs this.

    Raises:
        OSError: there is no place for another process.
    """

    def __init__(self, environment: Mapping[str, str], python: str | None = None) -> None:
        self.environment = dict(environment)
        """What scripts that it forks have found around them since their start."""
        self.trouble = ""
        """Why it starts scripts instead of forking them, in words."""
        self.loaded: frozenset[str] = frozenset()
        self._asked: frozenset[str] | None = None
        """Packages that it is importing now, or was when the tool last listened."""
        self._stamps: dict[str, object] = {}
        self._ended: dict[int, int] = {}
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                [python or sys.executable, forkserver.PLACEHOLDER, str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                cwd="/",
                env=self.environment | {"PYTHONPATH": str(_WARM)},
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
            )
        for pipe in (self._process.stdout, self._process.stderr):
            assert pipe is not None
            pipe.close()  # a script's streams are like these; the server writes nothing to them

    def load(self, names: Sequence[str]) -> bool:
        """Have packages imported; whether any was not yet.

        Raises:
            ServerLostError: that ended it.
        """
        news = False
        while self._asked is not None or not self.loaded.issuperset(names):
            self.expect(names)
            answer = self._receive_until("fork")
            assert self._asked is not None
            self.loaded |= self._asked
            self._asked = None
            self.trouble = answer["fork"]
            for path in answer["files"]:
                self._stamps.setdefault(path, _stamp(path))
            news = True
        return news

    def expect(self, names: Sequence[str]) -> None:
        """Have packages imported, without waiting for it.

        Raises:
            ServerLostError: it has gone.
        """
        if self._asked is None and not self.loaded.issuperset(names):
            self._send({"load": list(names)}, [])
            self._asked = frozenset(names)

    def worker(self, scratch: str) -> Worker:
        """A supervisor, forked from it.

        Raises:
            ServerLostError: it has gone.
        """
        with _pipes() as (theirs, theirs_too, jobs, reports):
            self._send({"scratch": scratch}, [theirs, theirs_too])
            answer = self._receive_until("slot")
        return _ForkedWorker(self, answer["slot"], jobs, reports)

    def usable(self, environment: Mapping[str, str]) -> bool:
        """Whether it is there, and a script forked now sees what one started now would."""
        return (
            self._process.poll() is None
            and self.environment == environment
            and all(_stamp(path) == stamp for path, stamp in self._stamps.items())
        )

    def status_of(self, pid: int) -> int:
        """How a supervisor ended."""
        try:
            while pid not in self._ended:
                self._receive()
        except ServerLostError:
            return self._process.wait() or -9
        return self._ended.pop(pid)

    def close(self) -> None:
        """End it; its supervisors have been dismissed."""
        with contextlib.suppress(OSError):  # it has gone
            # Copies of this process may hold the socket as well.
            self._control.shutdown(socket.SHUT_RDWR)
        self._control.close()
        try:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(10.0)
        finally:
            self._process.kill()
            self._process.wait()

    def _send(self, request: forkserver.ServerRequest, fds: list[int]) -> None:
        try:
            socket.send_fds(self._control, [json.dumps(request).encode()], fds)
        except OSError:
            raise ServerLostError from None

    def _receive_until(self, key: str) -> dict[str, Any]:
        while True:
            answer = self._receive()
            if key in answer:
                return answer

    def _receive(self) -> dict[str, Any]:
        self._control.settimeout(_PATIENCE)
        try:
            data = self._control.recv(1 << 20)
        except OSError:
            data = b""
        if not data:
            raise ServerLostError
        answer: dict[str, Any] = json.loads(data)
        if "failed" in answer:
            raise RuntimeError(answer["failed"])
        if "ended" in answer:
            self._ended[answer["ended"]] = answer["status"]
        return answer


def _stamp(path: str) -> object:
    try:
        found = Path(path).stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_ino, found.st_size
