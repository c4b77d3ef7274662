"""The rest of a build, in the background after each save: whatever a page need not wait for.

When nothing was saved for a moment, everything is read, verified, drawn, and the mistakes that are
new or gone are printed. When nothing more is to do, scripts that do not print what is recorded run
once more, as their output may vary by itself. So do those whose only run was recorded; before that,
with their initial states moved, to see which digits hold. Other commands need not wait for this.

A save in between begins this anew. A running script is stopped then only if it was edited; one that
runs once more is stopped in any case.
"""

from __future__ import annotations

import contextlib
import functools
import time
from collections import Counter
from collections.abc import Sequence
from typing import NoReturn

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.model import Course
from coursebuild.core.model.lesson_record import known_addresses
from coursebuild.core.run.script_server import RunAll, RunStoppedError, ScriptServer
from coursebuild.core.scripts.extract import extract
from coursebuild.core.scripts.noise_warnings import noise_warnings
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.output import FAILURE, fail, show
from coursebuild.pipeline.options import Progress
from coursebuild.pipeline.scripts import measure_sensitivity, run
from coursebuild.pipeline.verify import verify, with_downloads
from coursebuild.preview.messages import report_now
from coursebuild.preview.run_history import script_keys
from coursebuild.preview.session import Session
from coursebuild.report import Style
from coursebuild.report.text import diagnostic_paragraphs, location

QUIET = 0.15
"""Seconds without a save after which the work begins."""
LONGEST = 2.0
"""Seconds after which it begins in any case."""
IDLE = 1.0
"""Seconds without a save after which scripts run once more."""
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
        self._measured: set[str] = set()
        """The scripts that ran with moved initial states."""
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
                self.run_once()
                self._repeat()
            except (SupersededError, RunStoppedError):
                continue
            except EffectError as error:
                text = f"coursebuild: {error.message}" + (f"\n{error.help}" if error.help else "")
                if text != self._session.trouble:
                    fail(FAILURE, error.message, error.help)
                self._finish(text)

    def _wait(self) -> None:
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
        with project_lock(self._options.root, self._progress.say):
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
        session = self._session
        with session.condition:
            if session.edits != self._edits and not trouble:
                raise SupersededError
            session.busy = ""
            session.trouble = trouble
            session.notify()
        if not trouble:
            report = report_now(session)
            now, before = report.diagnostics, self._printed
            self._printed = now
            new = subtract_diagnostics(now, before or ())
            resolved = subtract_diagnostics(before or (), now)
            for paragraph in diagnostic_paragraphs(new, self._style):
                show(paragraph)
            for diagnostic in resolved:
                self._progress.say(f"gone: {location(diagnostic.span)}: {diagnostic.message}")
            counts = [f"{len(new)} new"] if new else []
            counts += [f"{len(resolved)} gone"] if resolved else []
            verdict = report.summary.verdict()
            if now and before is not None:
                verdict = f"{verdict} ({', '.join(counts)})" if counts else f"still {verdict}"
            self._progress.say(f"checked: {verdict}")

    # --- scripts

    def _verify(self, course: Course) -> None:
        session = self._session
        with session.condition:
            is_all_due, session.runs.is_all_due = session.runs.is_all_due, False
            known_runs = {} if is_all_due else session.runs.known_runs(course)
            # What is accepted while scripts run may be called otherwise from then on.
            addresses = known_addresses(course.records) | session.runs.addresses
            session.runs.addresses = addresses
            if not known_runs:  # what else was printed was so for another reason, or by other code
                session.runs.repeats.clear()
        keys = script_keys(course)
        options = replace(
            self._options,
            run_all=self._run_unless_edited(course),
            on_start=self._take_start,
            on_result=lambda run: session.take_run(keys[run.path], run),
        )
        try:
            verification = verify(
                course,
                options,
                static=True,
                addresses=addresses,
                known_runs=known_runs,
                other_runs=session.runs.other_runs(),
            )
        except BaseException:
            session.runs.is_all_due |= is_all_due
            raise
        finally:
            session.runs.running.clear()
        results, _ = with_downloads(
            course,
            verification.results,
            options.for_course(course),
            session.reader.imports,
            only_known=True,
        )
        verification = replace(verification, results=results)
        self._options.store.fresh = False  # with `--no-cache`, everything is made anew only once
        session.take_results(course, verification, addresses)
        with contextlib.suppress(RunStoppedError):  # they would have to run anew
            self._find_noise(course, _refuse_runs)

    def _take_start(self, path: str, last_seconds: float | None) -> None:
        self._session.take_start(path, last_seconds)
        if not self._progress.live:  # a terminal shows it in its last line
            last_text = "" if last_seconds is None else f" ({last_seconds:.1f} s the last time)"
            self._progress.say(f"running {path}{last_text}")

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

    def _repeat(self) -> None:
        """Run again, once nothing else is to do, the scripts of which one run does not say enough.

        Raises:
            SupersededError, RunStoppedError: something was saved in the meantime.
        """
        session = self._session

        def is_due(_: object = None) -> bool:
            return session.edits != self._edits or self._failure is not None

        with session.condition:
            course, doubtful_paths = session.runs.course, session.runs.doubtful_paths()
            extractions = () if course is None else extract(course).value
            scripts = [e for e in extractions if e.path in doubtful_paths and not e.script.once]
            if course is None or not scripts or session.code != "run":
                return
            if session.condition.wait_for(is_due, IDLE):
                raise SupersededError
        run_all = functools.partial(self._server.run, is_unwanted=is_due)
        options = replace(self._options.for_course(course), jobs=1, run_all=run_all)
        drifted, recorded = (
            [e for e in scripts if doubtful_paths[e.path] is is_recorded]
            for is_recorded in (False, True)
        )
        run_store, stage = options.run_store(fresh=True), "running scripts again"
        runs = run(course, drifted, options, stage, run_store)
        self._measured |= {extraction.path for extraction in recorded}
        self._find_noise(course, run_all)
        runs += run(course, recorded, options, stage, run_store)
        with session.condition:
            session.runs.take_repeats(runs)
            self._edits = -1  # all that depends on it is made anew

    def _find_noise(self, course: Course, run_all: RunAll) -> None:
        history = self._session.runs
        options = replace(self._options.for_course(course), jobs=1, run_all=run_all)
        runs = [run for run in history.last_results.runs if run.path in self._measured]
        sensitivities = measure_sensitivity(course, options, runs) if runs else ()
        history.noise = tuple(w for s in sensitivities for w in noise_warnings(s))


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
