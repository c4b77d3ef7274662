"""Running the lessons' scripts, each in a process, a session and an environment of its own.

Entry point: `run_scripts`.

1. `parallel` supervisors are started (see `supervisor`), and given one script after another.
2. What they report becomes a `ScriptRun` each: UTF-8 is decoded, CRLF becomes LF.
3. However this ends, a KeyboardInterrupt included, the supervisors see their input close, kill what
   they run and exit.

A script's environment is made here and says nothing of who runs it, but for what finding programs,
libraries and graphics needs.
"""

from __future__ import annotations

import contextlib
import json
import os
import selectors
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from coursebuild.effects import supervisor
from coursebuild.effects.errors import EffectError, reason
from coursebuild.results import Outcome, ScriptJob, ScriptRun

_PASSED_ON = (
    "PATH",
    "HOME",
    "USER",
    "LOGNAME",
    "LD_LIBRARY_PATH",
    "DYLD_LIBRARY_PATH",
    "DYLD_FALLBACK_LIBRARY_PATH",
    "VIRTUAL_ENV",
    "CONDA_PREFIX",
    "CUDA_HOME",
    "CUDA_PATH",
    "CUDA_VISIBLE_DEVICES",
    "NVIDIA_VISIBLE_DEVICES",
    "NVIDIA_DRIVER_CAPABILITIES",
    "MUJOCO_GL",
    "MUJOCO_EGL_DEVICE_ID",
    "PYOPENGL_PLATFORM",
    "SYSTEMROOT",
    "SYSTEMDRIVE",
)
_FIXED = {
    "LC_ALL": "C.UTF-8",
    "LANG": "C.UTF-8",
    "TZ": "UTC",
    "PYTHONUTF8": "1",
    "PYTHONIOENCODING": "utf-8",
    "PYTHONHASHSEED": "0",
    "PYTHONDONTWRITEBYTECODE": "1",
    # A crash, and a script that is stopped after its time limit, say where they were.
    "PYTHONFAULTHANDLER": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "BLIS_NUM_THREADS": "1",
    "NUMEXPR_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
    "NO_COLOR": "1",
    "TERM": "dumb",
    "MPLBACKEND": "Agg",
}


@dataclass(frozen=True, slots=True)
class RunStarted:
    """A script was handed to a supervisor."""

    path: str
    total: int
    """How many scripts are run in all."""


@dataclass(frozen=True, slots=True)
class RunFinished:
    """A script is through, one way or another."""

    run: ScriptRun
    done: int
    """How many are through, with this one."""
    total: int


RunEvent: TypeAlias = RunStarted | RunFinished


def run_scripts(
    root: Path,
    jobs: Sequence[ScriptJob],
    *,
    parallel: int,
    on_event: Callable[[RunEvent], None] | None = None,
) -> tuple[ScriptRun, ...]:
    """Run scripts; those marked `norun` are not, and cause no event.

    Args:
        root: the course folder, which becomes the working directory.
        jobs: what to run, started in this order.
        parallel: how many at a time, at least 1.
        on_event: is told of every start and end, in this thread. What it raises ends the run.

    Returns:
        What each did, in the order of the jobs.

    Raises:
        EffectError: there is no place for temporary files.
    """
    work = _Work(root.resolve(), jobs, on_event or (lambda event: None))
    if not work.waiting:
        return work.results()
    with contextlib.ExitStack() as stack, selectors.DefaultSelector() as selector:
        work.scratch = _scratch()
        stack.callback(supervisor.remove_folder, work.scratch)
        for _ in range(min(max(parallel, 1), len(work.waiting))):
            _start(stack, selector, work)
        while selector.get_map():
            for key, _ in selector.select():
                worker: _Worker = key.data
                if worker.read(work):
                    continue
                selector.unregister(worker.output)
                if not worker.stopped():
                    _start(stack, selector, work)
    return work.results()


def clean_environment(outer: Mapping[str, str]) -> dict[str, str]:
    """The environment of scripts, but for their TMPDIR, given the one that the tool runs in."""
    return {name: outer[name] for name in _PASSED_ON if name in outer} | _FIXED


def _start(stack: contextlib.ExitStack, selector: selectors.BaseSelector, work: _Work) -> None:
    worker = _Worker(work.environment)
    stack.callback(worker.close)
    selector.register(worker.output, selectors.EVENT_READ, worker)
    worker.next(work)


class _Work:
    """What is to be done, and what is done."""

    def __init__(
        self, root: Path, jobs: Sequence[ScriptJob], tell: Callable[[RunEvent], None]
    ) -> None:
        self.root = root
        self.jobs = jobs
        self.tell = tell
        self.environment = clean_environment(os.environ)
        self.library = _library()
        self.scratch = ""
        self.runs: dict[int, ScriptRun] = {
            i: ScriptRun(job.path, Outcome.NORUN, 0, "", "", 0.0)
            for i, job in enumerate(jobs)
            if job.norun
        }
        self.waiting = [i for i in range(len(jobs)) if i not in self.runs]
        self.total = len(self.waiting)
        self.done = 0

    def take(self) -> int | None:
        """The next job's index."""
        if not self.waiting:
            return None
        index = self.waiting.pop(0)
        self.tell(RunStarted(self.jobs[index].path, self.total))
        return index

    def message(self, index: int) -> bytes:
        job = self.jobs[index]
        request: supervisor.Job = {
            "root": str(self.root),
            "path": job.path,
            "args": list(job.args),
            "timeout": job.timeout,
            "requires": list(job.requires),
            "environment": self.environment,
            "scratch": self.scratch,
            "library": self.library,
        }
        data = json.dumps(request).encode()
        return supervisor.LENGTH.pack(len(data)) + data

    def finish(self, index: int, run: ScriptRun) -> None:
        self.runs[index] = run
        self.done += 1
        self.tell(RunFinished(run, self.done, self.total))

    def results(self) -> tuple[ScriptRun, ...]:
        return tuple(self.runs[i] for i in range(len(self.jobs)))


