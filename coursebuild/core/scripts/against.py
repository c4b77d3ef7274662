"""What a script does with another version of MuJoCo, and whether MuJoCo is the cause.

Entry points: `run_standings`, runs compared with what is recorded; `judge_comparability` and
`judge`, the verdict on one script.

MuJoCo is the cause only if nothing else can be: the script prints here what is recorded; so does a
control run in a fresh environment that differs from the other one in nothing but MuJoCo; and two
runs in the other one agree.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild.core.model import Course
from coursebuild.core.model.results import Change, Outcome, ScriptRun, Verdict
from coursebuild.core.scripts.align import same_lines
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.diff import text_diff
from coursebuild.core.scripts.mapped_text import Side

Status: TypeAlias = Literal["same", "changed", "fails", "unclear", "drifted", "uncompared"]
"""`changed` and `fails` are caused by MuJoCo; of `unclear` that cannot be said."""

Judgement: TypeAlias = tuple[Status, str]
"""What became of a script with another version of MuJoCo; why, as a clause, if need be."""


class RunStanding(Struct, frozen=True):
    """A run compared with what is recorded, or else with what the script prints here."""

    run: ScriptRun
    is_compared: bool
    """Whether there was anything to compare it with."""
    changes: tuple[Change, ...] = ()
    diff: str = ""
    """The difference between the outputs, where nothing is recorded."""

    @property
    def holds(self) -> bool:
        """Whether it ran to its end and printed what it should."""
        return self.run.outcome is Outcome.OK and not (self.changes or self.diff)


def run_standings(
    course: Course, current_runs: Mapping[str, ScriptRun], runs: Iterable[ScriptRun]
) -> dict[str, RunStanding]:
    """The standing of each run, by path; `current_runs` are those of this environment."""
    runs = tuple(runs)
    verdicts: dict[str, list[Verdict]] = {}
    for verdict in verify(course, runs):
        verdicts.setdefault(verdict.recording.script or "", []).append(verdict)
    return {
        run.path: _compare_with_recordings(run, verdicts[run.path])
        if run.path in verdicts
        else _compare_with_current(course, current_runs[run.path], run)
        for run in runs
    }


def _compare_with_recordings(run: ScriptRun, verdicts: Iterable[Verdict]) -> RunStanding:
    compared = [verdict for verdict in verdicts if verdict.status != "volatile"]
    return RunStanding(
        run, bool(compared), tuple(c for verdict in compared for c in verdict.changes)
    )


def _compare_with_current(course: Course, current_run: ScriptRun, run: ScriptRun) -> RunStanding:
    current, new = (Side.of(run.stdout, course.filters) for run in (current_run, run))
    is_same = same_lines(current, new, course.comparison)
    return RunStanding(run, True, diff="" if is_same else text_diff(current_run.stdout, run.stdout))


def judge_comparability(standing: RunStanding) -> Judgement | None:
    """Why a script, as it runs here, cannot be compared; `None` where it can."""
    match standing.run.outcome:
        case Outcome.NORUN:
            return "uncompared", "its lesson says `norun`"
        case Outcome.SKIPPED:
            return "uncompared", f"it needs {', '.join(standing.run.missing)}"
        case Outcome.OK if not standing.is_compared:
            return "uncompared", "its output is volatile"
        case Outcome.OK if not standing.holds:
            return "drifted", "what is recorded is not what it prints here"
        case Outcome.OK:
            return None
        case _:
            return "uncompared", "it does not run to its end here"


def judge(
    standing: RunStanding, control: RunStanding | None, repeated: RunStanding, engine: str
) -> Judgement:
    """Judge a script that prints what is recorded here, but not with the other MuJoCo.

    Args:
        standing: its run with the other version of MuJoCo.
        control: with this version, in a fresh environment; `None` where there is none.
        repeated: with the other version once more.
        engine: this version.
    """
    if (standing.run.outcome, standing.run.stdout) != (repeated.run.outcome, repeated.run.stdout):
        return "unclear", "two runs of it there did not do the same"
    if control is None:
        return "unclear", f"no fresh environment with MuJoCo {engine} could be made"
    if not control.holds:
        fresh = f"a fresh environment with MuJoCo {engine}"
        return "unclear", f"it does not do in {fresh} what it does here either"
    return ("changed" if standing.run.outcome is Outcome.OK else "fails"), ""
