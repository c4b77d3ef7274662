"""What running a course has shown so far, for a preview.

A script is known by its text and by how it is run: what another text printed is not shown. Callers
hold the session's lock.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

from msgspec.structs import replace

from coursebuild.core.model import Course
from coursebuild.core.model.lesson_record import Addresses
from coursebuild.core.model.results import (
    PublishedTrials,
    Results,
    ScriptJob,
    ScriptRun,
    TrialLine,
)
from coursebuild.core.run.script_environment import engine_version
from coursebuild.core.scripts.compare import verify as compare
from coursebuild.core.scripts.extract import extract, jobs
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.pipeline.verify import Verification
from coursebuild.report import ScriptLine

ScriptKey: TypeAlias = tuple[str, ScriptJob]
"""A script's text, and how it is run."""


class RunHistory:
    """The last run of each script, and what was found when the whole course was run last."""

    def __init__(self) -> None:
        self.course: Course | None = None
        """The course that was run last."""
        self.diagnostics: tuple[Diagnostic, ...] = ()
        self.script_lines: tuple[ScriptLine, ...] = ()
        self.trial_lines: tuple[TrialLine, ...] = ()
        self.is_all_due = True
        """Whether any script may print something new, since other files have changed."""
        self.trials = PublishedTrials()
        self.last_results = Results((), (), (), (), engine_version())
        self._runs: dict[str, tuple[ScriptKey, ScriptRun]] = {}
        """The last run of each script, by path, with the key of the script that ran."""
        self.repeats: dict[str, tuple[ScriptRun, ScriptRun]] = {}
        """Of scripts that ran once more, by path: the run before, and the new one."""
        self.noise: tuple[Diagnostic, ...] = ()
        """Recorded digits that do not hold, of scripts whose initial states were moved."""
        self.addresses: Addresses = {}
        """Where shown values held last, also before an output was accepted; replaced, not changed,
        since a verification begins with them and goes on meanwhile."""
        self.running: dict[str, tuple[float, float | None]] = {}
        """The scripts that run now, by path: when each began, in seconds since 1970, and how long
        it took the last time."""

    def results(self, course: Course) -> Results:
        """What is known of a course's scripts as they are now."""
        keys = script_keys(course)
        runs = tuple(run for path, (key, run) in self._runs.items() if keys.get(path) == key)
        return replace(self.last_results, runs=runs, verdicts=compare(course, runs, self.addresses))

    def take(
        self,
        course: Course,
        verification: Verification,
        trials: PublishedTrials,
        known_addresses: Addresses,
    ) -> None:
        """Take the results of verifying a course, which began with these addresses.

        An output may have been accepted since, with other words: these stay.
        """
        is_accepted_since = self.addresses is not known_addresses
        newer = self.addresses if is_accepted_since else {}
        self.addresses = verification.addresses | newer
        self.course, self.diagnostics = course, verification.diagnostics
        self.script_lines, self.trial_lines = verification.scripts, verification.labs
        self.last_results, self.trials = verification.results, trials
        keys = script_keys(course)
        self._runs = {run.path: (keys[run.path], run) for run in self.last_results.runs}

    def take_run(self, script: ScriptKey, run: ScriptRun) -> None:
        """Take the result of one script, while others run."""
        self._runs[run.path] = script, run
        self.running.pop(run.path, None)

    def known_runs(self, course: Course) -> dict[str, ScriptRun]:
        """The runs of a course's scripts, by path; none where a script has changed since."""
        are_same = script_keys(course) == {p: key for p, (key, _) in self._runs.items()}
        return {path: run for path, (_, run) in self._runs.items()} if are_same else {}

    def take_repeats(self, runs: Iterable[ScriptRun]) -> None:
        """Take the runs of scripts that ran once more, in the place of those before."""
        for run in runs:
            key, before = self._runs[run.path]
            self.repeats[run.path] = before, run
            self._runs[run.path] = key, run

    def other_runs(self) -> dict[str, ScriptRun]:
        """The runs before the last ones, by path, of scripts that ran once more."""
        return {
            path: before
            for path, (before, now) in self.repeats.items()
            if path in self._runs and self._runs[path][1].stdout == now.stdout
        }

    def doubtful_paths(self) -> dict[str, bool]:
        """The scripts of which one run does not say enough, with whether it was recorded."""
        other_runs = self.other_runs()
        return {
            line.path: line.unrepeated
            for line in self.script_lines
            if line.unrepeated or (line.status == "drift" and line.path not in other_runs)
        }


def script_keys(course: Course) -> dict[str, ScriptKey]:
    """The keys of a course's scripts by path: scripts with the same key print the same."""
    scripts = extract(course).value
    return {job.path: (e.text, job) for e, job in zip(scripts, jobs(scripts), strict=True)}
