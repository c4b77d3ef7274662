"""The recorded reports that pages may show, and warnings about those that no longer fit.

A report fits if it is of the model as it is now, with its files and scenarios, and of the version
of MuJoCo that is installed. Any other is left out of the site, with a warning.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.model import Course, Declarations, MjcfModel
from coursebuild.core.model.results import Reports
from coursebuild.core.run.script_environment import engine_version
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose, nearest
from coursebuild.core.text.source import Source

if TYPE_CHECKING:  # a course without reports needs none of it
    from coursebuild.numerics.reports.case_report import CaseReport
    from coursebuild.numerics.reports.diet_report import DietReport
    from coursebuild.numerics.reports.engine_report import EngineReport
    from coursebuild.numerics.reports.records import ReportFailure, ReportKind
    from coursebuild.numerics.reports.scene_report import SceneReport

    _Scene = TypeVar("_Scene", SceneReport, DietReport, EngineReport)

_FOLDER = "content/reports/"
_T = TypeVar("_T")


def shown_reports(root: Path, course: Course) -> Parsed[Reports]:
    """Read the reports that pages may show; a warning for each that they may not."""
    paths = [path for path in course.files if path.startswith(_FOLDER)]
    return _Collector(root, course).read(paths) if paths else Parsed(Reports())


class _Collector:
    def __init__(self, root: Path, course: Course) -> None:
        self._root = root
        self._models = {model.name: model for model in course.models}
        self._declarations = {d.model: d for d in course.declarations}
        self._digests: dict[str, str] = {}
        self._engine = engine_version()
        self._diagnostics: list[Diagnostic] = []

    def read(self, paths: Iterable[str]) -> Parsed[Reports]:
        from coursebuild.numerics.reports.records import BENCH, DIET, ENGINES, STABILITY

        scenes: dict[str, SceneReport] = {}
        diets: dict[str, DietReport] = {}
        engines: dict[str, EngineReport] = {}
        cases: tuple[CaseReport, ...] = ()
        for path in paths:
            name = path.removeprefix(_FOLDER)
            if path == STABILITY.path():
                cases = self._read_record(STABILITY) or ()
                if not self._is_of_this_engine(
                    STABILITY, "", {case.machine.engine for case in cases}
                ):
                    cases = ()
            elif name.endswith(BENCH.suffix):
                scenes |= self._read_for_model(BENCH, name.removesuffix(BENCH.suffix))
            elif name.endswith(DIET.suffix):
                diets |= self._read_for_model(DIET, name.removesuffix(DIET.suffix))
            elif name.endswith(ENGINES.suffix):
                engines |= self._read_for_model(ENGINES, name.removesuffix(ENGINES.suffix))
        return Parsed(Reports(scenes, diets, cases, engines), tuple(self._diagnostics))

    def _read_for_model(self, kind: ReportKind[_Scene], name: str) -> dict[str, _Scene]:
        path, model = kind.path(name), self._models.get(name)
        if model is None:
            closest = nearest(name, self._models)
            help = f"is it of `{closest}`?" if closest is not None else "remove it"
            self._warn(path, f"the report {path} belongs to no model", help)
            return {}
        report = self._read_record(kind, name)
        if report is None:
            return {}
        if report.digest != self._digest(model):
            reason = f"`{name}`, its files or its scenarios have changed since"
            self._warn_stale(kind, name, reason)
            return {}
        fits = self._is_of_this_engine(kind, name, {report.machine.engine})
        return {name: report} if fits else {}

    def _digest(self, model: MjcfModel) -> str:
        from coursebuild.pipeline.scenes import scene_digest

        if model.name not in self._digests:
            declarations = self._declarations.get(
                model.name, Declarations(model.name, model.source)
            )
            self._digests[model.name] = scene_digest(self._root, model, declarations)
        return self._digests[model.name]

    def _read_record(self, kind: ReportKind[_T], model: str = "") -> _T | None:
        from coursebuild.numerics.reports.records import ReportFailure

        report = read_record(self._root, kind, model)
        if isinstance(report, ReportFailure):
            self._warn(kind.path(model), report.message, report.help)
            return None
        return report

    def _is_of_this_engine(self, kind: ReportKind[_T], model: str, engines: set[str]) -> bool:
        other_engines = sorted(engines - {self._engine})
        if other_engines:
            reason = f"it is of MuJoCo {', '.join(other_engines)}, and {self._engine} is installed"
            self._warn_stale(kind, model, reason)
        return not other_engines

    def _warn_stale(self, kind: ReportKind[_T], model: str, reason: str) -> None:
        path, help = kind.path(model), f"make it again with `{kind.command(model)}`"
        self._warn(path, f"the report {path} is not shown: {reason}", help)

    def _warn(self, path: str, message: str, help: str) -> None:
        place = Source(path, "").span(0, 0)
        self._diagnostics.append(diagnose("report-stale", place, message, help=help))


def read_record(root: Path, kind: ReportKind[_T], model: str = "") -> _T | ReportFailure:
    """Read the recorded report on a model (or on the hard cases), or why there is none."""
    from coursebuild.numerics.reports.records import RecordError, ReportFailure

    path, make = kind.path(model), kind.command(model)
    if not (root / path).exists() and not (root / path).is_symlink():
        return ReportFailure(f"{path} is not there", f"make it with `{make}`, and commit it")
    try:
        report: _T = _decode(kind, read_bytes(root, path), model)
    except EffectError as error:
        return ReportFailure(error.message, error.help)
    except RecordError as error:
        return ReportFailure(f"{path} {error}", f"make it again with `{make}`")
    return report


@functools.lru_cache(maxsize=32)
def _decode(kind: ReportKind[_T], data: bytes, model: str) -> _T:
    """Decode a report; cached, since a preview reads all of them at each save."""
    return kind.decode(data, model)
