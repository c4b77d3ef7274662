"""The process that runs scripts for `runner` and sees to it that nothing stays behind.

Entry points: `Slot`, in a process that `forkserver` has forked; `main`, in one that `workers` has
started, where there is no fork server. It imports nothing but the standard library.

It runs one script after another, each in a session of its own, so that

1. every process that a script starts is found and killed when the script ends, daemons too: on
   Linux an orphan becomes the child of this process;
2. when the tool dies, by whatever signal, this process sees its input close and kills what runs;
3. when this process dies, the system kills the script (Linux).

It has one thread, so that it may act between fork and exec, and fork without an exec.

The protocol: from the tool JSON objects (`Job`), each after its length in 4 bytes; to it for each
one JSON object (`ChildReport`) after its length, and then the bytes of the script's output, of the
end of its error output and of its trace.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import itertools
import json
import os
import shutil
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal, Protocol, TypedDict

from coursebuild.core.run.notes import Notes, read_notes
from coursebuild.core.run.required import missing_modules
from coursebuild.core.run.watching import STDERR_KEPT, STDOUT_LIMIT, Launched, Watched, has_ended

LENGTH = struct.Struct(">I")

_WARM = str(Path(__file__).with_name("warm"))
_NOTES = ".notes"
"""What the folder of a script's notes is called, after its temporary folder."""
_COUNTER = itertools.count()
_PR_SET_PDEATHSIG = 1  # linux/prctl.h
_PR_SET_CHILD_SUBREAPER = 36


class Job(TypedDict):
    """What to run."""

    root: str
    """Working directory."""
    path: str
    """The script, relative to it."""
    args: list[str]
    timeout: float
    """Seconds."""
    requires: list[str]
    """Modules without which it is not run."""
    environment: dict[str, str]
    scratch: str
    """Where the script's temporary folder is made; it goes when the last supervisor does."""
    library: str
    """A folder to import `mjcourse` from, where it is not installed."""
    perturbation: int
    """The direction in which initial states are moved (`initial_state_perturbation`); 0: none."""


class ChildReport(TypedDict):
    """What happened."""

    end: Literal["exit", "timeout", "output-limit", "missing", "unstartable"]
    status: int
    """Exit status; minus the signal's number where one ended it."""
    seconds: float
    missing: list[str]
    stdout: int
    """Length in bytes."""
    stderr: int
    trace: int
    """Length in bytes of the `Notes` as JSON; 0 where nobody watched."""


class Forker(Protocol):
    """Makes a copy of this process that becomes a script."""

    def can_run(self, job: Job) -> bool:
        """Whether the copy would be what a fresh interpreter is to this script."""
        ...

    def fork(self, job: Job, environment: Mapping[str, str], notes: str) -> Launched | None:
        """The copy, which has its pipes and its session; `None` in the copy itself.

        `notes` is a folder that is made where there is much to note of what the script looks at.
        """
        ...


class Slot:
    """One supervisor: where its jobs come from and its reports go to."""

    def __init__(
        self, jobs: int, reports: int, forker: Forker | None = None, *, has_library: bool
    ) -> None:
        self.jobs = jobs
        self.reports = reports
        self.forker = forker
        self.has_library = has_library
        self.awake, wake = os.pipe()
        os.set_blocking(self.awake, False)
        os.set_blocking(wake, False)
        signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
        prctl(_PR_SET_CHILD_SUBREAPER, 1)
        os.chdir("/")
        self.scratch = ""

    def work(self) -> bool:
        """Serve until the input closes: `False`; `True` in a process that is to become a script."""
        while (message := _receive(self.jobs)) is not None:
            job: Job = json.loads(message)
            self.scratch = job["scratch"]
            answer = self._serve(job)
            if answer is None:
                return True
            _send(self.reports, json.dumps(answer[0]).encode(), *answer[1:])
        return False

    def _serve(self, job: Job) -> tuple[ChildReport, bytes, bytes, bytes] | None:
        missing = missing_modules(
            job["requires"], Path(job["root"], job["path"]).parent, job["library"]
        )
        if missing:
            return _report("missing", missing=missing), b"", b"", b""
        if not os.path.isfile(f"{job['root']}/{job['path']}"):  # noqa: PTH113 (here time counts)
            return _unstartable(f"there is no file {job['path']}\n")
        environment = dict(job["environment"])
        if not self.has_library:
            environment["PYTHONPATH"] = job["library"]
        folder, forked = "", False
        try:
            start = time.monotonic()
            try:
                folder = _temporary(job["scratch"])
                parent = os.getppid()  # now, since a script may end it as soon as it runs
                launched = self._launch(job, environment | {"TMPDIR": folder})
            except (OSError, ValueError) as error:  # a ValueError: an argument has a null character
                return _unstartable(f"the script cannot be started: {error}\n")
            if launched is None:
                forked = True
                return None
            run = Watched(launched, start, job["timeout"], self.awake)
            try:
                run.watch(self.jobs, parent)
            finally:
                run.end()
            return _finished(run, launched.notes)
        finally:
            if folder and not forked:
                remove_folder(folder)
                remove_folder(folder + _NOTES)

    def _launch(self, job: Job, environment: Mapping[str, str]) -> Launched | None:
        for argument in job["args"]:
            if b"\0" in os.fsencode(argument):
                raise ValueError("embedded null byte")
        if self.forker is not None and self.forker.can_run(job):
            return self.forker.fork(job, environment, environment["TMPDIR"] + _NOTES)
        return _spawn(job, environment)


