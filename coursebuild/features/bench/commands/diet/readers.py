"""Who reads a model of the course, and whether they say the same with another one.

Entry points: `readers_of(course, root, files, scene)`; `Reruns`, which runs scripts and labs.

1. Every script of the course that may use the model is a reader, wherever it stands; so is every
   file of code, as scripts and labs may use it. A lab draws its model: it may use all of it, but
   for what is asked for by name or number.
2. Scripts and labs run in a copy of the course with the changed files, and their output is compared
   with that in the course itself. Which of them use the model is told by the files that they read.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.engine.memo import Memo
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import CourseFiles, read_bytes
from coursebuild.core.files.temporary import temporary_folder
from coursebuild.core.model import Course, FeatureBlock, document_blocks
from coursebuild.core.run.mjcf import model_files
from coursebuild.core.scripts.extract import extract
from coursebuild.features.lab.model import Lab
from coursebuild.numerics.pruning.differences import VIEWS
from coursebuild.numerics.pruning.readers import Reader, read_code
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.scenes import CourseScene
from coursebuild.pipeline.verify import verify

_CODE = (".py", ".js", ".mjs", ".ts")
_NOT_DRAWN = frozenset(("Sensor", "Actuator", "Keyframe", "Numeric", "Tuple"))
"""Kinds that a lab's picture does not show."""
_COPIED = ("content", "models")


def readers_of(
    course: Course | None, root: Path, files: CourseFiles, scene: CourseScene
) -> tuple[Reader, ...]:
    """Everything in the course that may use a model."""
    if course is None:
        return (Reader("content/course.toml", opaque="the course cannot be read"),)
    own = {Path(path).stem for path in files.files if path.endswith(".py")}
    scripts = [
        read_code(one.path, one.text, own)
        for one in extract(course).value
        if _may_use(one.text, scene.name)
    ]
    labs = list(_blocks(course, scene.name))
    if not scripts and not labs:
        return ()
    return (*scripts, *labs, *_code(root, files, own))


def _may_use(text: str, model: str) -> bool:
    """Whether a script names a model, or makes the names or texts of models while it runs."""
    last = model.rpartition("/")[2]
    literal = re.findall(r"\bmodel_path\(\s*(?:\"[^\"]*\"|'[^']*')\s*\)", text)
    made = len(re.findall(r"\bmodel_path\b", re.sub(r"(?m)^.*\bimport\b.*$", "", text)))
    opened = re.search(r"from_(xml|binary)_path|from_file|from_string|\.xml\b", text)
    return last in text or made != len(literal) or (not literal and opened is not None)


def _blocks(course: Course, model: str) -> Iterator[Reader]:
    """Labs and other blocks that show a model."""
    for document in course.documents:
        for block in document_blocks(document):
            if not isinstance(block, FeatureBlock) or model not in block.models():
                continue
            place = f"{block.span.path}:{block.span.line}"
            drawn = frozenset(VIEWS.values()) - _NOT_DRAWN
            if not isinstance(block, Lab):
                yield Reader(place, kinds=drawn)
                continue
            code = read_code(place, "\n".join(piece.text for _, piece in block.code))
            names = frozenset(re.findall(r"\"((?:[^\"\\]|\\.)*)\"", block.config))
            if re.search(r"\"key(frame)?\"\s*:\s*\d", block.config):
                drawn |= {"Keyframe"}
            yield replace(code, names=code.names | names, kinds=code.kinds | drawn)


def _code(root: Path, files: CourseFiles, own: set[str]) -> Iterator[Reader]:
    """The course's files of code."""
    for path in files.files:
        if path.endswith(_CODE):
            try:
                text = read_bytes(root, path).decode("utf-8", "replace")
            except EffectError:
                yield Reader(path, opaque="it cannot be read")
            else:
                yield read_code(path, text, own)


class Reruns:
    """Runs what uses a model, in the course and in copies of it."""

    def __init__(self, options: Options, course: Course, scene: CourseScene) -> None:
        self.options = replace(options, quiet=True)
        self.course = course
        self.scene = scene
        self._before: dict[str, object] | None = None
        self._documents: frozenset[str] = frozenset()

    def differing(self, files: Mapping[str, bytes]) -> str:
        """Who says something else with these files changed; empty where nobody does."""
        if self._before is None:
            self._before = self._users()
        if not self._before:
            return ""
        with temporary_folder() as folder:
            root = Path(folder).resolve()
            self._copy(root)
            for path, data in files.items():
                (root / path).write_bytes(data)
            course = load(root).value
            if course is None:
                return "the course"
            options = replace(self.options, root=root, cache=Memo(root))
            after = self._outputs(course, options, self._documents)
        return next((name for name, said in self._before.items() if after.get(name) != said), "")

    def _users(self) -> dict[str, object]:
        """What those say in the course that use the model."""
        source = self.scene.model.source
        mine = {source.path, *model_files(self.options.root, source.path, source.text)}
        results = verify(self.course, self.options, Progress(quiet=True)).results
        paths = {
            run.path
            for run in results.runs
            if run.trace is not None and not mine.isdisjoint(run.trace.files)
        }
        shown = {
            document.source.path
            for document in self.course.documents
            for block in document_blocks(document)
            if isinstance(block, FeatureBlock) and self.scene.name in block.models()
        }
        labs = [trial for trial in results.trials if trial.span.path in shown]
        self._documents = frozenset(
            one.document for one in extract(self.course).value if one.path in paths
        ) | {trial.span.path for trial in labs}
        if not self._documents:
            return {}
        whole = self._outputs(self.course, self.options, self._documents)
        names = paths | {trial.line.name for trial in labs}
        return {name: said for name, said in whole.items() if name in names}

    def _outputs(
        self, course: Course, options: Options, documents: frozenset[str]
    ) -> dict[str, object]:
        """What scripts print, and what labs record."""
        results = verify(course, options, Progress(quiet=True), documents, static=True).results
        said: dict[str, object] = {
            run.path: (run.outcome, run.status, run.stdout, run.figures) for run in results.runs
        }
        for trial in results.trials:
            output = trial.output
            record = getattr(output, "record", None), getattr(output, "picture", None)
            said[trial.line.name] = (trial.line.status, trial.line.tried, record)
        return said

    def _copy(self, root: Path) -> None:
        """The course in another place; what cannot be changed is linked."""
        for entry in sorted(self.options.root.iterdir()):
            if entry.name in _COPIED and entry.is_dir():
                shutil.copytree(entry, root / entry.name)
            elif entry.name not in ("examples", "public") and not entry.name.startswith("."):
                (root / entry.name).symlink_to(entry)
