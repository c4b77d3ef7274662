"""The recorded reports of a course that still fit it, and what is wrong with the others.

Entry points: `shown_reports(root, course)`; `read_record`, one of them. Nothing is measured here.

A report fits if it is of the model as it is now, with its files and scenarios, and of the version
of MuJoCo that is installed. Any other is left out of the site, and told.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.model import Course, Declarations, MjcfModel
from coursebuild.core.run.versions import engine_version
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose, nearest
from coursebuild.core.text.source import Source
from coursebuild.numerics.reports import Reports

if TYPE_CHECKING:  # a course without reports needs none of it
    from coursebuild.numerics.reports.bench import SceneReport
    from coursebuild.numerics.reports.cases import CaseReport
    from coursebuild.numerics.reports.diet import DietReport
    from coursebuild.numerics.reports.records import ReportFailure, ReportKind

    _Scene = TypeVar("_Scene", SceneReport, DietReport)

_FOLDER = "content/reports/"
_T = TypeVar("_T")


def shown_reports(root: Path, course: Course) -> Parsed[Reports]:
    """What pages may show, and a warning for each report that none does."""
    paths = [path for path in course.files if path.startswith(_FOLDER)]
    return _Reader(root, course).read(paths) if paths else Parsed(Reports())


class _Reader:
    def __init__(self, root: Path, course: Course) -> None:
        self._root = root
        self._models = {model.name: model for model in course.models}
        self._declared = {one.model: one for one in course.declarations}
        self._digests: dict[str, str] = {}
        self._engine = engine_version()
        self._found: list[Diagnostic] = []

    def read(self, paths: Iterable[str]) -> Parsed[Reports]:
        from coursebuild.numerics.reports.records import BENCH, DIET, STABILITY

        scenes: dict[str, SceneReport] = {}
        diets: dict[str, DietReport] = {}
        cases: tuple[CaseReport, ...] = ()
        for path in paths:
            name = path.removeprefix(_FOLDER)
            if path == STABILITY.path():
                cases = self._decoded(STABILITY) or ()
                if not self._is_of_this_engine(
                    STABILITY, "", {one.machine.engine for one in cases}
                ):
                    cases = ()
            elif name.endswith(BENCH.suffix):
                scenes |= self._of_model(BENCH, name.removesuffix(BENCH.suffix))
            elif name.endswith(DIET.suffix):
                diets |= self._of_model(DIET, name.removesuffix(DIET.suffix))
        return Parsed(Reports(scenes, diets, cases), tuple(self._found))

    def _of_model(self, kind: ReportKind[_Scene], name: str) -> dict[str, _Scene]:
        """The report on a model by its name, if it fits."""
        path, model = kind.path(name), self._models.get(name)
        if model is None:
            near = nearest(name, self._models)
            help = f"is it of `{near}`?" if near is not None else "remove it"
            self._tell(path, f"the report {path} belongs to no model", help)
            return {}
        report = self._decoded(kind, name)
        if report is None:
            return {}
        if report.digest != self._digest(model):
            why = f"`{name}`, its files or its scenarios have changed since"
            self._leave_out(kind, name, why)
            return {}
        fits = self._is_of_this_engine(kind, name, {report.machine.engine})
        return {name: report} if fits else {}

    def _digest(self, model: MjcfModel) -> str:
        from coursebuild.pipeline.scenes import scene_digest

        if model.name not in self._digests:
            declared = self._declared.get(model.name, Declarations(model.name, model.source))
            self._digests[model.name] = scene_digest(self._root, model, declared)
        return self._digests[model.name]

    def _decoded(self, kind: ReportKind[_T], model: str = "") -> _T | None:
        from coursebuild.numerics.reports.records import ReportFailure

        found = read_record(self._root, kind, model)
        if isinstance(found, ReportFailure):
            self._tell(kind.path(model), found.message, found.help)
            return None
        return found

    def _is_of_this_engine(self, kind: ReportKind[_T], model: str, engines: set[str]) -> bool:
        others = sorted(engines - {self._engine})
        if others:
            why = f"it is of MuJoCo {', '.join(others)}, and {self._engine} is installed"
            self._leave_out(kind, model, why)
        return not others

    def _leave_out(self, kind: ReportKind[_T], model: str, why: str) -> None:
        path, help = kind.path(model), f"make it again with `{kind.command(model)}`"
        self._tell(path, f"the report {path} is not shown: {why}", help)

    def _tell(self, path: str, message: str, help: str) -> None:
        place = Source(path, "").span(0, 0)
        self._found.append(diagnose("report-stale", place, message, help=help))


def read_record(root: Path, kind: ReportKind[_T], model: str = "") -> _T | ReportFailure:
    """The recorded report on a model (or on the hard cases), or why there is none."""
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
    """What a preview reads at each save, and few of them change."""
    return kind.decode(data, model)
