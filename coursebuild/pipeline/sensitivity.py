"""`check --sensitivity`, and what `update` asks of what it records: which digits hold.

Entry point: `measure(course, options, progress, scripts, runs, documents)`.

Of scripts that use MuJoCo and whose output is recorded and as recorded, four runs are made with
their initial states moved (`core.run.initial_state_perturbation`), each with three times the time
limit. `check` has them run a fifth time, with their steps halved (`core.run.half_steps`). All runs
are remembered like others.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from msgspec.structs import replace

from coursebuild.core.model import Course, Recording
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.model.sensitivity import HALVED, RUNS, Sensitivity
from coursebuild.core.run.runner import ScriptServer
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.scripts.sensitivity import is_worth_moving, sensitivity
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.scripts import recorded_outputs, run

_NOT_RUN = (Outcome.NORUN, Outcome.SKIPPED)


def measure(
    course: Course,
    options: Options,
    progress: Progress,
    scripts: Sequence[Extraction],
    runs: Sequence[ScriptRun],
    documents: Collection[str] | None = None,
    *,
    halve: bool = False,
) -> tuple[Sensitivity, ...]:
    """How sensitive the recorded outputs of these scripts are; of those that were run.

    `runs` are theirs, in the same order; `documents` the paths of those whose recorded outputs
    count, all of them without it. `halve`: run them with half the timestep too.
    """
    recordings: dict[str, list[Recording]] = {}
    for recording in recorded_outputs(course, documents):
        assert recording.script is not None
        recordings.setdefault(recording.script, []).append(recording)
    pairs = [
        (script, base)
        for script, base in zip(scripts, runs, strict=True)
        if base.outcome not in _NOT_RUN
    ]
    todo = [
        script
        for script, base in pairs
        if is_worth_moving(course, recordings.get(script.path, ()), base)
    ]
    numbers = (*range(1, RUNS + 1), *((HALVED,) if halve else ()))
    again = _runs(todo, options, progress, numbers)
    return tuple(
        sensitivity(
            course,
            script.path,
            script.owner,
            recordings.get(script.path, ()),
            base,
            again.get(script.path, ())[:RUNS],
            next(iter(again.get(script.path, ())[RUNS:]), None),
        )
        for script, base in pairs
    )


def _runs(
    scripts: Sequence[Extraction], options: Options, progress: Progress, numbers: Sequence[int]
) -> dict[str, list[ScriptRun]]:
    """The runs of each script with moved states or halved steps, by its path."""
    found: dict[str, list[ScriptRun]] = {script.path: [] for script in scripts}
    if not scripts:
        return found
    memory = options.memory()
    with ScriptServer(sandbox=options.sandbox) as server:
        served = replace(options, run_all=server.run)
        for number in numbers:
            halving = number == HALVED
            stage = "halving timesteps" if halving else f"moving initial states, {number} of {RUNS}"
            for one in run(scripts, served, progress, stage, memory, perturbation=number):
                found[one.path].append(one)
    return found
