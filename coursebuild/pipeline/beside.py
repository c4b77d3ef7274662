"""Labs tried while scripts run.

Entry point: `run_beside(scripts, trials, progress)`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from msgspec import Struct

from coursebuild.diagnostics import Diagnostic
from coursebuild.model import Course
from coursebuild.pipeline.labs import Engines, try_labs
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.results import CompileResult, LabResult

T = TypeVar("T")


class Trials(Struct, frozen=True):
    """Which labs to try, and how; see `try_labs`."""

    course: Course
    models: Mapping[str, CompileResult]
    options: Options
    documents: frozenset[str] | None
    wrong: tuple[Diagnostic, ...]
    only: frozenset[str] | None
    static: bool

    def run(self, engines: Engines) -> tuple[tuple[LabResult, ...], tuple[Diagnostic, ...]]:
        """Try them."""
        return try_labs(
            self.course,
            self.models,
            self.options,
            engines,
            self.documents,
            self.wrong,
            only=self.only,
            static=self.static,
        )


def run_beside(
    scripts: Callable[[], T], trials: Trials, progress: Progress
) -> tuple[T, tuple[tuple[LabResult, ...], tuple[Diagnostic, ...]]]:
    """What the scripts gave, and what the trials gave in a thread meanwhile."""
    engines = Engines(trials.options.root)
    with ThreadPoolExecutor(1, "labs") as beside:
        trying = beside.submit(trials.run, engines)
        try:
            ran = scripts()
            with progress.stage("trying labs"):
                return ran, trying.result()
        except BaseException:  # Ctrl-C does not wait for a lab
            engines.stop()
            raise
