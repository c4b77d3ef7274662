"""Runs features' trials of a course, such as those of labs, while its scripts run.

Entry point: `run_with_trials`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import groupby
from operator import itemgetter
from typing import TypeVar

from coursebuild.core.features import Trial, TrialContext, TrialOutcome, Trials
from coursebuild.pipeline.progress import Progress

T = TypeVar("T")


def run_with_trials(
    scripts: Callable[[], T],
    trials: Sequence[tuple[Trials, Trial]],
    context: TrialContext,
    progress: Progress,
) -> tuple[T, TrialOutcome]:
    """Run scripts here and trials in a thread meanwhile; return the results of both."""
    groups = groupby(trials, key=itemgetter(0))
    runs = [(kind.start(context), [trial for _, trial in group]) for kind, group in groups]

    def try_all() -> TrialOutcome:
        outcomes = [run.run(trials_of_kind) for run, trials_of_kind in runs]
        results = tuple(result for results, _ in outcomes for result in results)
        return results, tuple(d for _, diagnostics in outcomes for d in diagnostics)

    with ThreadPoolExecutor(1, "trials") as thread:
        future = thread.submit(try_all)
        try:
            script_runs = scripts()
            with progress.stage("trying labs"):
                return script_runs, future.result()
        except BaseException:  # Ctrl-C does not wait for a lab
            for run, _ in runs:
                run.stop()
            raise
