"""A model of the course as the diet sees it: its files, its readers, and what is to be kept.

Entry point: `DietModel`.

1. `readers` and the observables that are declared for a model say who reads it.
2. A file that another model uses too, or that is not in `models/`, is not changed.
3. Changed files are read again, compiled and compared with the model that was run; only then are
   they written, all of them or none.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import mujoco

from coursebuild.core.files.changes import FileChange, change_files
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import CourseFiles, read_bytes
from coursebuild.core.model import Course, MjcfModel
from coursebuild.core.model.results import Machine
from coursebuild.core.run.mjcf import TEXT_PATH, model_files
from coursebuild.core.text.diagnostics import diagnose
from coursebuild.core.text.source import Source
from coursebuild.features.bench.commands.bench.measuring import report_errors
from coursebuild.features.bench.commands.diet.readers import readers_of
from coursebuild.features.bench.commands.runs import CannotMeasureError
from coursebuild.numerics.pruning.compare import pruning_scenes
from coursebuild.numerics.pruning.markup import MarkupError
from coursebuild.numerics.pruning.model_text import ModelTextError, model_bytes, open_model
from coursebuild.numerics.pruning.readers import ModelReader
from coursebuild.numerics.pruning.survey import Rerun, Survey, Surveyor
from coursebuild.pipeline.scenes import CourseScene, scene_digest

_TEXT = Path(TEXT_PATH).name
"""No file has this name: MuJoCo reads the text in its place."""


class DietModel:
    """A model of the course, its files and its readers."""

    def __init__(
        self, root: Path, files: CourseFiles, course: Course | None, scene: CourseScene
    ) -> None:
        self.root = root
        self.scene = scene
        self.path = scene.model.source.path
        self.keeps = {" ".join(keep.finding.split()): keep for keep in scene.declarations.keep}
        self.locked = _find_locked_files(root, files, self.path, scene.model.source.text)
        self.readers = _find_readers(root, files, course, scene)
        self._files: dict[str, bytes | None] = {}

    def read(self, path: str) -> bytes | None:
        """Return the bytes of a file as first read; `None` if it cannot be read."""
        if path not in self._files:
            try:
                is_file = (self.root / path).is_file()
                self._files[path] = read_bytes(self.root, path) if is_file else None
            except EffectError:
                self._files[path] = None
        return self._files[path]

    def compile(self, text: bytes) -> Any:
        """Compile a text as if it stood in the model's place."""
        place = str((self.root / self.path).parent / _TEXT)
        try:
            return mujoco.MjModel.from_xml_path(place, assets={place: text})
        except (ValueError, mujoco.FatalError) as error:
            message = str(error).replace(f"{self.root}/", "").replace(_TEXT, Path(self.path).name)
            raise ValueError(message) from None

    def survey(
        self, machine: Machine, *, quick: bool, tell: Callable[[str], None], rerun: Rerun | None
    ) -> Survey:
        """Try every change; `rerun` says which of the course's scripts and labs then differ.

        Raises:
            CannotMeasureError: the model cannot be looked at.
        """
        scene, declarations = self.scene, self.scene.declarations
        failure = "the diet cannot look at the model `{}`"
        with report_errors(scene, failure, ModelTextError, ValueError):
            try:
                text = open_model(self.path, self.read, self.compile)
            except MarkupError as error:
                message = f"{error.path}:{error.line}:{error.column} is no XML: {error.message}"
                help = "MuJoCo reads it all the same; other tools do not"
                place = scene.model.source.span(0, 0)
                diagnostic = diagnose("model-error", place, message, help=help)
                raise CannotMeasureError(diagnostic) from None
            return Surveyor(
                model=scene.name,
                digest=scene.digest,
                machine=machine,
                text=text,
                scenes=pruning_scenes(text.model, declarations, quick=quick),
                readers=self.readers,
                keeps=self.keeps,
                locked=self.locked,
                has_commands=any(scenario.controls for scenario in declarations.scenarios),
                clock=time.thread_time_ns,
                quick=quick,
                tell=tell,
                rerun=rerun,
            ).survey()

    def write(self, survey: Survey) -> None:
        """Write the changes that were found; all of them, or none.

        Raises:
            EffectError: a file cannot be written, or somebody changed it.
            CannotMeasureError: the files would make another model than the one that was run.
        """
        new_files = survey.text.files(survey.edits)

        def read(path: str) -> bytes | None:
            return new_files.get(path) or self.read(path)

        new_model = open_model(self.path, read, self.compile, check=False).model
        if model_bytes(new_model) != model_bytes(survey.text.compile(survey.edits)):
            message = f"the changed model `{self.scene.name}` is not the one that was run"
            place = self.scene.model.source.span(0, 0)
            raise CannotMeasureError(diagnose("model-error", place, message))
        changes = [FileChange(path, self.read(path), data) for path, data in new_files.items()]
        change_files(self.root, sorted(changes, key=lambda change: change.path))
        self._files.clear()

    def digest(self) -> str:
        """Return the digest of the model as it is on the disk now."""
        text = (self.read(self.path) or b"").decode("utf-8")
        model = MjcfModel(self.scene.name, Source(self.path, text))
        return scene_digest(self.root, model, self.scene.declarations)


def _find_locked_files(root: Path, files: CourseFiles, path: str, text: str) -> Mapping[str, str]:
    """Map the files of the model that must not be changed to the reason."""
    parts = model_files(root, path, text)
    reasons = {
        part: f"{part} is not in models/"
        for part in parts
        if not (part.startswith("models/") and part.endswith(".xml"))
    }
    own_files = {path, *parts}
    for model in files.models:
        user = model.source.path
        if user not in own_files:
            for part in sorted(own_files.intersection(model_files(root, user, model.source.text))):
                reasons.setdefault(part, f"{user} uses {part} too")
    return reasons


def _find_readers(
    root: Path, files: CourseFiles, course: Course | None, scene: CourseScene
) -> tuple[ModelReader, ...]:
    """List everything in the course that may read a model, its observables included."""
    readers = list(readers_of(course, root, files, scene))
    scenarios = scene.declarations.scenarios
    names = frozenset(s.observable.name for s in scenarios if s.observable is not None)
    fields = {"energy"} if any("energy" in (s.conserved or ()) for s in scenarios) else set()
    if names or fields:
        readers.append(
            ModelReader(scene.declarations.source.path, names=names, words=frozenset(fields))
        )
    return tuple(readers)
