"""Which printed digits repeat when initial states move: for `check --sensitivity` and `update`.

Entry point: `measure(course, options, runs, documents)`.

Scripts that use MuJoCo and print what is recorded run four times with their initial states moved
(`core.run.perturbation`), each with three times the time limit. `check` runs them a
fifth time, with halved timesteps. All runs are remembered like others.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from msgspec.structs import replace

from coursebuild.core.model import Course, Recording
from coursebuild.core.model.results import ScriptRun
from coursebuild.core.model.sensitivity import HALVED_RUN, RUNS, Sensitivity
from coursebuild.core.run.script_server import ScriptServer
from coursebuild.core.scripts.extract import Extraction, extract
from coursebuild.core.scripts.sensitivity import is_worth_moving, sensitivity
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.scripts import recorded_outputs, run


def measure(
    course: Course,
    options: Options,
    runs: Iterable[ScriptRun],
    documents: Collection[str] | None = None,
    *,
    halve: bool = False,
) -> tuple[Sensitivity, ...]:
    """Measure how sensitive the recorded outputs of those scripts are that were run.

    `documents`: only recorded outputs in documents
    with these paths count. `halve`: run the scripts with half the timestep, too.
    """
    recordings: dict[str, list[Recording]] = {}
    for recording in recorded_outputs(course, documents):
        assert recording.script is not None
        recordings.setdefault(recording.script, []).append(recording)
    bases = {run.path: run for run in runs if run.did_run}
    pairs = [(e, bases[e.path]) for e in extract(course).value if e.path in bases]
    moved_scripts = [
        script
        for script, base in pairs
        if is_worth_moving(course, recordings.get(script.path, ()), base)
    ]
    numbers = (*range(1, RUNS + 1), *((HALVED_RUN,) if halve else ()))
    perturbed_runs = _run_perturbed(moved_scripts, options, numbers)
    return tuple(
        sensitivity(
            course,
            script.path,
            script.owner,
            recordings.get(script.path, ()),
            base,
            perturbed_runs.get(script.path, ())[:RUNS],
            next(iter(perturbed_runs.get(script.path, ())[RUNS:]), None),
        )
        for script, base in pairs
    )


def _run_perturbed(
    scripts: Sequence[Extraction], options: Options, numbers: Sequence[int]
) -> dict[str, list[ScriptRun]]:
    """Run scripts with moved states or halved timesteps; return the runs by path."""
    runs: dict[str, list[ScriptRun]] = {script.path: [] for script in scripts}
    if not scripts:
        return runs
    memory = options.memory()
    with ScriptServer(sandbox=options.sandbox) as server:
        server_options = replace(options, run_all=server.run)
        for number in numbers:
            halving = number == HALVED_RUN
            stage = "halving timesteps" if halving else f"moving initial states, {number} of {RUNS}"
            for script_run in run(scripts, server_options, stage, memory, perturbation=number):
                runs[script_run.path].append(script_run)
    return runs
