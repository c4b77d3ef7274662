"""Running the lessons' scripts, each in a process, a session and an environment of its own.

Entry point: `ScriptServer`, which stays warm between runs.

1. `parallel` supervisors are started. They are given one script after another, and run each as a
   copy of themselves, or in an interpreter of its own (see `supervisor`); the results are the same.
2. What they report becomes a `ScriptRun` each: UTF-8 is decoded, CRLF becomes LF.
3. In a `Sandbox`, a supervisor runs only one script, and nothing that it says is taken for granted.
4. However this ends, a KeyboardInterrupt included, the supervisors see their input close, kill what
   they run and exit.

A script's environment is made here and says nothing of who runs it, but for what finding programs,
libraries and graphics needs.
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from multiprocessing.connection import wait
from pathlib import Path
from typing import Self, TypeAlias

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.temporary import temporary_folder
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run import supervisor
from coursebuild.core.run.packages import site_folders
from coursebuild.core.run.sandbox import Sandbox, copied_folders, difference, visible
from coursebuild.core.run.script_environment import (
    OtherEnvironment,
    clean_environment,
    library_folder,
    wanted_packages,
)
from coursebuild.core.run.script_process import Job
from coursebuild.core.run.trace_records import read_records
from coursebuild.core.run.watching import STDERR_KEPT
from coursebuild.core.run.workers import ChildReport, Enclose, Worker

Started: TypeAlias = Callable[[str], object]
"""Is told of the path of a script that begins."""
Finished: TypeAlias = Callable[[ScriptRun], object]
"""Is told of a script that is through, one way or another."""
RunAll: TypeAlias = Callable[..., tuple[ScriptRun, ...]]
"""Runs scripts, as `ScriptServer.run` does."""


class RunStoppedError(Exception):
    """Whoever asked for scripts to be run wants them no more; what ran was ended."""


def _ignore(what: object) -> None:
    pass


_PATIENCE = 0.1
"""Seconds after which it is asked again whether a run is still wanted."""
_GRACE = 60.0
"""Seconds after its script's time in which a supervisor in a sandbox has to report."""

_LOG = "MUJOCO_LOG.TXT"
"""What MuJoCo writes where it runs when it warns, in a process that a script has started."""