class _Worker:
    """A supervisor, seen from here."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.job: int | None = None
        self.buffer = bytearray()
        self.process = subprocess.Popen(
            # -E and -P: its search path is a script's, without the script's folder.
            [sys.executable, "-E", "-P", supervisor.__file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            env=dict(environment),
            start_new_session=True,  # Ctrl-C is for this process, which then ends it
        )
        assert self.process.stdin is not None and self.process.stdout is not None
        self.input = self.process.stdin
        self.output = self.process.stdout

    def next(self, work: _Work) -> None:
        """Hand over the next job, or let the supervisor go."""
        self.job = work.take()
        if self.job is None:
            self.input.close()
            return
        message = memoryview(work.message(self.job))
        with contextlib.suppress(BrokenPipeError):  # it died; reading tells
            while message:
                message = message[self.input.write(message) :]

    def read(self, work: _Work) -> bool:
        """Take what the supervisor says; `False` when it is gone."""
        data = self.output.read(1 << 16)
        if not data:
            if self.job is not None:
                index, self.job = self.job, None
                work.finish(index, _lost(work.jobs[index].path, self.process.wait()))
            return False
        self.buffer += data
        report = _parse(self.buffer)
        if report is not None and self.job is not None:
            index, self.job = self.job, None
            self.buffer.clear()
            work.finish(index, _script_run(work.jobs[index].path, *report))
            self.next(work)
        return True

    def stopped(self) -> bool:
        """Whether it ended because there was nothing more to do."""
        return self.input.closed

    def close(self) -> None:
        """Let it kill what it runs, and wait for that."""
        with contextlib.suppress(OSError):
            self.input.close()
        try:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(10.0)
        finally:
            self.output.close()
            self.process.kill()  # if it is still there; on Linux the script dies with it
            self.process.wait()


def _parse(buffer: bytearray) -> tuple[supervisor.Report, bytes, bytes] | None:
    """A whole report and its two texts, if the buffer holds them."""
    size = supervisor.LENGTH.size
    if len(buffer) < size:
        return None
    (length,) = supervisor.LENGTH.unpack(buffer[:size])
    at = size + length
    if len(buffer) < at:
        return None
    report: supervisor.Report = json.loads(buffer[size:at])
    end = at + report["stdout"]
    if len(buffer) < end + report["stderr"]:
        return None
    return report, bytes(buffer[at:end]), bytes(buffer[end:])


def _script_run(path: str, report: supervisor.Report, out: bytes, err: bytes) -> ScriptRun:
    stdout, is_text = _decode(out)
    outcome, status = _outcome(report)
    if outcome is Outcome.OK and not is_text:
        outcome = Outcome.ENCODING
    if len(err) == supervisor.STDERR_KEPT:
        err = err[next((i for i in range(4) if err[i] & 0xC0 != 0x80), 0) :]  # a letter cut in two
    return ScriptRun(
        path,
        outcome,
        status,
        stdout,
        _decode(err)[0],
        report["seconds"],
        missing=tuple(report["missing"]),
    )


def _outcome(report: supervisor.Report) -> tuple[Outcome, int]:
    status = report["status"]
    match report["end"]:
        case "missing":
            return Outcome.SKIPPED, 0
        case "timeout":
            return Outcome.TIMEOUT, -status
        case "output-limit":
            return Outcome.OUTPUT_LIMIT, -status
        case "unstartable":
            return Outcome.FAILED, status
        case "exit":
            if status < 0:
                return Outcome.KILLED, -status
            return (Outcome.FAILED if status else Outcome.OK), status


def _decode(data: bytes) -> tuple[str, bool]:
    """Text with LF line ends, other bytes than UTF-8 made visible; whether there were none."""
    try:
        text, is_text = data.decode("utf-8"), True
    except UnicodeDecodeError:
        text, is_text = data.decode("utf-8", "backslashreplace"), False
    return text.replace("\r\n", "\n"), is_text


def _lost(path: str, status: int) -> ScriptRun:
    """The result of a script whose supervisor died under it."""
    if status >= 0:
        raise RuntimeError(f"the supervisor of {path} failed with status {status}")
    name = signal.Signals(-status).name
    text = f"the process that supervises this script was ended by {name}\n"
    return ScriptRun(path, Outcome.KILLED, -status, "", text, 0.0)


def _scratch() -> str:
    """A folder for the scripts' temporary folders."""
    try:
        return tempfile.mkdtemp(prefix="coursebuild-")
    except OSError as error:
        raise EffectError(f"there is no place for temporary files: {reason(error)}") from None


def _library() -> str:
    """The folder that holds the package `mjcourse` that came with this tool."""
    return str(Path(__file__).resolve().parents[2])
