"""The rest of a build, in the background after each save: all that a page need not wait for.

Entry point: `BackgroundRebuild.follow()`, which the main thread runs, so that Ctrl-C ends whatever
is running as it ends any other command.

1. When nothing was saved for a moment, everything is read.
2. Scripts and labs that have no remembered result run, and models are compiled (`verify`). Scripts
   that print something else than is recorded run once more, so that it is known whether their new
   output can be offered.
3. The files of the site are put together: pages that show something else now, fonts, the search.
4. What is wrong now and was not before is printed, and what is wrong no longer.

A save in between begins this anew. A script that runs is ended only where it is another by now.
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
from coursebuild.core.run.runner import OnFinish, OnStart, RunAll, RunStoppedError, ScriptServer
from coursebuild.core.scripts.bindings import BindingEvidence
from coursebuild.core.scripts.extract import extract
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.scripts import run
from coursebuild.pipeline.verify import verify
from coursebuild.preview.messages import report_now
from coursebuild.preview.session import Session, script_keys
from coursebuild.report import Report, Style, diagnostic_text, summary_line
from coursebuild.report.text import location

QUIET = 0.15
"""Seconds without a save after which the work begins."""
LONGEST = 2.0
"""Seconds after which it begins all the same."""
RETRY = 2.0
"""Seconds after which what could not be done is tried again, though nothing was saved."""


class SupersededError(Exception):
    """Something was saved in the meantime."""


class BackgroundRebuild:
    """See the module."""

    def __init__(self, session: Session, progress: Progress, style: Style) -> None:
        self._session = session
        self._options = session.options
        self._progress = progress
        # A terminal also shows which scripts run, in a line that is erased when they have ended.
        self._stages = progress if progress.live else Progress(quiet=True)
        self._seen = -1
        """The session's `edits` when the work began last."""
        self._held: BindingEvidence = {}
        """The lines that proved bound numbers, also before an output was accepted."""
        self._server = ScriptServer()
        self._style = style
        self._told: tuple[Diagnostic, ...] | None = None
        """The mistakes that were printed last."""
        self._failure: BaseException | None = None

    def close(self) -> None:
        """End the process of scripts."""
        self._server.close()

    def fail(self, error: BaseException) -> None:
        """End `follow` by an exception of another thread."""
        with self._session.changed:
            self._failure = error
            self._session.changed.notify_all()

    def follow(self) -> NoReturn:
        """Work as long as the process lives."""
        while True:
            self._wait()
            try:
                with project_lock(self._options.root, self._progress.say):
                    self.once()
            except (SupersededError, RunStoppedError):
                continue
            except EffectError as error:
                text = f"coursebuild: {error.message}" + (f"\n{error.help}" if error.help else "")
                if text != self._session.trouble:
                    print(text, file=sys.stderr, flush=True)
                self._done(text)

    def _wait(self) -> None:
        """Until there is something to do, and nobody is saving."""
        session = self._session
        with session.changed:
            session.changed.wait_for(
                lambda: session.edits != self._seen or self._failure is not None,
                RETRY if session.trouble else None,
            )
            if self._failure is not None:
                raise self._failure
            began = time.monotonic()
            while time.monotonic() < began + LONGEST:
                edits = session.edits
                if not session.changed.wait_for(lambda edits=edits: session.edits != edits, QUIET):  # type: ignore[misc]
                    return

    def once(self) -> None:
        """Do everything once.

        Raises:
            SupersededError, RunStoppedError: something was saved in the meantime.
        """
        session = self._session
        self._seen = session.edits
        session.read()
        with session.changed:
            self._seen = session.edits
        course = session.saved_course()
        if course is not None:
            self._busy("running scripts and labs")
            self._verify(course)
            self._busy("drawing pages")
            session.make_site(self._pause)
        self._done()

    def _busy(self, what: str) -> None:
        self._pause()
        self._session.busy = what
        self._session.tell()

    def _pause(self) -> None:
        """Make room for a save, and begin anew after it."""
        self._session.calm.wait(LONGEST)
        if self._session.edits != self._seen:
            raise SupersededError

    def _done(self, trouble: str = "") -> None:
        """End the work: print what is wrong, if that is news."""
        session = self._session
        with session.changed:
            if session.edits != self._seen and not trouble:
                raise SupersededError
            session.busy = ""
            session.trouble = trouble
            session.tell()
        if not trouble:
            self._tell_changes(report_now(session))

    def _tell_changes(self, report: Report) -> None:
        """Print the mistakes that are new, and those that are gone."""
        now, before = report.diagnostics, self._told
        self._told = now
        new, gone = without(now, before or ()), without(before or (), now)
        for diagnostic in new:
            print(diagnostic_text(diagnostic, self._style) + "\n", file=sys.stderr, flush=True)
        for diagnostic in gone:
            self._progress.say(f"gone: {location(diagnostic.span)}: {diagnostic.message}")
        counts = [f"{len(new)} new"] if new else []
        counts += [f"{len(gone)} gone"] if gone else []
        verdict = summary_line(report).rpartition(": ")[2]
        if now and before is not None:
            verdict = f"{verdict} ({', '.join(counts)})" if counts else f"still {verdict}"
        self._progress.say(f"checked: {verdict}")

    # --- scripts

    def _verify(self, course: Course) -> None:
        session = self._session
        with session.changed:
            everything, session.all_due = session.all_due, False
        known = {} if everything else session.known_runs(course)
        try:
            verified = verify(
                course,
                replace(self._options, run_all=self._run_all(course)),
                self._stages,
                static=True,
                held=self._held,
                known=known,
            )
        except BaseException:
            session.all_due |= everything
            raise
        self._options.store.fresh = False  # what was made anew once holds from now on
        session.take_results(course, verified)
        self._run_again(course, session.drifted(verified.results.runs))

    def _run_all(self, course: Course) -> RunAll:
        """What runs scripts, and shows what each prints as soon as it has ended."""
        session, serve, keys = self._session, self._run_unless_edited(course), script_keys(course)

        def run_all(
            root: Path,
            todo: Sequence[ScriptJob],
            *,
            on_start: OnStart,
            on_finish: OnFinish,
            **where: Any,
        ) -> tuple[ScriptRun, ...]:
            def ended(run: ScriptRun) -> None:
                on_finish(run)
                session.take_run(keys[run.path], run)

            there = functools.partial(serve, root, **where)
            runs = there(todo, on_start=on_start, on_finish=ended)
            # Run again at once: an author who sees a new output can accept it before labs have run.
            drifted = session.drifted(runs)
            left = [job for job in todo if job.path in drifted]
            session.take_second_runs(there(left))
            return runs

        return run_all

    def _run_unless_edited(self, course: Course) -> RunAll:
        """What runs scripts until one of those that run is edited: its output is of no use."""
        session, edits, keys = self._session, self._seen, script_keys(course)

        def unwanted(running: frozenset[str]) -> bool:
            nonlocal edits
            with session.changed:
                if session.edits == edits or session.course is None:
                    return False
                edits = session.edits
                now = script_keys(session.course)
            return any(now.get(path) != keys[path] for path in running)

        return functools.partial(self._server.run, is_unwanted=unwanted)

    def _run_again(self, course: Course, drifted: Collection[str]) -> None:
        """Run those that drifted once more, where what they did was remembered."""
        session, options = self._session, self._options.for_course(course)
        unsure = {path for path in drifted if session.printed_again(path) is None}
        scripts = [script for script in extract(course).value if script.path in unsure]
        if scripts:
            self._busy("running scripts again")
            memory = options.memory(fresh=True)
            served = replace(options, run_all=self._run_unless_edited(course))
            again = run(scripts, served, self._stages, "running scripts again", memory)
            session.take_second_runs(again)


def without(these: Sequence[Diagnostic], others: Sequence[Diagnostic]) -> list[Diagnostic]:
    """Those that are not among the others; that lines have moved makes no difference."""

    def identity(d: Diagnostic) -> tuple[str, ...]:
        return d.rule, d.span.path, d.message, d.label

    left = Counter(map(identity, others))
    found = []
    for diagnostic in these:
        left[identity(diagnostic)] -= 1
        if left[identity(diagnostic)] < 0:
            found.append(diagnostic)
    return found