class ScriptServer:
    """Runs scripts, again and again: what they import stays imported in supervisors.

    New ones take their place when they have died, when packages were installed, and when the
    environment is another one.

    Args:
        fork: let scripts be copies of their supervisor, where they can.
        sandbox: what is to be around each script; then none is left warm.
    """

    def __init__(self, *, fork: bool = True, sandbox: Sandbox | None = None) -> None:
        self._fork = fork and sys.platform == "linux"
        self._sandbox = sandbox
        self._idle: list[Worker] = []
        """Supervisors that wait for the next run."""
        self._installed: tuple[object, ...] = ()
        """How the folders with packages were when these were started."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the supervisors."""
        for worker in self._idle:
            worker.dismiss()  # all of them, before waiting for any
        while self._idle:
            self._idle.pop().close()

    def run(
        self,
        root: Path,
        jobs: Sequence[ScriptJob],
        *,
        parallel: int,
        started: Started = _ignore,
        finished: Finished = _ignore,
        place: OtherEnvironment | None = None,
        unwanted: Callable[[frozenset[str]], bool] | None = None,
    ) -> tuple[ScriptRun, ...]:
        """Run scripts; only one run at a time.

        Args:
            root: the course folder, which becomes the working directory.
            jobs: what to run, in the order of their start.
            parallel: how many at a time, at least 1.
            started: is called in this thread; what it raises ends the run.
            finished: likewise.
            place: another interpreter that is to run them.
            unwanted: is asked now and then whether to stop, with the paths of what runs.

        Returns:
            What each did, in the order of the jobs.

        Raises:
            EffectError: there is no place for temporary files, or the interpreter is none.
            RunStoppedError: the run is unwanted.
        """
        if not jobs:
            return ()
        with temporary_folder() as scratch:
            work = _Work(root.resolve(), jobs, started, finished, place, self._sandbox, scratch)
            self._run(work, parallel, unwanted)
        return tuple(work.runs[i] for i in range(len(jobs)))

    def _run(
        self, work: _Work, parallel: int, unwanted: Callable[[frozenset[str]], bool] | None
    ) -> None:
        busy: dict[int, Worker] = {}
        """By the descriptors of their reports."""
        log = work.root / _LOG
        had_log = os.path.lexists(log)
        try:
            for _ in range(min(max(parallel, 1), len(work.jobs))):
                self._start(busy, work)
            asks = unwanted is not None or self._sandbox is not None
            while busy:
                for ready in wait(busy, _PATIENCE if asks else None):
                    self._hear(busy[ready], busy, work)  # type: ignore[index]
                for worker in busy.values():
                    if time.monotonic() > worker.deadline:
                        worker.kill()
                if unwanted is not None and unwanted(work.running(busy.values())):
                    raise RunStoppedError
        finally:
            for worker in busy.values():
                worker.dismiss()  # all of them, before waiting for any
            for worker in busy.values():
                worker.close()
            supervisor.remove_folder(work.scratch)
            if not had_log:
                with contextlib.suppress(OSError):
                    log.unlink()

    def _start(self, busy: dict[int, Worker], work: _Work) -> None:
        worker = self._worker(work)
        busy[worker.reports] = worker
        work.next(worker)

    def _hear(self, worker: Worker, busy: dict[int, Worker], work: _Work) -> None:
        there = work.hear(worker)
        if there and worker.job is not None:
            return
        del busy[worker.reports]
        if there and self._sandbox is None:
            self._idle.append(worker)
            return
        worker.close()
        if work.waiting:
            self._start(busy, work)

    def _worker(self, work: _Work) -> Worker:
        """A supervisor that waits for a job: one that is left, or a new one."""
        installed = _installed(work.place)
        if installed != self._installed:
            self.close()
            self._installed = installed
        while self._idle:
            worker = self._idle.pop()
            worker.is_reused = True
            if worker.environment == work.environment:
                return worker
            worker.close()
        python = sys.executable if work.place is None else work.place.python
        return Worker(work.environment, python, fork=self._fork, enclose=work.enclose)


