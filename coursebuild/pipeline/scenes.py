"""The models of a course that can be measured, and the recorded reports on them.

A scene is a file of `models/` that no other file includes, or one that was named. A model that does
not compile or has wrong declarations is a diagnostic; the other scenes are measured all the same.

Pages may show a report that fits: it is of the model as it is now, with its files and scenarios,
and of the version of MuJoCo that is installed. Any other is left out of the site, with a warning.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from msgspec import Struct
from msgspec.structs import asdict

from coursebuild.core.checks.compiled import (
    INCLUDED_ROOT,
    check_scenarios,
    diagnose_model,
    diagnose_orphan_scenarios,
)
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import CourseFiles, read_bytes, read_course
from coursebuild.core.model import Course, Declarations, Limits, MjcfModel
from coursebuild.core.model.diet_findings import DietReport
from coursebuild.core.model.measurements import CaseReport, EngineReport, SceneReport
from coursebuild.core.model.report_files import (
    BENCH,
    DIET,
    ENGINES,
    STABILITY,
    RecordError,
    ReportFailure,
    ReportKind,
)
from coursebuild.core.model.results import ModelFacts, Reports
from coursebuild.core.model.scenarios import ScenarioTable, exact_file
from coursebuild.core.run.mjcf import compile_all, model_files, readable_error
from coursebuild.core.run.script_environment import engine_version
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.declarations import parse_declarations
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Parsed,
    diagnose,
    did_you_mean,
    sort_diagnostics,
)
from coursebuild.core.text.near import nearest
from coursebuild.core.text.source import Source
from coursebuild.pipeline.options import UsageError

if TYPE_CHECKING:  # a course without reports needs none of it
    _Scene = TypeVar("_Scene", SceneReport, DietReport, EngineReport)


class CourseScene(Struct, frozen=True):
    """A model that can be measured."""

    model: MjcfModel
    declarations: Declarations
    """What the file beside the model declares."""
    facts: ModelFacts
    digest: str
    """A hash of all that its measurements depend on in the course."""

    @property
    def name(self) -> str:
        """The model's file below `models/`, without suffix."""
        return self.model.name


def find_scenes(root: Path, names: tuple[str, ...] = ()) -> Parsed[tuple[CourseScene, ...]]:
    """Find the scenes with these names, or all scenes; sorted by name.

    A name is that of a file below `models/`, with or without its suffix and folder.

    Raises:
        UsageError: no model is called so.
        EffectError: MuJoCo cannot be loaded.
    """
    read = read_course(root)
    models = {model.name: model for model in read.value.models}
    if names:
        selection = _find_models(names, models)
    else:
        sources = {name: model.source for name, model in models.items()}
        parts = {path for s in sources.values() for path in model_files(root, s.path, s.text)}
        selection = [
            models[name]
            for name, source in sources.items()
            if source.path not in parts and not INCLUDED_ROOT.match(source.text)
        ]
    declarations, diagnostics = _read_declarations(read.value, selection, all_models=not names)
    diagnostics += [d for d in read.diagnostics if d.span.path.startswith("models/")]
    scenes: list[CourseScene] = []
    course = None if read.value.map is None else parse_course_map(read.value.map).value
    limits = Limits() if course is None else course.limits
    texts = [(model.source.path, model.source.text) for model in selection]
    results = compile_all(root, texts, limits=limits)
    for model, result in zip(selection, results, strict=True):
        if result.facts is None:
            diagnostics.append(diagnose_model(model, result, readable_error))
            continue
        model_declarations = declarations.get(model.name, Declarations(model.name, model.source))
        if model_declarations is None:
            continue  # its file cannot be read, which has its diagnostic already
        mistakes = list(check_scenarios(model_declarations, result.facts))
        diagnostics += mistakes
        if not mistakes:
            digest = scene_digest(root, model, model_declarations)
            scenes.append(CourseScene(model, model_declarations, result.facts, digest))
    return Parsed(tuple(scenes), sort_diagnostics(diagnostics))


