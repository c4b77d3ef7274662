"""The recorded reports of a course that still fit it, and what is wrong with the others.

Entry point: `shown_reports(root, course)`. Nothing is measured here.

A report fits if it is of the model as it is now, with its files and scenarios, and of the version
of MuJoCo that is installed. Any other is left out of the site, and told.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.model import Course
from coursebuild.core.run.versions import engine_version
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose, nearest
from coursebuild.core.text.source import Source
from coursebuild.numerics.reports import Reports

if TYPE_CHECKING:  # a course without reports needs none of it
    from coursebuild.numerics.reports.bench import SceneReport
    from coursebuild.numerics.reports.cases import CaseReport
    from coursebuild.numerics.reports.diet import DietReport

    _Scene = TypeVar("_Scene", SceneReport, DietReport)

_FOLDER = "content/reports/"
_CASES = f"{_FOLDER}stability.json"
_BENCH, _DIET = ".bench.json", ".diet.json"
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
        from coursebuild.numerics.reports.records import decode_bench, decode_diet, decode_stability

        scenes: dict[str, SceneReport] = {}
        diets: dict[str, DietReport] = {}
        cases: tuple[CaseReport, ...] = ()
        for path in paths:
            name = path.removeprefix(_FOLDER)
            if path == _CASES:
                make = "coursebuild stability --record"
                told = self._decoded(path, decode_stability, make)
                engines = {one.engine for one in told or ()}
                if told is not None and self._is_of_this_engine(path, engines, make):
                    cases = told
            elif name.endswith(_BENCH):
                model = name.removesuffix(_BENCH)
                scene = self._of_model(path, model, "bench", decode_bench)
                if scene is not None:
                    scenes[model] = scene
            elif name.endswith(_DIET):
                model = name.removesuffix(_DIET)
                diet = self._of_model(path, model, "diet", decode_diet)
                if diet is not None:
                    diets[model] = diet
        return Parsed(Reports(scenes, diets, cases), tuple(self._found))

    def _of_model(
        self, path: str, model: str, kind: str, decode: Callable[[bytes], _Scene]
    ) -> _Scene | None:
        """The report on a model, if it fits."""
        from coursebuild.pipeline.reports import command

        make = command(kind, (model,), "--record")
        if model not in self._models:
            near = nearest(model, self._models)
            help = f"is it of `{near}`?" if near is not None else "remove it"
            self._told(path, f"the report {path} belongs to no model", help)
            return None
        report = self._decoded(path, decode, make)
        if report is None:
            return None
        if report.model != model:
            message = f"the report {path} is of the model `{report.model}`"
            self._told(path, message, _again(make))
        elif report.quick:
            message = f"the report {path} was made with --quick, and is not shown"
            self._told(path, message, _again(make))
        elif report.digest != self._digest(model):
            message = (
                f"the report {path} is not shown: `{model}`, its files or its scenarios have "
                "changed since"
            )
            self._told(path, message, _again(make))
        elif self._is_of_this_engine(path, {report.machine.engine}, make):
            return report
        return None

    def _decoded(self, path: str, decode: Callable[[bytes], _T], make: str) -> _T | None:
        from coursebuild.numerics.reports.records import RecordError

        try:
            found: _T = _decoded(decode, read_bytes(self._root, path))
            return found
        except EffectError as error:
            self._told(path, error.message, error.help)
        except RecordError as error:
            self._told(path, f"the report {path} {error.message}", _again(make))
        return None

    def _is_of_this_engine(self, path: str, engines: Iterable[str], make: str) -> bool:
        others = sorted(set(engines) - {self._engine})
        if others:
            message = (
                f"the report {path} is not shown: it is of MuJoCo {', '.join(others)}, and "
                f"{self._engine} is installed"
            )
            self._told(path, message, _again(make))
        return not others

    def _digest(self, name: str) -> str:
        from coursebuild.pipeline.scenes import scene_digest

        if name not in self._digests:
            model, declared = self._models[name], self._declared.get(name)
            self._digests[name] = scene_digest(self._root, model, declared)
        return self._digests[name]

    def _told(self, path: str, message: str, help: str) -> None:
        place = Source(path, "").span(0, 0)
        self._found.append(diagnose("report-stale", place, message, help=help))


@functools.lru_cache(maxsize=32)
def _decoded(decode: Callable[[bytes], _T], data: bytes) -> _T:
    """What a preview reads at each save, and few of them change."""
    return decode(data)


def _again(make: str) -> str:
    return f"make it again with `{make}`"
