"""The rest of a build, in the background after each save: whatever a page need not wait for.

Entry point: `BackgroundRebuild.follow()`, which the main thread runs, so that Ctrl-C ends scripts
as in any other command.

1. When nothing was saved for a moment, everything is read.
2. Scripts and labs that have no remembered result run, and models are compiled (`verify`). Scripts
   that do not print what is recorded run once more, to see whether their new output can be offered.
3. The files of the site are made: changed pages, fonts, the search.
4. New mistakes are printed, and those that are gone.

A save in between begins this anew. A running script is stopped only if it was edited.
"""

from __future__ import annotations

import functools
import sys
import time
from collections import Counter
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any, NoReturn

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.model import Course
from coursebuild.core.model.results import ScriptJob, ScriptRun
from coursebuild.core.run.script_server import OnFinish, RunAll, RunStoppedError, ScriptServer
from coursebuild.core.scripts.bindings import BindingEvidence
from coursebuild.core.scripts.compare import verify as compare
from coursebuild.core.scripts.extract import extract
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.scripts import run
from coursebuild.pipeline.verify import verify
from coursebuild.preview.messages import report_now
from coursebuild.preview.run_history import script_keys
from coursebuild.preview.session import Session
from coursebuild.report import Report, Style, summary_line
from coursebuild.report.text import diagnostic_paragraphs, location

QUIET = 0.15
"""Seconds without a save after which the work begins."""
LONGEST = 2.0
"""Seconds after which it begins in any case."""
RETRY = 2.0
"""Seconds after which failed work is tried again, though nothing was saved."""


class SupersededError(Exception):
    """Something was saved in the meantime."""