def scene_digest(root: Path, model: MjcfModel, declarations: Declarations) -> str:
    """A hash of a model with the files that it includes, its scenarios and its exact motion.

    It does not depend on the machine, or on declarations that no measurement depends on.
    """
    digest = hashlib.sha256()

    def add(*parts: bytes) -> None:
        for part in parts:
            digest.update(b"%d:" % len(part) + part)

    add(model.source.text.encode("utf-8", "surrogatepass"))
    for path in model_files(root, model.source.path, model.source.text):
        file = root / path
        if file.is_file():
            # A file outside the course has another path on another machine.
            path_text = path if not path.startswith("/") else f"/{file.name}"
            add(path_text.encode("utf-8", "surrogateescape"), _hash_file(file))
    exact = root / exact_file(model.name)
    if exact.is_file():
        add(exact.name.encode("utf-8", "surrogateescape"), _hash_file(exact))
    # A text of all declarations that change a measurement, in whatever order the file has them.
    # Recorded reports hold its digest: with another text for the same, none of them would fit.
    bench = declarations.bench
    parts = [f"Visible(share={bench.visible}, angle={bench.visible_angle})"]
    for s in declarations.scenarios:
        fields = (
            *(s.name, s.title or "", s.keyframe, s.qpos, s.qvel, s.duration),
            *(s.sample, s.controls, s.hold, s.observable),
            *(s.reference, ""),  # reports were recorded when there was another kind of reference
            *(s.conserved, s.timesteps),
            # What was added later counts only where it is given.
            *((name, value) for name in _LATER if (value := getattr(s, name)) != _PLAIN[name]),
        )
        parts.append(repr(fields))
    for sweep in declarations.sweeps:
        vary = [(v.parameter, v.values, v.relative) for v in sweep.variations]
        parts.append(repr((sweep.name, sweep.title or "", sweep.scenario or "", vary, sweep.show)))
    add(f"[{', '.join(parts)}]".encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


def _hash_file(file: Path) -> bytes:
    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").digest()
    except OSError:
        return b"unreadable"


_LATER: tuple[str, ...] = ("stable_for", "search", "expected", "precision")
_LATER += ("horizon_error", "act", "push", "poses", "draw", "draws")
_PLAIN = asdict(ScenarioTable("plain"))


# --- selection


def _find_models(names: Sequence[str], models: dict[str, MjcfModel]) -> list[MjcfModel]:
    chosen_names: set[str] = set()
    for name in names:
        bare = name.removeprefix("./").removeprefix("models/")
        known_name = next((n for n in (name, bare, bare.removesuffix(".xml")) if n in models), None)
        if known_name is None:
            closest = nearest(bare.removesuffix(".xml"), models)
            help = f"did you mean `{closest}`?" if closest is not None else did_you_mean("", models)
            raise UsageError(f"no model is called `{name}`", help=help)
        chosen_names.add(known_name)
    return [models[name] for name in sorted(chosen_names)]


# --- declarations


def _read_declarations(
    files: CourseFiles, models: Sequence[MjcfModel], *, all_models: bool
) -> tuple[dict[str, Declarations | None], list[Diagnostic]]:
    """Read the declarations of the chosen models; `None` for a file that cannot be understood."""
    names = {model.name for model in models}
    declarations: dict[str, Declarations | None] = {}
    diagnostics: list[Diagnostic] = []
    paths = {model.source.path for model in files.models}
    for source in files.declarations:
        name = source.path.removeprefix("models/").removesuffix(".toml")
        if name in names:
            parsed_file = parse_declarations(source)
            declarations[name] = parsed_file.value
            diagnostics += parsed_file.diagnostics
        elif all_models and f"models/{name}.xml" not in {*paths, *files.unreadable}:
            diagnostics.append(diagnose_orphan_scenarios(source, paths))
    return declarations, diagnostics


# --- recorded reports

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
        if model.name not in self._digests:
            declarations = self._declarations.get(
                model.name, Declarations(model.name, model.source)
            )
            self._digests[model.name] = scene_digest(self._root, model, declarations)
        if report.digest != self._digests[model.name]:
            reason = f"`{name}`, its files or its scenarios have changed since"
            self._warn_stale(kind, name, reason)
            return {}
        fits = self._is_of_this_engine(kind, name, {report.machine.engine})
        return {name: report} if fits else {}

    def _read_record(self, kind: ReportKind[_T], model: str = "") -> _T | None:
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
