"""What features try of a course, while its scripts run.

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
    """What scripts gave, and what trials gave that went on in a thread meanwhile."""
    groups = groupby(trials, key=itemgetter(0))
    runs = [(kind.start(context), [trial for _, trial in group]) for kind, group in groups]

    def try_all() -> TrialOutcome:
        tried = [run.run(those) for run, those in runs]
        results = tuple(result for found, _ in tried for result in found)
        return results, tuple(wrong for _, found in tried for wrong in found)

    with ThreadPoolExecutor(1, "trials") as thread:
        trying = thread.submit(try_all)
        try:
            ran = scripts()
            with progress.stage("trying labs"):
                return ran, trying.result()
        except BaseException:  # Ctrl-C does not wait for a lab
            for run, _ in runs:
                run.stop()
            raise
