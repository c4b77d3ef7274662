"""Who reads a model of the course, and whether their output changes with the model.

Entry points: `readers_of(course, root, files, scene)`; `Reruns`, which runs scripts and labs.

1. Every script of the course that may use the model is a reader; so is every file of code, as
   scripts and labs may use it. A lab draws its model, so it may use all of it, except what code
   asks for by name or number.
2. Scripts and labs run in a copy of the course with the changed files, and their output is compared
   with that in the course itself. The files that they read show which of them use the model.
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
from coursebuild.core.model import Course, FeatureBlock, find_blocks
from coursebuild.core.run.mjcf import model_files
from coursebuild.core.scripts.extract import extract
from coursebuild.features.lab.model import Lab
from coursebuild.numerics.pruning.differences import VIEWS
from coursebuild.numerics.pruning.readers import ModelReader, read_code
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.scenes import CourseScene
from coursebuild.pipeline.verify import verify

_CODE = (".py", ".js", ".mjs", ".ts")
_NOT_DRAWN = frozenset(("Sensor", "Actuator", "Keyframe", "Numeric", "Tuple"))
"""Kinds that the picture of a lab does not show."""
_COPIED_FOLDERS = ("content", "models")


def readers_of(
    course: Course | None, root: Path, files: CourseFiles, scene: CourseScene
) -> tuple[ModelReader, ...]:
    """List everything in the course that may use a model."""
    if course is None:
        return (ModelReader("content/course.toml", opaque="the course cannot be read"),)
    modules = {Path(path).stem for path in files.files if path.endswith(".py")}
    scripts = [
        read_code(script.path, script.text, modules)
        for script in extract(course).value
        if _may_use(script.text, scene.name)
    ]
    blocks = list(_block_readers(course, scene.name))
    if not scripts and not blocks:
        return ()
    return (*scripts, *blocks, *_code_readers(root, files, modules))


def _may_use(text: str, model: str) -> bool:
    """Whether a script names a model, or may compute the name or text of one."""
    name = model.rpartition("/")[2]
    literals = re.findall(r"\bmodel_path\(\s*(?:\"[^\"]*\"|'[^']*')\s*\)", text)
    uses = len(re.findall(r"\bmodel_path\b", re.sub(r"(?m)^.*\bimport\b.*$", "", text)))
    loader = re.search(r"from_(xml|binary)_path|from_file|from_string|\.xml\b", text)
    return name in text or uses != len(literals) or (not literals and loader is not None)


def _block_readers(course: Course, model: str) -> Iterator[ModelReader]:
    """Yield the labs and other blocks that show a model."""
    for document in course.documents:
        for block in find_blocks(document, FeatureBlock):
            if model not in block.models():
                continue
            place = f"{block.span.path}:{block.span.line}"
            kinds = frozenset(VIEWS.values()) - _NOT_DRAWN
            if not isinstance(block, Lab):
                yield ModelReader(place, kinds=kinds)
                continue
            code = read_code(place, "\n".join(piece.text for _, piece in block.code))
            names = frozenset(re.findall(r"\"((?:[^\"\\]|\\.)*)\"", block.config))
            if re.search(r"\"key(frame)?\"\s*:\s*\d", block.config):
                kinds |= {"Keyframe"}
            yield replace(code, names=code.names | names, kinds=code.kinds | kinds)


def _code_readers(root: Path, files: CourseFiles, modules: set[str]) -> Iterator[ModelReader]:
    """Yield the course's files of code."""
    for path in files.files:
        if path.endswith(_CODE):
            try:
                text = read_bytes(root, path).decode("utf-8", "replace")
            except EffectError:
                yield ModelReader(path, opaque="it cannot be read")
            else:
                yield read_code(path, text, modules)


class Reruns:
    """Runs the users of a model, in the course and in copies of it."""

    def __init__(self, options: Options, course: Course, scene: CourseScene) -> None:
        self.options = replace(options, progress=Progress(quiet=True))
        self.course = course
        self.scene = scene
        self._original_outputs: dict[str, object] | None = None
        self._documents: frozenset[str] = frozenset()

    def first_difference(self, files: Mapping[str, bytes]) -> str:
        """Name a user whose output changes with these files; empty if none does."""
        if self._original_outputs is None:
            self._original_outputs = self._run_users()
        original_outputs = self._original_outputs
        if not original_outputs:
            return ""
        with temporary_folder() as folder:
            root = Path(folder).resolve()
            self._copy_course(root)
            for path, data in files.items():
                (root / path).write_bytes(data)
            course = load(root).value
            if course is None:
                return "the course"
            options = replace(self.options, root=root, store=Memo(root))
            outputs = self._run(course, options, self._documents)
        changes = (name for name in original_outputs if outputs.get(name) != original_outputs[name])
        return next(changes, "")

    def _run_users(self) -> dict[str, object]:
        """Run the users of the model in the course, and return their outputs by name."""
        source = self.scene.model.source
        model_paths = {source.path, *model_files(self.options.root, source.path, source.text)}
        results = verify(self.course, self.options).results
        paths = {
            run.path
            for run in results.runs
            if run.trace is not None and not model_paths.isdisjoint(run.trace.files)
        }
        showing_documents = {
            document.source.path
            for document in self.course.documents
            for block in find_blocks(document, FeatureBlock)
            if self.scene.name in block.models()
        }
        labs = [trial for trial in results.trials if trial.span.path in showing_documents]
        self._documents = frozenset(
            script.document for script in extract(self.course).value if script.path in paths
        ) | {trial.span.path for trial in labs}
        if not self._documents:
            return {}
        outputs = self._run(self.course, self.options, self._documents)
        names = paths | {trial.line.name for trial in labs}
        return {name: output for name, output in outputs.items() if name in names}

    def _run(
        self, course: Course, options: Options, documents: frozenset[str]
    ) -> dict[str, object]:
        """Run documents, and return what scripts print and labs record."""
        results = verify(course, options, documents, static=True).results
        outputs: dict[str, object] = {
            run.path: (run.outcome, run.status, run.stdout, run.figures) for run in results.runs
        }
        for trial in results.trials:
            output = trial.output
            record = getattr(output, "record", None), getattr(output, "picture", None)
            outputs[trial.line.name] = (trial.line.status, trial.line.tried, record)
        return outputs

    def _copy_course(self, root: Path) -> None:
        """Copy the course to another folder, and link what no change concerns."""
        for entry in sorted(self.options.root.iterdir()):
            if entry.name in _COPIED_FOLDERS and entry.is_dir():
                shutil.copytree(entry, root / entry.name)
            elif entry.name not in ("examples", "public") and not entry.name.startswith("."):
                (root / entry.name).symlink_to(entry)