def main(reports: int) -> None:
    """Serve the process that started this one, by standard input and this descriptor."""
    os.set_inheritable(reports, False)
    tool = os.getppid()
    slot = Slot(0, reports, has_library=library_is_installed())
    try:
        slot.work()
    finally:
        # While the tool lives the folder is its own: another supervisor may be about to use it.
        if slot.scratch and has_ended(tool):
            with contextlib.suppress(OSError):  # others still use it
                Path(slot.scratch).rmdir()


def library_is_installed() -> bool:
    """Whether scripts find `mjcourse` without being told where."""
    return not missing_modules(["mjcourse"], None, "")


def prctl(option: int, value: int) -> None:
    """Set a property of this process, where the system is Linux."""
    if sys.platform == "linux":
        _libc().prctl(option, value, 0, 0, 0)


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None)


def _temporary(scratch: str) -> str:
    """A fresh folder in `scratch`, which another supervisor may have found empty and removed."""
    while True:
        folder = f"{scratch}/{os.getpid()}-{next(_COUNTER)}"
        try:
            os.mkdir(folder, 0o700)  # noqa: PTH102
            return folder
        except FileExistsError:
            continue
        except FileNotFoundError:
            with contextlib.suppress(FileExistsError):
                Path(scratch).mkdir(mode=0o700)


def _spawn(job: Job, environment: Mapping[str, str]) -> Launched:
    """Start the script with an interpreter of its own."""
    notes = environment["TMPDIR"] + _NOTES
    path = os.pathsep.join(filter(None, (_WARM, environment.get("PYTHONPATH"))))
    (out, stdout), (err, stderr) = os.pipe(), os.pipe()
    try:
        process = subprocess.Popen(
            [sys.executable, job["path"], *job["args"]],
            cwd=job["root"],
            env={
                **environment,
                "PYTHONPATH": path,
                "COURSEBUILD_TRACE": notes,
                "COURSEBUILD_PERTURBATION": str(job["perturbation"]),
            },
            stdin=subprocess.DEVNULL,
            stdout=stdout,
            stderr=stderr,
            start_new_session=True,
            preexec_fn=_before_exec(os.getpid()),  # safe: there is no other thread
        )
    except BaseException:
        os.close(out)
        os.close(err)
        raise
    finally:
        os.close(stdout)
        os.close(stderr)
    process.returncode = 0  # who watches the script reaps it
    read = functools.partial(_notes_of_spawned, notes, job["root"], job["path"])
    return Launched(process.pid, out, err, read)


def _notes_of_spawned(folder: str, root: str, path: str) -> Notes | None:
    if not os.path.isdir(folder):  # noqa: PTH112
        return None
    return read_notes(b"", folder, root, path)


def _before_exec(parent: int) -> Callable[[], None]:
    """What the script's process does before it becomes the script."""
    import resource

    libc = _libc() if sys.platform == "linux" else None

    def prepare() -> None:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a crash leaves no file in the project
        for number in (signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)  # `nohup coursebuild` must not make scripts deaf
        die_with(parent, libc)

    return prepare


def die_with(parent: int, libc: ctypes.CDLL | None) -> None:
    """Let the system end this process when `parent`, which has just forked it, ends."""
    if libc is not None:
        libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:
            os._exit(1)


def _finished(
    run: Watched, notes: Callable[[], Notes | None]
) -> tuple[ChildReport, bytes, bytes, bytes]:
    stdout, stderr = bytes(run.stdout[:STDOUT_LIMIT]), bytes(run.stderr[-STDERR_KEPT:])
    noted = notes()
    trace = b"" if noted is None else json.dumps(noted).encode()
    report: ChildReport = {
        "end": run.over,
        "status": run.exit_status(),
        "seconds": run.seconds,
        "missing": [],
        "stdout": len(stdout),
        "stderr": len(stderr),
        "trace": len(trace),
    }
    return report, stdout, stderr, trace


def _unstartable(text: str) -> tuple[ChildReport, bytes, bytes, bytes]:
    return _report("unstartable", status=2, stderr=text), b"", text.encode(), b""


def _report(
    end: Literal["missing", "unstartable"],
    *,
    status: int = 0,
    missing: list[str] | None = None,
    stderr: str = "",
) -> ChildReport:
    return {
        "end": end,
        "status": status,
        "seconds": 0.0,
        "missing": missing or [],
        "stdout": 0,
        "stderr": len(stderr.encode()),
        "trace": 0,
    }


def remove_folder(folder: str) -> None:
    """Remove a script's temporary folder, also where it took away its own permissions."""
    try:
        os.rmdir(folder)  # noqa: PTH106 (mostly it is empty)
        return
    except FileNotFoundError:
        return
    except OSError:
        pass
    shutil.rmtree(folder, ignore_errors=True)
    if Path(folder).exists():
        with contextlib.suppress(OSError):
            for parent, _, _ in os.walk(folder):
                Path(parent).chmod(0o700)
        shutil.rmtree(folder, ignore_errors=True)


def _receive(fd: int) -> bytes | None:
    """The next message; `None` when there are no more."""
    header = _read_exactly(fd, LENGTH.size)
    return None if header is None else _read_exactly(fd, LENGTH.unpack(header)[0])


def _read_exactly(fd: int, count: int) -> bytes | None:
    data = b""
    while len(data) < count:
        chunk = os.read(fd, count - len(data))
        if not chunk:
            return None
        data += chunk
    return data


def _send(fd: int, header: bytes, *blobs: bytes) -> None:
    rest = memoryview(b"".join((LENGTH.pack(len(header)), header, *blobs)))
    while rest:
        rest = rest[os.write(fd, rest) :]
