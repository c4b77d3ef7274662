"""Reports in the course's folder: measured once, committed, and held against what is measured now.

Entry points: `read_record`, `write_record`, `recorded_models`.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import resolve_inside, write_atomic
from coursebuild.numerics.reports.records import FOLDER, RecordError, ReportFailure

_T = TypeVar("_T")
_SUFFIX = ".bench.json"


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


def write_record(root: Path, path: str, data: bytes) -> str | ReportFailure:
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
