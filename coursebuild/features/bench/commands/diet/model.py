"""A model of the course as the scene diet sees it: its files, who reads it, what is to be kept.

Entry point: `DietModel`.

1. Who reads a model is told by `readers`, and by what is declared to be measured on it.
2. A file that another model uses too, or that is not in `models/`, is not changed.
3. Changed files are read again as such, compiled and compared with what was run; only then are they
   written, all of them or none.
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
from coursebuild.core.run.mjcf import model_files
from coursebuild.core.text.diagnostics import diagnose
from coursebuild.core.text.source import Source
from coursebuild.features.bench.commands.diet.readers import readers_of
from coursebuild.features.bench.commands.runs import CannotError
from coursebuild.numerics.pruning.compare import pruning_scenes
from coursebuild.numerics.pruning.markup import MarkupError
from coursebuild.numerics.pruning.model_text import ModelTextError, model_bytes, open_model
from coursebuild.numerics.pruning.readers import Reader
from coursebuild.numerics.pruning.survey import Order, Rerun, Survey, survey
from coursebuild.numerics.scene import SceneError
from coursebuild.pipeline.scenes import CourseScene, scene_digest

_TEXT = ".coursebuild-text.xml"
"""No file has this name: MuJoCo takes the text in its place."""


class DietModel:
    """A model of the course, its files, and who reads it."""

    def __init__(
        self, root: Path, files: CourseFiles, course: Course | None, scene: CourseScene
    ) -> None:
        self.root = root
        self.scene = scene
        self.path = scene.model.source.path
        self.keeps = {" ".join(one.finding.split()): one for one in scene.declared.keep}
        self.locked = _locked(root, files, self.path, scene.model.source.text)
        self.readers = _readers(root, files, course, scene)
        self._files: dict[str, bytes | None] = {}

    def read(self, path: str) -> bytes | None:
        """The bytes of a file, as they were when it was first looked at."""
        if path not in self._files:
            try:
                there = (self.root / path).is_file()
                self._files[path] = read_bytes(self.root, path) if there else None
            except EffectError:
                self._files[path] = None
        return self._files[path]

    def compile(self, text: bytes) -> Any:
        """A text as if it stood in the model's place."""
        place = str((self.root / self.path).parent / _TEXT)
        try:
            return mujoco.MjModel.from_xml_path(place, assets={place: text})
        except (ValueError, mujoco.FatalError) as error:
            shown = str(error).replace(f"{self.root}/", "").replace(_TEXT, Path(self.path).name)
            raise ValueError(shown) from None

    def survey(
        self, here: Machine, *, quick: bool, tell: Callable[[str], None], rerun: Rerun | None
    ) -> Survey:
        """Try everything; `rerun` says who of the course's scripts and labs differs then.

        Raises:
            CannotError: it cannot be looked at.
        """
        source = self.scene.model.source
        try:
            text = open_model(self.path, self.read, self.compile)
            declared = self.scene.declared
            order = Order(
                self.scene.name,
                self.scene.digest,
                here,
                text,
                pruning_scenes(text.model, declared, quick=quick),
                self.readers,
                self.keeps,
                self.locked,
                any(one.controls for one in declared.scenarios),
                time.thread_time_ns,
                quick,
                tell,
                rerun,
            )
            return survey(order)
        except MarkupError as error:
            said = f"{error.path}:{error.line}:{error.column} is no XML: {error.message}"
            help = "MuJoCo reads it all the same; other tools do not"
            raise CannotError(diagnose("model-error", source.span(0, 0), said, help=help)) from None
        except SceneError as error:
            span = error.span or source.span(0, 0)
            message = error.message
            raise CannotError(diagnose("scenario-model", span, message, help=error.help)) from None
        except (ModelTextError, ValueError, mujoco.FatalError) as error:
            words = " ".join(str(error).split())
            said = f"the diet cannot look at the model `{self.scene.name}`: {words}"
            raise CannotError(diagnose("model-error", source.span(0, 0), said)) from None

    def write(self, survey: Survey) -> None:
        """Make the changes that were found; all of them, or none.

        Raises:
            EffectError: a file cannot be written, or somebody changed it.
            CannotError: the files would make another model than the one that was run.
        """
        changed = survey.text.files(survey.edits)

        def read(path: str) -> bytes | None:
            return changed.get(path) or self.read(path)

        new = open_model(self.path, read, self.compile, check=False).model
        if model_bytes(new) != model_bytes(survey.text.compile(survey.edits)):
            message = f"the changed model `{self.scene.name}` is not the one that was run"
            place = self.scene.model.source.span(0, 0)
            raise CannotError(diagnose("model-error", place, message))
        changes = [FileChange(path, self.read(path), data) for path, data in changed.items()]
        change_files(self.root, sorted(changes, key=lambda one: one.path))
        self._files.clear()

    def digest(self) -> str:
        """Of the model as it lies on the disk now."""
        text = (self.read(self.path) or b"").decode("utf-8")
        model = MjcfModel(self.scene.name, Source(self.path, text))
        return scene_digest(self.root, model, self.scene.declared)


def _locked(root: Path, files: CourseFiles, path: str, text: str) -> Mapping[str, str]:
    """Files of the model that are not to be changed, and why."""
    parts = model_files(root, path, text)
    locked = {
        part: f"{part} is not in models/"
        for part in parts
        if not (part.startswith("models/") and part.endswith(".xml"))
    }
    mine = {path, *parts}
    for other in files.models:
        if other.source.path == path:
            continue
        shared = set(model_files(root, other.source.path, other.source.text)) & mine
        if other.source.path not in mine:
            for part in sorted(shared):
                locked.setdefault(part, f"{other.source.path} uses {part} too")
    return locked


def _readers(
    root: Path, files: CourseFiles, course: Course | None, scene: CourseScene
) -> tuple[Reader, ...]:
    """Everything in the course that may use a model, and what is to be measured on it."""
    found = list(readers_of(course, root, files, scene))
    declared = scene.declared.scenarios
    names = frozenset(one.observable.name for one in declared if one.observable is not None)
    fields = {"energy"} if any("energy" in (one.conserved or ()) for one in declared) else set()
    if names or fields:
        found.append(Reader(scene.declared.source.path, names=names, words=frozenset(fields)))
    return tuple(found)
