"""Reports as files of the course, `content/reports/…`: written by authors, committed, read again.

Entry points: `bench_path(model)`, `diet_path(model)`, `STABILITY_PATH`; `encode_bench`,
`encode_diet`, `encode_stability`; `decode_bench(data)`, `decode_diet(data)`,
`decode_stability(data)`, which raise `RecordError`.

1. A file says first what it is and which form it has: `{"holds": …, "form": …, …}`.
2. Keys are sorted, and every measured row is a line, so that a difference between two versions of a
   file says what changed. The same report gives the same bytes.
3. Reading is strict: what does not have every field, or has one more, or points at a row that is
   not there, was not written by this tool.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any, TypeVar

import msgspec
from msgspec import Struct

from coursebuild.numerics.reports import Record
from coursebuild.numerics.reports.bench import SceneReport
from coursebuild.numerics.reports.cases import CaseReport
from coursebuild.numerics.reports.diet import DietReport

FOLDER = "content/reports"
STABILITY_PATH = f"{FOLDER}/stability.json"
BENCH, STABILITY = "coursebuild bench", "coursebuild stability"
DIET = "coursebuild diet"
FORM = 1
"""Goes up when files that were written before cannot be read any more."""

_T = TypeVar("_T")


class RecordError(Exception):
    """A file is no report that can be used; `message` says why, without the file's name."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.message = message


class ReportFailure(Struct, frozen=True):
    """Why a recorded report cannot be checked, or written."""

    message: str
    help: str = ""


class _BenchFile(Record, frozen=True):
    """What a file of a model holds."""

    holds: str
    form: int
    scene: SceneReport


class _StabilityFile(Record, frozen=True):
    """What the file of the hard cases holds."""

    holds: str
    form: int
    cases: tuple[CaseReport, ...]


class _DietFile(Record, frozen=True):
    """What the file of a model's diet holds."""

    holds: str
    form: int
    diet: DietReport


def bench_path(model: str) -> str:
    """Where the report on a model is, from the course's folder."""
    return f"{FOLDER}/{model}.bench.json"


def diet_path(model: str) -> str:
    """Where the diet of a model is, from the course's folder."""
    return f"{FOLDER}/{model}.diet.json"


def encode_bench(scene: SceneReport) -> bytes:
    """The file of a model."""
    return _encoded(_BenchFile(BENCH, FORM, scene))


def encode_stability(cases: Sequence[CaseReport]) -> bytes:
    """The file of the hard cases, by name."""
    ordered = tuple(sorted(cases, key=lambda case: (case.case, case.name)))
    return _encoded(_StabilityFile(STABILITY, FORM, ordered))


def encode_diet(diet: DietReport) -> bytes:
    """The file of a model's diet."""
    return _encoded(_DietFile(DIET, FORM, diet))


def decode_diet(data: bytes) -> DietReport:
    """What the file of a model's diet says.

    Raises:
        RecordError: it is none.
    """
    return _decoded(data, DIET, _DietFile).diet


def decode_bench(data: bytes) -> SceneReport:
    """What the file of a model says.

    Raises:
        RecordError: it is none.
    """
    scene = _decoded(data, BENCH, _BenchFile).scene
    names = [scenario.name for scenario in scene.scenarios]
    if len(set(names)) < len(names):
        raise RecordError("holds two scenarios of one name")
    for scenario in scene.scenarios:
        count = len(scenario.rows)
        pointed = [row.dominated_by for row in scenario.rows] + [scenario.verdict.better]
        if not all(0 <= at < count for at in pointed if at is not None):
            raise RecordError(f"points at a row that scenario `{scenario.name}` does not have")
    return scene


def decode_stability(data: bytes) -> tuple[CaseReport, ...]:
    """What the file of the hard cases says.

    Raises:
        RecordError: it is none.
    """
    cases = _decoded(data, STABILITY, _StabilityFile).cases
    if len({case.name for case in cases}) < len(cases):
        raise RecordError("holds two cases of one name")
    return cases


# --- reading


def _decoded(data: bytes, holds: str, kind: type[_T]) -> _T:
    value = _json(data)
    if not isinstance(value, dict) or "holds" not in value:
        raise RecordError(f"holds no report of `{holds}`")
    if value["holds"] != holds:
        shown = json.dumps(value["holds"], ensure_ascii=False)[:40]
        raise RecordError(f"holds a report of {shown}, not of `{holds}`")
    form = value.get("form")
    if not isinstance(form, int) or isinstance(form, bool):
        raise RecordError("does not say which form it has")
    if form != FORM:
        age = "an older" if form < FORM else "a newer"
        raise RecordError(f"was written by {age} version of this tool (form {form}, not {FORM})")
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        text = str(error)
        raise RecordError(f"is damaged: {text[:1].lower()}{text[1:]}") from None


def _json(data: bytes) -> Any:
    try:
        return msgspec.json.decode(data)
    except RecursionError:
        raise RecordError("is damaged: values are nested too deep") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        match = re.search(r"byte (\d+)", str(error))
        if match is None:
            what = str(error).partition(" - at")[0]
            raise RecordError(f"is damaged: {what[:1].lower()}{what[1:]}") from None
        line = data.count(b"\n", 0, int(match[1])) + 1
        raise RecordError(f"is damaged: no JSON at line {line}") from None


# --- writing


def _encoded(file: _BenchFile | _StabilityFile | _DietFile) -> bytes:
    value = msgspec.to_builtins(file, order="sorted")
    return (_text(value, 0, 0) + "\n").encode()


def _text(value: Any, indent: int, lists: int) -> str:
    """A value over several lines; small ones and rows on one."""
    inner = " " * (indent + 1)
    if isinstance(value, dict) and value and not _is_row(value, lists):
        items = [f"{_flat(key)}: {_text(value[key], indent + 1, lists)}" for key in sorted(value)]
    elif isinstance(value, list | tuple) and any(isinstance(one, dict) for one in value):
        items = [_text(one, indent + 1, lists + 1) for one in value]
    else:
        return _flat(value)
    left, right = "{}" if isinstance(value, dict) else "[]"
    return left + "".join(f"\n{inner}{item}," for item in items)[:-1] + f"\n{' ' * indent}{right}"


def _is_row(value: dict[str, Any], lists: int) -> bool:
    """Whether an object is a line of a table."""
    if lists >= 2:
        return True
    return not any(isinstance(one, dict | list | tuple) and one for one in value.values()) and (
        len(_flat(value)) <= 80
    )


def _flat(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False, sort_keys=True)
