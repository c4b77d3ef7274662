"""What `bench`, `stability` and `diet` find, and reports of it in the course's folder.

Entry points: `MeasuringRun`, `Measurement`; `read_record`, `write_records`, `recorded_models`.
"""

from __future__ import annotations

import hashlib
import shlex
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Generic, TypeVar

from msgspec import Struct

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import resolve_inside, write_atomic
from coursebuild.core.text.diagnostics import Diagnostic, Severity
from coursebuild.numerics.reports.bench import Machine
from coursebuild.numerics.reports.departures import Checked
from coursebuild.numerics.reports.records import FOLDER, RecordError, ReportFailure
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress

_T = TypeVar("_T")
_A = TypeVar("_A")
_SUFFIX = ".bench.json"
_LOCK = "bench-lock"


class Measurement(Struct, Generic[_T], frozen=True):
    """What a run of a command that measures found."""

    reports: tuple[_T, ...]
    """On models by name, on hard cases by number."""
    diagnostics: tuple[Diagnostic, ...] = ()
    """Of models and what is declared for them."""
    checked: tuple[Checked, ...] = ()
    failures: tuple[ReportFailure, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether everything was measured, is as it was recorded, and nothing is to be done."""
        departed = any(one.departures for one in self.checked)
        wrong = any(one.severity is Severity.ERROR for one in self.diagnostics)
        open_ones = any(not getattr(one, "ok", True) for one in self.reports)
        return not (wrong or self.failures or departed or open_ones)


class MeasuringRun:
    """Measures one thing after the other, from what is kept where that is there.

    One run of a course measures at a time, since two would disturb each other's times; the second
    finds what the first has measured.
    """

    done = "measured"
    """What is said of a thing when it is done."""

    def __init__(self, options: Options) -> None:
        self.options = options
        self.diagnostics: list[Diagnostic] = []
        self.progress = Progress(quiet=options.quiet)
        options.store.listen(self.progress.say)

    def each(
        self, stage: str, things: Sequence[_A], one: Callable[[_A], _T | None]
    ) -> tuple[_T, ...]:
        """What there is on each thing."""
        if not things:
            return ()
        with self.progress.stage(stage, len(things)):
            found = [one(thing) for thing in things]
        return tuple(report for report in found if report is not None)

    def one(
        self, name: str, kept: Callable[[], _T | None], measure: Callable[[], _T | None]
    ) -> _T | None:
        """What is kept of a thing, or is measured now."""
        found = kept()
        if found is None:
            with project_lock(self.options.root, self.progress.say, name=_LOCK):
                found = kept()  # by whom we waited for, perhaps
                if found is None:
                    self.progress.started(name)
                    began = time.monotonic()
                    found = measure()
                    verdict = f"not {self.done}" if found is None else self.done
                    self.progress.finished(name, verdict, time.monotonic() - began)
                    return found
        self.progress.known()
        return found


def digest_of(parts: Iterable[str]) -> str:
    """The key under which something is kept that was made of these."""
    text = "\0\0".join(parts)
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()


def machine_parts(here: Machine) -> tuple[str, ...]:
    """All that figures depend on of where they were measured."""
    return here.engine, here.python, here.numpy, here.system, here.cpu


def command(name: str, names: Sequence[str], option: str) -> str:
    """What to type, such as `coursebuild bench arm --record`."""
    return " ".join(["coursebuild", name, *map(shlex.quote, names), option])


def read_record(
    root: Path, path: str, decode: Callable[[bytes], _T], make: str
) -> tuple[_T, None] | tuple[None, ReportFailure]:
    """A recorded report, or why there is none; `make` is the command that makes it."""
    if not (root / path).exists() and not (root / path).is_symlink():
        return None, ReportFailure(f"{path} is not there", f"make it with `{make}`, and commit it")
    try:
        return decode(read_bytes(root, path)), None
    except EffectError as error:
        return None, ReportFailure(error.message, error.help)
    except RecordError as error:
        return None, ReportFailure(f"{path} {error.message}", f"make it again with `{make}`")


def write_records(
    root: Path, records: Iterable[tuple[str, bytes]]
) -> tuple[tuple[ReportFailure, ...], tuple[str, ...]]:
    """Write reports, by their paths; what could not be written, and what was done in words."""
    said = [_write_record(root, path, data) for path, data in records]
    failures = tuple(one for one in said if isinstance(one, ReportFailure))
    return failures, tuple(one for one in said if isinstance(one, str))


def _write_record(root: Path, path: str, data: bytes) -> str | ReportFailure:
    """Write a report; what was done in words, or why it cannot be done."""
    try:
        target = resolve_inside(root, path)
        before = target.read_bytes() if target.exists() else None
        if before == data:
            return f"{path} is as it was"
        target.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(root, path, data, expected=before)
    except EffectError as error:
        return ReportFailure(error.message, error.help)
    except OSError as error:
        return ReportFailure(f"{path} cannot be written: {reason(error)}")
    return f"wrote {path}"


def recorded_models(root: Path) -> frozenset[str]:
    """The names of the models that recorded reports of `bench` are there for."""
    folder = root / FOLDER
    found = folder.rglob(f"*{_SUFFIX}") if folder.is_dir() else iter(())
    names = (path.relative_to(folder).as_posix().removesuffix(_SUFFIX) for path in found)
    return frozenset(name for name in names if not name.startswith("."))