class _Work:
    """What is to be done, and what is done."""

    def __init__(
        self,
        root: Path,
        jobs: Sequence[ScriptJob],
        started: Started,
        finished: Finished,
        place: OtherEnvironment | None,
        sandbox: Sandbox | None,
        scratch: str,
    ) -> None:
        self.root = root
        self.jobs = jobs
        self.started = started
        self.finished = finished
        clean = clean_environment(os.environ)
        self.environment = clean if place is None else place.environment(clean)
        self.environment |= dict(jobs[0].environment)
        self.library = library_folder()
        self.place = place
        self.scratch = scratch
        if place is not None:  # `mjcourse` alone: what else is installed here is not for it
            Path(scratch, "mjcourse").symlink_to(Path(self.library, "mjcourse"))
            self.library = scratch
        self.sandbox = sandbox
        self.enclose: Enclose | None = None
        self.shown: dict[str, str] = {}
        self.copied: list[tuple[str, str]] = []
        if sandbox is not None:
            self.shown = visible(str(root), self.library, place)
            self.copied = copied_folders(str(root), jobs, scratch)
            command = sandbox.command
            self.enclose = functools.partial(command, shown=self.shown, copied=self.copied)
        self.runs: dict[int, ScriptRun] = {}
        self.waiting = list(range(len(jobs)))
        self.told: set[int] = set()
        """The jobs whose start was told."""
        folders = {self.root / folder for job in jobs for folder in job.packages}
        files = [file for folder in folders for file in folder.rglob("*.py")]
        files += [self.root / job.path for job in jobs]
        self.packages = wanted_packages(files)

    def next(self, worker: Worker) -> None:
        """Hand over the next job, if there is one."""
        if not self.waiting:
            return
        index = self.waiting.pop(0)
        if index not in self.told:
            self.told.add(index)
            self.started(self.jobs[index].path)
        worker.give(index, self._message(self.jobs[index]))
        if self.sandbox is not None:  # a script can stop who supervises it
            worker.deadline = time.monotonic() + self.jobs[index].timeout + _GRACE

    def hear(self, worker: Worker) -> bool:
        """Take what a supervisor says; `False` when it is gone."""
        if not worker.read():
            if worker.job is not None:
                index, worker.job = worker.job, None
                if worker.is_reused:  # it may have been as good as gone before it was given the job
                    self.waiting.insert(0, index)
                    return False
                if self.place is not None and worker.status() > 0:
                    raise EffectError(f"{self.place.python} cannot run scripts")
                status = worker.status() if self.sandbox is None else -signal.SIGKILL
                self._finish(index, _lost(self.jobs[index].path, status))
            return False
        if worker.job is not None:
            try:
                self._take(worker, worker.job)
            except ValueError:
                if self.sandbox is None:
                    raise
                worker.kill()  # the script has it say anything
        return True

    def _take(self, worker: Worker, index: int) -> None:
        """Take the report on a job, if it is here."""
        report = worker.take_report()
        if report is None:
            return
        run = _script_run(str(self.root), self.jobs[index], report)
        if self.sandbox is not None and run.trace is not None:
            why = run.trace.opaque or difference(self.jobs[index], run.trace, self.shown)
            run = replace(run, trace=replace(run.trace, opaque=why))
        worker.job, worker.is_reused = None, False
        self._finish(index, run)
        if self.sandbox is None:
            self.next(worker)

    def running(self, busy: Iterable[Worker]) -> frozenset[str]:
        """The paths of what these supervisors run."""
        return frozenset(self.jobs[w.job].path for w in busy if w.job is not None)

    def _message(self, job: ScriptJob) -> bytes:
        request: Job = {
            "root": str(self.root),
            "path": job.path,
            "args": list(job.args),
            "timeout": job.timeout,
            "requires": list(job.requires),
            "packages": list(self.packages),
            "environment": self.environment,
            "scratch": self.scratch,
            "library": self.library,
            "folders": [f"{self.root}/{folder}" for folder in job.packages],
            "writes": [f"{self.root}/{folder}" for folder in job.writes],
            "copied": self.copied,
            "figures": list(job.figures),
            "perturbation": job.perturbation,
            "memory": job.memory,
        }
        return json.dumps(request).encode()

    def _finish(self, index: int, run: ScriptRun) -> None:
        self.runs[index] = run
        self.finished(run)


def _installed(place: OtherEnvironment | None) -> tuple[object, ...]:
    """The folders with packages, and when something was installed there."""
    found: list[object] = []
    for folder in (*site_folders(), *(() if place is None else place.packages)):
        with contextlib.suppress(OSError):
            found.append((folder, Path(folder).stat().st_mtime_ns))
    return tuple(found)


def _script_run(root: str, job: ScriptJob, report: ChildReport) -> ScriptRun:
    parts = (None if part is None else part.encode("latin-1") for part in report.parts)
    out, err, trace, *figures = parts
    if out is None or err is None:
        raise ValueError("a report without output")
    stdout = out.decode("utf-8", "backslashreplace")
    outcome = Outcome(report.outcome)
    if outcome is Outcome.OK and stdout.encode() != out:
        outcome = Outcome.ENCODING
    if len(err) == STDERR_KEPT:
        err = err[next((i for i in range(4) if err[i] & 0xC0 != 0x80), 0) :]  # a letter cut in two
    drawn = zip(job.figures, figures, strict=False)
    return ScriptRun(
        job.path,
        outcome,
        report.status,
        stdout.replace("\r\n", "\n"),
        err.decode("utf-8", "backslashreplace").replace("\r\n", "\n"),
        report.seconds,
        missing=report.missing,
        trace=read_records(trace, root, job.path) if trace else None,
        figures=tuple((name, data) for name, data in drawn if data is not None),
    )


def _lost(path: str, status: int) -> ScriptRun:
    """The result of a script whose supervisor died under it."""
    if status >= 0:
        raise RuntimeError(f"the supervisor of {path} failed with status {status}")
    name = signal.Signals(-status).name
    text = f"the process that supervises this script was ended by {name}\n"
    return ScriptRun(path, Outcome.KILLED, -status, "", text, 0.0)
