"""Run the lessons' scripts, each in a process, a session and an environment of its own.

1. `parallel` supervisors are given one script after another, and run each in a copy of themselves,
   or in an interpreter of its own (see `supervisor`); the results are the same.
2. Each report becomes a `ScriptRun`: UTF-8 is decoded, CRLF becomes LF.
3. In a `Sandbox`, a supervisor runs only one script, and its report is not trusted.
4. However this ends, a KeyboardInterrupt included, the supervisors see their input close, kill what
   they run and exit.
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import signal
import sys
from collections.abc import Callable, Sequence
from multiprocessing.connection import wait
from pathlib import Path
from typing import Self, TypeAlias

from msgspec.structs import asdict, replace

from coursebuild.core.files.errors import EffectError, lacking
from coursebuild.core.files.locks import temporary_folder
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run.gate import Enclose
from coursebuild.core.run.run_record import read_records
from coursebuild.core.run.sandbox import (
    Sandbox,
    copied_folders,
    sandbox_difference,
    special_files,
    visible_places,
)
from coursebuild.core.run.script_environment import (
    Interpreter,
    clean_environment,
    library_folder,
    site_folders,
    wanted_packages,
)
from coursebuild.core.run.script_worker import Worker
from coursebuild.core.run.watching import STDERR_KEPT

OnStart: TypeAlias = Callable[[str], object]
"""Called with the path of a script that begins."""
OnFinish: TypeAlias = Callable[[ScriptRun], object]
"""Called with the result of a script, however it ended."""
Claim: TypeAlias = Callable[[ScriptJob], ScriptRun | bool]
"""Whether a script may begin, or its result; `False` while another process runs it."""
RunAll: TypeAlias = Callable[..., tuple[ScriptRun, ...]]
"""Runs scripts, as `ScriptServer.run` does."""


class RunStoppedError(Exception):
    """The caller no longer wants the results; the scripts that ran were ended."""


_PATIENCE = 0.1
"""Seconds between two checks of whether a run is still wanted."""
_VIGILANCE = 0.05
"""Seconds between two looks at what sandboxes take."""
_LOG = "MUJOCO_LOG.TXT"
"""The file that MuJoCo's warnings leave in the working folder, in processes of a script's own."""


class ScriptServer:
    """Runs scripts; between runs, supervisors keep imported what scripts import.

    Supervisors are replaced when they have died, when packages were installed, and when the
    environment changes. Without `fork`, no script is a copy of its supervisor; with a sandbox
    around each script, no supervisor is kept warm.
    """

    def __init__(self, *, fork: bool = True, sandbox: Sandbox | None = None) -> None:
        self._fork = fork and sys.platform == "linux"
        self._sandbox = sandbox
        self._idle: list[Worker] = []
        """Supervisors that wait for the next run."""
        self._package_states: list[object] = []
        """The state of the folders with packages when these were started."""

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
        on_start: OnStart = lambda _: None,
        on_finish: OnFinish = lambda _: None,
        interpreter: Interpreter | None = None,
        is_unwanted: Callable[[frozenset[str]], bool] | None = None,
        claim: Claim = lambda _: True,
    ) -> tuple[ScriptRun, ...]:
        """Run scripts, `parallel` at a time; return what each did, in the order of the jobs.

        `root`, the course folder, becomes the working directory; `interpreter` is another one that
        runs them. `claim` is called before a script begins, `on_start` and `on_finish` in this
        thread, where what they raise ends the run. `is_unwanted` is called regularly with the paths
        of what runs, and says whether to stop. There is only one run at a time.

        Raises:
            EffectError: there is no place for temporary files, or the interpreter is none.
            RunStoppedError: the run is unwanted.
        """
        if not jobs:
            return ()
        with temporary_folder() as scratch:
            work = _Work(root.resolve(), jobs, interpreter, self._sandbox, scratch)
            work.on_start, work.on_finish, work.claim = on_start, on_finish, claim
            self._run(work, parallel, is_unwanted)
        return tuple(work.runs[i] for i in range(len(jobs)))

    def _run(
        self, work: _Work, parallel: int, is_unwanted: Callable[[frozenset[str]], bool] | None
    ) -> None:
        jobs, log = work.jobs, work.root / _LOG
        busy: dict[int, Worker] = {}
        """By the descriptors of their reports."""
        had_log = os.path.lexists(log)
        try:
            while True:
                while len(busy) < max(parallel, 1) and (index := work.take_job()) is not None:
                    worker = self._get_worker(work)
                    busy[worker.reports] = worker
                    work.give(worker, index)
                if not busy and not work.pending:
                    break
                patience = None if is_unwanted is None and not work.pending else _PATIENCE
                for ready in wait(busy, patience if self._sandbox is None else _VIGILANCE):
                    worker = busy[ready]  # type: ignore[index]
                    is_alive = work.read_report(worker)
                    if is_alive and worker.job is not None:
                        continue
                    del busy[worker.reports]
                    if is_alive and self._sandbox is None:
                        self._idle.append(worker)
                    else:
                        worker.close()
                running_jobs = [(w, jobs[w.job]) for w in busy.values() if w.job is not None]
                for worker, job in running_jobs:
                    worker.enforce_limits(job.timeout, job.memory)
                paths = frozenset(job.path for _, job in running_jobs)
                if is_unwanted is not None and is_unwanted(paths):
                    raise RunStoppedError
        finally:
            for worker in busy.values():
                worker.dismiss()  # all of them, before waiting for any
            for worker in busy.values():
                worker.close()
            if not had_log:
                with contextlib.suppress(OSError):
                    log.unlink()

    def _get_worker(self, work: _Work) -> Worker:
        packages = () if work.interpreter is None else work.interpreter.packages
        states: list[object] = []
        for folder in (*site_folders(), *packages):  # a new time: something was installed there
            with contextlib.suppress(OSError):
                states.append((folder, Path(folder).stat().st_mtime_ns))
        if states != self._package_states:
            self.close()
            self._package_states = states
        while self._idle:
            worker = self._idle.pop()
            worker.is_reused = True
            if worker.environment == work.environment:
                return worker
            worker.close()
        python = sys.executable if work.interpreter is None else work.interpreter.python
        return Worker(work.environment, python, fork=self._fork, enclose=work.enclose)


class _Work:
    on_start: OnStart
    on_finish: OnFinish
    claim: Claim

    def __init__(
        self,
        root: Path,
        jobs: Sequence[ScriptJob],
        interpreter: Interpreter | None,
        sandbox: Sandbox | None,
        scratch: str,
    ) -> None:
        self.root = root
        self.jobs = jobs
        clean = clean_environment(os.environ)
        self.environment = clean if interpreter is None else interpreter.environment(clean)
        self.environment |= dict(jobs[0].environment)
        self.library = library_folder()
        self.interpreter = interpreter
        self.scratch = scratch
        if interpreter is not None:  # `mjcourse` alone: what else is installed here is not for it
            Path(scratch, "mjcourse").symlink_to(Path(self.library, "mjcourse"))
            self.library = scratch
        self.sandbox = sandbox
        self.enclose: Enclose | None = None
        self.sources: dict[str, str] = {}
        self.copies: list[tuple[str, str]] = []
        if sandbox is not None:
            self.sources = visible_places(str(root), self.library, interpreter)
            self.copies = copied_folders(str(root), jobs, scratch)
            self.enclose = functools.partial(
                sandbox.command,
                sources=self.sources,
                copies=self.copies,
                special_files=special_files(self.sources, self.copies),
                memory=max(job.memory for job in jobs),
            )
        self.runs: dict[int, ScriptRun] = {}
        self.pending = list(range(len(jobs)))
        self.announced_jobs: set[int] = set()
        """The jobs for which `on_start` was called."""
        folders = {self.root / folder for job in jobs for folder in job.packages}
        files = [file for folder in folders for file in folder.rglob("*.py")]
        files += [self.root / job.path for job in jobs]
        self.packages = wanted_packages(files)

    def take_job(self) -> int | None:
        """Take the next job that no other process does, if there is one."""
        for index in [*self.pending]:
            answer = index in self.announced_jobs or self.claim(self.jobs[index])
            if answer is False:
                continue
            self.pending.remove(index)
            if answer is True:
                return index
            self.runs[index] = answer
        return None

    def give(self, worker: Worker, index: int) -> None:
        job = self.jobs[index]
        if index not in self.announced_jobs:
            self.announced_jobs.add(index)
            self.on_start(job.path)
        request = asdict(job) | {  # a `script_process.Job`
            "root": str(self.root),
            "packages": self.packages,
            "environment": self.environment,
            "scratch": self.scratch,
            "library": self.library,
            "folders": [f"{self.root}/{folder}" for folder in job.packages],
            "writes": [f"{self.root}/{folder}" for folder in job.writes],
            "copies": self.copies,
        }
        worker.give(index, json.dumps(request).encode())

    def read_report(self, worker: Worker) -> bool:
        """Read from a supervisor, and finish its job; `False` when the supervisor has ended."""
        if not worker.read():
            if worker.job is not None:
                index, worker.job = worker.job, None
                if worker.is_reused:  # it may have been dying before it was given the job
                    self.pending.insert(0, index)
                    return False
                is_ended = worker.excess is not None  # by us, whatever the sandbox makes of it
                if self.interpreter is not None and not is_ended and worker.status() > 0:
                    raise EffectError(f"{self.interpreter.python} cannot run scripts")
                path = self.jobs[index].path
                status = worker.status() if self.sandbox is None else -signal.SIGKILL
                if status >= 0:
                    raise RuntimeError(f"the supervisor of {path} failed with status {status}")
                outcome, killer = Outcome.KILLED, signal.Signals(-status).name
                text = f"the process that supervises this script was killed by {killer}\n"
                if worker.excess is not None:
                    outcome, excess = worker.excess
                    text = f"its sandbox was stopped, because what ran in it {excess}\n"
                self._finish(index, ScriptRun(path, outcome, -status, "", text, 0.0))
            return False
        if worker.job is not None and worker.excess is None:
            try:
                self._finish_job(worker, worker.job)
            except ValueError:
                if self.sandbox is None:
                    raise
                worker.kill()  # the script has forged the report
        return True

    def _finish_job(self, worker: Worker, index: int) -> None:
        report = worker.take_report()
        if report is None:
            return
        if lack := lacking(OSError(report.errno, None)):  # which is no mistake of the script
            raise lack
        job = self.jobs[index]
        parts = (None if part is None else part.encode("latin-1") for part in report.parts)
        out, err, trace, *figures = parts
        if out is None or err is None:
            raise ValueError("a report without output")
        stdout = out.decode("utf-8", "backslashreplace")
        outcome = Outcome(report.outcome)
        if outcome is Outcome.OK and stdout.encode() != out:
            outcome = Outcome.ENCODING
        if len(err) == STDERR_KEPT:  # a letter may be cut in two
            err = err[next((i for i in range(4) if err[i] & 0xC0 != 0x80), 0) :]
        named_figures = zip(job.figures, figures, strict=False)
        # The output of a part that is not reached begins, empty, at the end.
        count = len(job.part_lines)
        offsets = [*report.part_starts, *[len(out)] * count][:count]
        befores = (out[:offset].decode("utf-8", "ignore") for offset in offsets)
        run = ScriptRun(
            job.path,
            outcome,
            report.status,
            stdout.replace("\r\n", "\n"),
            err.decode("utf-8", "backslashreplace").replace("\r\n", "\n"),
            report.seconds,
            missing=report.missing,
            trace=read_records(trace, str(self.root), job.path) if trace else None,
            figures=tuple((name, data) for name, data in named_figures if data is not None),
            part_starts=tuple(len(before.replace("\r\n", "\n")) for before in befores),
        )
        if self.sandbox is not None and run.trace is not None:
            reason = run.trace.opaque or sandbox_difference(job, run.trace, self.sources)
            run = replace(run, trace=replace(run.trace, opaque=reason))
        worker.job, worker.is_reused = None, False
        self._finish(index, run)
        if self.sandbox is None and (next_index := self.take_job()) is not None:
            self.give(worker, next_index)

    def _finish(self, index: int, run: ScriptRun) -> None:
        self.runs[index] = run
        self.on_finish(run)
