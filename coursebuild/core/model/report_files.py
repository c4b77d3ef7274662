"""Reports of mjbench as files of a course: their names, their commands, and reading them."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from functools import partial
from typing import Generic, TypeVar

import msgspec
from msgspec import Struct

from coursebuild.core.model.diet_findings import DietReport
from coursebuild.core.model.measurements import CaseReport, EngineReport, SceneReport

FOLDER = "content/reports"
VERSION = 5
"""Of the format that is read here; that of the file stands in it."""

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
    """Of the command that makes it, perhaps with an option."""
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
        command, *options = self.name.split()
        names = [shlex.quote(model)] if model else []
        return " ".join(["coursebuild", command, *names, *options, "--record"])

    def decode(self, data: bytes, model: str = "") -> _T:
        """Read a file; a `RecordError` where it holds no such report, of this model if any."""
        try:
            value = msgspec.json.decode(data)
            head = value if isinstance(value, dict) else {}
            if head.get("holds") != f"mjbench {self.name}":
                raise RecordError(f"holds no report of `coursebuild {self.name}`")
            if (version := head.get("version")) != VERSION:
                text = f"has version {version} of its format, and this tool reads {VERSION}"
                raise RecordError(text)
            report = msgspec.convert(head[self.field], self.type)
        except KeyError:
            raise RecordError(f"is damaged: it has no `{self.field}`") from None
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            text = str(error).replace("JSON is malformed", "no JSON")
            raise RecordError(f"is damaged: {text[:1].lower()}{text[1:]}") from None
        flaw = self.flaw(report, model)
        if flaw:
            raise RecordError(flaw)
        return report


def _model_flaw(kind: str, report: SceneReport | EngineReport | DietReport, model: str) -> str:
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
ENGINES = ReportKind(
    "bench --engines",
    "engines",
    EngineReport,
    ".engines.json",
    partial(_model_flaw, "bench --engines"),
)
DIET = ReportKind("diet", "diet", DietReport, ".diet.json", partial(_model_flaw, "diet"))
STABILITY: ReportKind[tuple[CaseReport, ...]] = ReportKind(
    "stability", "cases", tuple[CaseReport, ...], ".json", _case_flaw
)
