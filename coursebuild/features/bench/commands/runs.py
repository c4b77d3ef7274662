"""How `bench`, `stability` and `diet` measure, and write reports into the course's folder.

Entry points: `MeasuringRun`, which makes a `Measurement`; `CannotMeasureError`; `write_records`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeVar

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.write import resolve_inside, write_atomic
from coursebuild.core.text.diagnostics import Diagnostic, sort_diagnostics
from coursebuild.core.values import fingerprint
from coursebuild.features.bench.commands.measurement import Measurement
from coursebuild.numerics.reports.records import ReportFailure
from coursebuild.pipeline.options import Options, UsageError

_T = TypeVar("_T")
_A = TypeVar("_A")


class CannotMeasureError(Exception):
    """A model cannot be measured, or looked at; the diagnostic says why."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


class MeasuringRun:
    """Measures one thing after the other, or takes the result from the store.

    Only one run of a course measures at a time, since two would disturb each other's times; the
    second finds what the first has measured.
    """

    stage, success = "measuring", "measured"
    """Words of the progress display: for the stage, and for a thing that was measured."""

    def __init__(
        self, options: Options, diagnostics: Iterable[Diagnostic] = (), *, use_store: bool = True
    ) -> None:
        self.options = options
        self.use_store = use_store
        """Whether results are taken from the store, and put into it."""
        self.diagnostics = list(diagnostics)
        self.failures: list[ReportFailure] = []
        self.remarks: list[str] = []
        self.progress = options.progress
        options.store.listen(self.progress.say)

    def measure_each(
        self, things: Sequence[_A], measure: Callable[[_A], _T | None]
    ) -> Measurement[_T]:
        """Measure each thing, and collect the reports."""
        reports: list[_T | None] = []
        if things:
            with self.progress.stage(self.stage, len(things)):
                reports = [measure(thing) for thing in things]
        return Measurement(
            tuple(report for report in reports if report is not None),
            sort_diagnostics(self.diagnostics),
            failures=tuple(self.failures),
            remarks=tuple(self.remarks),
        )

    def load_or_measure(
        self,
        name: str,
        kind: str,
        parts: tuple[object, ...],
        report_type: type[_T],
        measure: Callable[[], _T | None],
    ) -> _T | None:
        """Load the report on a thing by all that it depends on, or measure the thing now."""
        report = self.load(kind, parts, report_type)
        if report is None:
            with project_lock(self.options.root, self.progress.say, name="bench-lock"):
                # The run that held the lock may have measured it.
                report = self.load(kind, parts, report_type)
                if report is None:
                    self.progress.start(name)
                    start = time.monotonic()
                    try:
                        report = measure()
                    except CannotMeasureError as error:
                        self.diagnostics.append(error.diagnostic)
                    verdict = f"not {self.success}" if report is None else self.success
                    self.progress.finish(name, verdict, time.monotonic() - start)
                    if report is not None:
                        self.save(kind, parts, report)
                    return report
        self.progress.skip()
        return report

    def load(self, kind: str, parts: tuple[object, ...], report_type: type[_T]) -> _T | None:
        """Load the stored report that depends on these parts, if there is one."""
        if not self.use_store:
            return None
        return self.options.store.get_value(kind, fingerprint(parts), report_type)

    def save(self, kind: str, parts: tuple[object, ...], value: object) -> None:
        """Store a report under the parts on which it depends."""
        if self.use_store:
            self.options.store.put_value(kind, fingerprint(parts), value)


def forbid_quick(option: str, *, quick: bool) -> None:
    """Forbid `--quick` with an option for full measurements.

    Raises:
        UsageError: `quick` is set.
    """
    if quick:
        raise UsageError(f"{option} takes no --quick: what is recorded is measured in full")


def write_records(
    root: Path, measurement: Measurement[_T], records: Iterable[tuple[str, bytes]]
) -> Measurement[_T]:
    """Write reports, given as (path, bytes), and add what was done to the measurement."""
    outcomes = [_write_record(root, path, data) for path, data in records]
    return replace(
        measurement,
        failures=tuple(outcome for outcome in outcomes if isinstance(outcome, ReportFailure)),
        remarks=tuple(outcome for outcome in outcomes if isinstance(outcome, str)),
    )


def _write_record(root: Path, path: str, data: bytes) -> str | ReportFailure:
    """Write a report, and say what was done, or why it cannot be done."""
    try:
        target = resolve_inside(root, path)
        before = target.read_bytes() if target.exists() else None
        if before == data:
            return f"{path} is as it was"
        write_atomic(root, path, data, expected=before)
    except EffectError as error:
        return ReportFailure(error.message, error.help)
    except OSError as error:
        return ReportFailure(f"{path} cannot be written: {reason(error)}")
    return f"wrote {path}"
