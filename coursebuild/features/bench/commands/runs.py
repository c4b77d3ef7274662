"""What `bench`, `stability` and `diet` find, and reports of it in the course's folder.

Entry points: `MeasuringRun`, which gives a `Measurement`; `CannotError`; `with_records`.
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
from coursebuild.pipeline.progress import Progress

_T = TypeVar("_T")
_A = TypeVar("_A")


class CannotError(Exception):
    """Why a model cannot be measured, or looked at."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


class MeasuringRun:
    """Measures one thing after the other, from what is kept where that is there.

    One run of a course measures at a time, since two would disturb each other's times; the second
    finds what the first has measured.
    """

    stage, done = "measuring", "measured"
    """What is said while things are measured, and of a thing that was."""

    def __init__(
        self, options: Options, diagnostics: Iterable[Diagnostic] = (), *, again: bool = False
    ) -> None:
        self.options = options
        self.again = again
        """Whether nothing is taken from what is kept, nor kept."""
        self.diagnostics = list(diagnostics)
        self.failures: list[ReportFailure] = []
        self.remarks: list[str] = []
        self.progress = Progress(quiet=options.quiet)
        options.store.listen(self.progress.say)

    def each(self, things: Sequence[_A], one: Callable[[_A], _T | None]) -> Measurement[_T]:
        """What there is on each thing."""
        found: list[_T | None] = []
        if things:
            with self.progress.stage(self.stage, len(things)):
                found = [one(thing) for thing in things]
        return Measurement(
            tuple(report for report in found if report is not None),
            sort_diagnostics(self.diagnostics),
            failures=tuple(self.failures),
            remarks=tuple(self.remarks),
        )

    def once(
        self,
        name: str,
        kind: str,
        parts: tuple[object, ...],
        what: type[_T],
        measure: Callable[[], _T | None],
    ) -> _T | None:
        """What is kept of a thing under all that it depends on, or is measured now."""
        found = self.kept(kind, parts, what)
        if found is None:
            with project_lock(self.options.root, self.progress.say, name="bench-lock"):
                found = self.kept(kind, parts, what)  # by whom we waited for, perhaps
                if found is None:
                    self.progress.started(name)
                    began = time.monotonic()
                    try:
                        found = measure()
                    except CannotError as error:
                        self.diagnostics.append(error.diagnostic)
                    verdict = f"not {self.done}" if found is None else self.done
                    self.progress.finished(name, verdict, time.monotonic() - began)
                    if found is not None:
                        self.keep(kind, parts, found)
                    return found
        self.progress.known()
        return found

    def kept(self, kind: str, parts: tuple[object, ...], what: type[_T]) -> _T | None:
        """What was made of these before."""
        return None if self.again else self.options.store.get_value(kind, fingerprint(parts), what)

    def keep(self, kind: str, parts: tuple[object, ...], value: object) -> None:
        """Keep what was made of these."""
        if not self.again:
            self.options.store.put_value(kind, fingerprint(parts), value)


def forbid_quick(option: str, *, quick: bool) -> None:
    """Say that an option is for what was measured in full.

    Raises:
        UsageError: it was not.
    """
    if quick:
        raise UsageError(f"{option} takes no --quick: what is recorded is measured in full")


def with_records(
    root: Path, found: Measurement[_T], records: Iterable[tuple[str, bytes]]
) -> Measurement[_T]:
    """Write reports, by their paths, and say so."""
    said = [_write_record(root, path, data) for path, data in records]
    return replace(
        found,
        failures=tuple(one for one in said if isinstance(one, ReportFailure)),
        remarks=tuple(one for one in said if isinstance(one, str)),
    )


def _write_record(root: Path, path: str, data: bytes) -> str | ReportFailure:
    """Write a report; what was done in words, or why it cannot be done."""
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
