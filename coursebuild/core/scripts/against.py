"""What a script does with another version of MuJoCo, and whether that is MuJoCo's doing.

Entry points: `run_standings`, how runs stand to what is recorded; `judgement`, what follows from
four.

A difference is MuJoCo's only if nothing else can be its cause: the script prints here what is
recorded, so does a second run, in a fresh environment that differs from the other one in nothing
but MuJoCo, and in the other one it does twice the same.
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
"""`changed` and `fails` are MuJoCo's doing; of what is `unclear` that cannot be said."""


class RunStanding(Struct, frozen=True):
    """How a run stands to what is recorded; where nothing is, to what the script prints here."""

    run: ScriptRun
    compared: bool
    """Whether there is anything that it could be held against."""
    changes: tuple[Change, ...] = ()
    diff: str = ""
    """Of what is printed, where nothing is recorded."""

    @property
    def holds(self) -> bool:
        """Whether it ran to its end and printed what it should."""
        return self.run.outcome is Outcome.OK and not (self.changes or self.diff)


class Judgement(Struct, frozen=True):
    """What became of a script with another version of MuJoCo."""

    status: Status
    why: str = ""
    """Where that needs to be said, a clause."""


def run_standings(
    course: Course, here: Mapping[str, ScriptRun], runs: Iterable[ScriptRun]
) -> dict[str, RunStanding]:
    """How runs stand, by the path of the script; `here` are those of this environment."""
    runs = tuple(runs)
    verdicts: dict[str, list[Verdict]] = {}
    for verdict in verify(course, runs):
        verdicts.setdefault(verdict.recording.script or "", []).append(verdict)
    return {
        run.path: _of_recordings(run, verdicts[run.path])
        if run.path in verdicts
        else _of_print(course, here[run.path], run)
        for run in runs
    }


def _of_recordings(run: ScriptRun, verdicts: Iterable[Verdict]) -> RunStanding:
    told = [verdict for verdict in verdicts if verdict.status != "volatile"]
    return RunStanding(run, bool(told), tuple(c for verdict in told for c in verdict.changes))


def _of_print(course: Course, here: ScriptRun, run: ScriptRun) -> RunStanding:
    one, two = (Side.of(each.stdout, course.filters) for each in (here, run))
    same = same_lines(one, two, course.comparison)
    return RunStanding(run, True, diff="" if same else text_diff(here.stdout, run.stdout))


def reason_uncompared(here: RunStanding) -> Judgement | None:
    """What keeps a script from being compared; `None` where nothing does."""
    match here.run.outcome:
        case Outcome.NORUN:
            return Judgement("uncompared", "its lesson says `norun`")
        case Outcome.SKIPPED:
            return Judgement("uncompared", f"it needs {', '.join(here.run.missing)}")
        case Outcome.OK:
            pass
        case _:
            return Judgement("uncompared", "it does not run to its end here")
    if not here.compared:
        return Judgement("uncompared", "its output is volatile")
    if not here.holds:
        return Judgement("drifted", "what is recorded is not what it prints here")
    return None


def judgement(
    there: RunStanding, control: RunStanding | None, again: RunStanding, engine: str
) -> Judgement:
    """What follows for a script that prints here what is recorded, and there does not.

    Args:
        there: with the other version of MuJoCo.
        control: with the version of here, in a fresh environment; `None` where there is none.
        again: with the other version once more.
        engine: the version of here.
    """
    if (there.run.outcome, there.run.stdout) != (again.run.outcome, again.run.stdout):
        return Judgement("unclear", "two runs of it there did not do the same")
    if control is None:
        return Judgement("unclear", f"no fresh environment with MuJoCo {engine} could be made")
    if not control.holds:
        fresh = f"a fresh environment with MuJoCo {engine}"
        return Judgement("unclear", f"it does not do in {fresh} what it does here either")
    return Judgement("changed" if there.run.outcome is Outcome.OK else "fails")