class BackgroundRebuild:
    """Does the rest of a build after each save; see the module."""

    def __init__(self, session: Session, style: Style) -> None:
        self._session = session
        self._progress = session.options.progress
        # Only a terminal shows which scripts run, in a line that is erased at their end.
        shown_progress = self._progress if self._progress.live else Progress(quiet=True)
        self._options = replace(session.options, progress=shown_progress)
        self._edits = -1
        """The session's `edits` when the work began last."""
        self._evidence: BindingEvidence = {}
        """The lines that proved bound numbers, also before an output was accepted."""
        self._server = ScriptServer()
        self._style = style
        self._printed: tuple[Diagnostic, ...] | None = None
        """The diagnostics that were printed last."""
        self._failure: BaseException | None = None

    def close(self) -> None:
        """End the process that runs scripts."""
        self._server.close()

    def fail(self, error: BaseException) -> None:
        """Raise an exception of another thread in `follow`."""
        with self._session.condition:
            self._failure = error
            self._session.condition.notify_all()

    def follow(self) -> NoReturn:
        """Work as long as the process lives."""
        while True:
            self._wait()
            try:
                with project_lock(self._options.root, self._progress.say):
                    self.run_once()
            except (SupersededError, RunStoppedError):
                continue
            except EffectError as error:
                text = f"coursebuild: {error.message}" + (f"\n{error.help}" if error.help else "")
                if text != self._session.trouble:
                    print(text, file=sys.stderr, flush=True)
                self._finish(text)

    def _wait(self) -> None:
        """Wait until there is something to do and nobody is saving."""
        session = self._session
        with session.condition:
            session.condition.wait_for(
                lambda: session.edits != self._edits or self._failure is not None,
                RETRY if session.trouble else None,
            )
            failure, self._failure = self._failure, None
            if failure is not None:
                raise failure
            began = time.monotonic()
            while time.monotonic() < began + LONGEST:
                edits = session.edits

                def has_save(edits: int = edits) -> bool:
                    return session.edits != edits

                if not session.condition.wait_for(has_save, QUIET):
                    return

    def run_once(self) -> None:
        """Do everything once.

        Raises:
            SupersededError, RunStoppedError: something was saved in the meantime.
        """
        session = self._session
        self._edits = session.edits
        session.read()
        with session.condition:
            self._edits = session.edits
        course = session.read_saved_course()
        if course is not None:
            self._begin_step("running scripts and labs")
            try:
                self._verify(course)
            except RunStoppedError:
                if session.code == "run":
                    raise
            self._begin_step("drawing pages")
            session.make_site(self._pause)
        self._finish()

    def _begin_step(self, step: str) -> None:
        self._pause()
        self._session.busy = step
        self._session.notify()

    def _pause(self) -> None:
        """Let a save go first, and begin anew after it."""
        self._session.calm.wait(LONGEST)
        if self._session.edits != self._edits:
            raise SupersededError

    def _finish(self, trouble: str = "") -> None:
        """End the work; print mistakes that are new."""
        session = self._session
        with session.condition:
            if session.edits != self._edits and not trouble:
                raise SupersededError
            session.busy = ""
            session.trouble = trouble
            session.notify()
        if not trouble:
            self._print_changes(report_now(session))

    def _print_changes(self, report: Report) -> None:
        """Print the mistakes that are new, and those that are gone."""
        now, before = report.diagnostics, self._printed
        self._printed = now
        new = subtract_diagnostics(now, before or ())
        resolved = subtract_diagnostics(before or (), now)
        for paragraph in diagnostic_paragraphs(new, self._style):
            print(paragraph, file=sys.stderr, flush=True)
        for diagnostic in resolved:
            self._progress.say(f"gone: {location(diagnostic.span)}: {diagnostic.message}")
        counts = [f"{len(new)} new"] if new else []
        counts += [f"{len(resolved)} gone"] if resolved else []
        verdict = summary_line(report).rpartition(": ")[2]
        if now and before is not None:
            verdict = f"{verdict} ({', '.join(counts)})" if counts else f"still {verdict}"
        self._progress.say(f"checked: {verdict}")

    # --- scripts

    def _verify(self, course: Course) -> None:
        session = self._session
        with session.condition:
            is_all_due, session.runs.is_all_due = session.runs.is_all_due, False
            known_runs = {} if is_all_due else session.runs.known_runs(course)
        try:
            verification = verify(
                course,
                replace(self._options, run_all=self._make_run_all(course)),
                static=True,
                evidence=self._evidence,
                known_runs=known_runs,
            )
        except BaseException:
            session.runs.is_all_due |= is_all_due
            raise
        self._options.store.fresh = False  # with `--no-cache`, everything is made anew only once
        session.take_results(course, verification)
        with session.condition:
            course_now, runs = session.course, verification.results.runs
            verdicts = () if course_now is None else compare(course_now, runs)
        drifted_paths = {v.recording.script or "" for v in verdicts if v.status == "drift"}
        self._run_again(course, drifted_paths)

    def _make_run_all(self, course: Course) -> RunAll:
        """Make a function that runs scripts, and shows what each prints as soon as it ends."""
        session, keys = self._session, script_keys(course)
        run_scripts = self._run_unless_edited(course)

        def run_all(
            root: Path, jobs: Sequence[ScriptJob], *, on_finish: OnFinish, **keywords: Any
        ) -> tuple[ScriptRun, ...]:
            def take_run(run: ScriptRun) -> None:
                on_finish(run)
                session.take_run(keys[run.path], run)

            return run_scripts(root, jobs, on_finish=take_run, **keywords)

        return run_all

    def _run_unless_edited(self, course: Course) -> RunAll:
        """Make a function that runs scripts until one of them is edited while it runs."""
        session, edits, keys = self._session, self._edits, script_keys(course)
        if session.code != "run":
            return _refuse_runs

        def is_any_edited(running: frozenset[str]) -> bool:
            nonlocal edits
            with session.condition:
                if session.edits == edits or session.course is None:
                    return False
                edits = session.edits
                keys_now = script_keys(session.course)
            return any(keys_now.get(path) != keys[path] for path in running)

        return functools.partial(self._server.run, is_unwanted=is_any_edited)

    def _run_again(self, course: Course, drifted_paths: Collection[str]) -> None:
        """Run drifted scripts once more, unless they have done so already."""
        session, options = self._session, self._options.for_course(course)
        paths = {path for path in drifted_paths if session.runs.second_output(path) is None}
        scripts = [script for script in extract(course).value if script.path in paths]
        if scripts:
            self._begin_step("running scripts again")
            run_store = options.run_store(fresh=True)
            server_options = replace(options, run_all=self._run_unless_edited(course))
            runs = run(scripts, server_options, "running scripts again", run_store)
            with session.condition:
                session.runs.take_second_runs(runs)
                session.notify()


def _refuse_runs(*_: object, **__: object) -> NoReturn:
    raise RunStoppedError


def subtract_diagnostics(
    diagnostics: Sequence[Diagnostic], earlier: Sequence[Diagnostic]
) -> list[Diagnostic]:
    """Return the diagnostics that are not among the earlier ones, wherever lines have moved."""

    def identity(d: Diagnostic) -> tuple[str, ...]:
        return d.rule, d.span.path, d.message, d.label

    counts = Counter(map(identity, earlier))
    rest = []
    for diagnostic in diagnostics:
        counts[identity(diagnostic)] -= 1
        if counts[identity(diagnostic)] < 0:
            rest.append(diagnostic)
    return rest
