"""Reports as files of the course, `content/reports/…`: written by authors, committed, read again.

Entry points: `BENCH`, `DIET` and `STABILITY`, each a `ReportKind` that encodes and decodes its
files; `RecordError`, for files that are no report.

1. A file begins with its kind and the version of its format: `{"holds": …, "form": …, …}`.
2. Keys are sorted, and every measured row is a line, so that a difference between two versions of a
   file says what changed. The same report gives the same bytes.
3. Reading is strict: a file that lacks a field, has one more, or points at a row that is not there
   was not written by this tool.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from functools import partial
from typing import Any, Generic, TypeVar

import msgspec
from msgspec import Struct

from coursebuild.numerics.reports.case_report import CaseReport
from coursebuild.numerics.reports.diet_report import DietReport
from coursebuild.numerics.reports.scene_report import SceneReport

FOLDER = "content/reports"
FORM = 2
"""Goes up when files that were written before cannot be read any more."""

_T = TypeVar("_T")


class RecordError(Exception):
    """Why a file is no report that can be used, without the file's name."""


class ReportFailure(Struct, frozen=True):
    """Why a recorded report cannot be checked, or written."""

    message: str
    help: str = ""


class ReportKind(Struct, Generic[_T], frozen=True):
    """A kind of report that a course keeps."""

    name: str
    """Of the command that makes it."""
    field: str
    """The key of the report in its file."""
    type: type[_T]
    suffix: str
    flaw: Callable[[_T, str], str]
    """What is wrong with a report that has every field, or ""; the second argument is the model
    that it should be about."""

    def path(self, model: str = "") -> str:
        """The file, from the course's folder; of all hard cases there is one."""
        return f"{FOLDER}/{model or self.name}{self.suffix}"

    def command(self, model: str = "") -> str:
        """The command that records the report."""
        names = [shlex.quote(model)] if model else []
        return " ".join(["coursebuild", self.name, *names, "--record"])

    def encode(self, report: _T) -> bytes:
        """The file."""
        value = {"holds": f"coursebuild {self.name}", "form": FORM, self.field: report}
        return (_text(msgspec.to_builtins(value, order="sorted"), 0, 0) + "\n").encode()

    def decode(self, data: bytes, model: str = "") -> _T:
        """Read a file; the report must be about this model, if one is named.

        Raises:
            RecordError: it holds no such report.
        """
        fields = [("holds", str), ("form", int), (self.field, self.type)]
        file = msgspec.defstruct("File", fields, forbid_unknown_fields=True)
        report: _T = getattr(_decode(data, f"coursebuild {self.name}", file), self.field)
        flaw = self.flaw(report, model)
        if flaw:
            raise RecordError(flaw)
        return report


def _model_flaw(kind: str, report: SceneReport | DietReport, model: str) -> str:
    """Why a report is not a complete one of this model; empty where it is, or none is named."""
    if model and report.model != model:
        return f"holds a report of the model `{report.model}`"
    if model and report.quick:
        return f"holds a report of `coursebuild {kind} --quick`, which measures only a part"
    return ""


def _scene_flaw(report: SceneReport, model: str) -> str:
    names = [scenario.name for scenario in report.scenarios]
    if len(set(names)) < len(names):
        return "holds two scenarios of one name"
    for scenario in report.scenarios:
        row_numbers = [row.dominated_by for row in scenario.rows] + [scenario.verdict.better]
        if not all(0 <= at < len(scenario.rows) for at in row_numbers if at is not None):
            return f"points at a row that scenario `{scenario.name}` does not have"
    return _model_flaw("bench", report, model)


def _case_flaw(cases: tuple[CaseReport, ...], _: str) -> str:
    has_duplicates = len({case.name for case in cases}) < len(cases)
    return "holds two cases of one name" if has_duplicates else ""


BENCH = ReportKind("bench", "scene", SceneReport, ".bench.json", _scene_flaw)
DIET = ReportKind("diet", "diet", DietReport, ".diet.json", partial(_model_flaw, "diet"))
STABILITY: ReportKind[tuple[CaseReport, ...]] = ReportKind(
    "stability", "cases", tuple[CaseReport, ...], ".json", _case_flaw
)


def _decode(data: bytes, holds: str, kind: type[_T]) -> _T:
    try:
        value = msgspec.json.decode(data)
        head = value if isinstance(value, dict) else {}
        if head.get("holds") != holds:
            raise RecordError(f"holds no report of `{holds}`")
        if head.get("form") != FORM:
            form = head.get("form")
            raise RecordError(f"was written by another version of this tool (form {form})")
        return msgspec.convert(value, kind)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        text = str(error).replace("JSON is malformed", "no JSON")
        raise RecordError(f"is damaged: {text[:1].lower()}{text[1:]}") from None


def _text(value: Any, indent: int, lists: int) -> str:
    """A value as JSON over several lines; small values and rows take one."""
    inner = " " * (indent + 1)
    if isinstance(value, dict) and value and not _is_row(value, lists):
        items = [f"{_flat(key)}: {_text(value[key], indent + 1, lists)}" for key in sorted(value)]
    elif isinstance(value, list | tuple) and any(isinstance(part, dict) for part in value):
        items = [_text(part, indent + 1, lists + 1) for part in value]
    else:
        return _flat(value)
    left, right = "{}" if isinstance(value, dict) else "[]"
    return left + "".join(f"\n{inner}{item}," for item in items)[:-1] + f"\n{' ' * indent}{right}"


def _is_row(value: dict[str, Any], lists: int) -> bool:
    """Whether an object is a line of a table."""
    if lists >= 2:
        return True
    return not any(isinstance(item, dict | list | tuple) and item for item in value.values()) and (
        len(_flat(value)) <= 80
    )


def _flat(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False, sort_keys=True)
