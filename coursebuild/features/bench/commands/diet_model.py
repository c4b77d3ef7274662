"""A model of the course as the diet sees it: its files, who reads it, and what is to be kept.

1. Every script of the course that may use the model is a reader; so is every file of code, as
   scripts and labs may use it. A lab draws its model, so it may use all of it, except what code
   asks for by name or number. Observables that are declared for a model read it too; so do other
   models, and texts in lessons, that include or attach one of its files.
2. Scripts and labs run in a copy of the course with the changed files, and their output is compared
   with that in the course itself. The files that they read show which of them use the model.
3. A file that another model uses too, or that is not in `models/`, is not changed.
4. Changed files are read again, compiled and compared with the model that was run; only then are
   they written, all of them or none.
"""

from __future__ import annotations

import contextlib
import re
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import mujoco
from msgspec.structs import replace

from coursebuild.core.checks.compiled import mjcf_texts
from coursebuild.core.engine.store import Store
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.locks import temporary_folder
from coursebuild.core.files.read import CourseFiles, read_bytes
from coursebuild.core.files.write import FileChange, change_files
from coursebuild.core.model import Course, FeatureBlock, MjcfModel, find_blocks
from coursebuild.core.model.results import Machine
from coursebuild.core.model.scenarios import Declarations
from coursebuild.core.run.mjcf import TEXT_PATH, model_files
from coursebuild.core.scripts.extract import extract
from coursebuild.core.syntax.declarations import parse_declarations
from coursebuild.core.text.diagnostics import diagnose
from coursebuild.core.text.source import Source
from coursebuild.features.bench.commands.measurement import CannotMeasureError
from coursebuild.features.bench.commands.measuring import report_errors
from coursebuild.features.lab.model import Lab
from coursebuild.numerics.pruning.comparison import pruning_scenes
from coursebuild.numerics.pruning.model_text import ModelTextError, model_bytes, open_model
from coursebuild.numerics.pruning.readers import VIEWS, ModelReader, imported_modules, read_code
from coursebuild.numerics.pruning.survey import Rerun, Survey, Surveyor
from coursebuild.numerics.pruning.xml_edits import MarkupError
from coursebuild.pipeline.load import load, package_files
from coursebuild.pipeline.options import Options, Progress
from coursebuild.pipeline.scenes import CourseScene, scene_digest
from coursebuild.pipeline.verify import verify

_CODE = (".py", ".js", ".mjs", ".ts")
_NOT_DRAWN = frozenset(("Sensor", "Actuator", "Keyframe", "Numeric", "Tuple"))
"""Kinds that the picture of a lab does not show."""
_SHAPES = ("alt", "fromto", "scale")
"""Fields of a specification that give places or sizes, and that a model does not have."""
_COPIED_FOLDERS = ("content", "models")


def readers_of(
    course: Course | None, root: Path, files: CourseFiles, model: str
) -> tuple[ModelReader, ...]:
    """List all code in the course that may use a model."""
    if course is None:
        return (ModelReader("content/course.toml", opaque="the course cannot be read"),)
    paths = [path for path in files.files if path.endswith(_CODE)]
    texts: dict[str, str | None] = {}
    for path in (*paths, *package_files(root, course)):
        texts[path] = None  # unless it can be read
        with contextlib.suppress(EffectError):
            texts[path] = read_bytes(root, path).decode("utf-8", "replace")
    texts |= {script.path: script.text for script in extract(course).value}
    modules = {name for path in texts for name in _module_names(path)}
    users = _find_users({path: text or "" for path, text in texts.items()}, model)
    blocks = tuple(_block_readers(course, model))
    if not users and not blocks:
        return ()
    return blocks + tuple(
        ModelReader(path, opaque="it cannot be read")
        if text is None
        else read_code(path, text, modules)
        for path, text in texts.items()
        if path in users or path in files.files
    )


def _module_names(path: str) -> frozenset[str]:
    """The words with which an import of a file of Python may begin."""
    file = Path(path)
    return frozenset((file.stem, *file.parent.parts)) if file.suffix == ".py" else frozenset()


def _find_users(texts: Mapping[str, str], model: str) -> frozenset[str]:
    """Find the Python that may use a model, what imports that, and what all of it imports."""
    names = {path: _module_names(path) for path in texts if path.endswith(".py")}
    imports = {path: frozenset(imported_modules(texts[path])) for path in names}
    users = {path for path in names if _may_use(texts[path], model)}
    for words, targets in ((imports, names), (names, imports)):
        count = -1
        while len(users) > count:
            count, reach = len(users), {name for path in users for name in targets[path]}
            users |= {path for path in names if not words[path].isdisjoint(reach)}
    return frozenset(users)


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
            options = replace(self.options, root=root, store=Store(root))
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
        parts = model_files(root, self.path, scene.model.source.text)
        self.locked = {
            part: f"{part} is not in models/"
            for part in parts
            if not (part.startswith("models/") and part.endswith(".xml"))
        }
        """The files of the model that must not be changed, with the reason."""
        own_files = {self.path, *parts}
        for model in files.models:
            user = model.source.path
            if user not in own_files:
                used_files = model_files(root, user, model.source.text)
                for part in sorted(own_files.intersection(used_files)):
                    self.locked.setdefault(part, f"{user} uses {part} too")
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
        # The kinds of findings about things that scenarios give by number.
        numbered_kinds: set[str] = set()
        for scenario in declarations.scenarios:
            if scenario.controls:
                numbered_kinds.add("actuator-idle")
            if isinstance(scenario.keyframe, int):
                numbered_kinds.add("unused-keyframe")
        failure = "the diet cannot look at the model `{}`"
        with report_errors(scene, failure, ModelTextError, ValueError):
            try:
                text = open_model(self.path, self.read, self.compile)
            except MarkupError as error:
                message = f"{error.path}:{error.line}:{error.column} is not XML: {error.message}"
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
                numbered_kinds=frozenset(numbered_kinds),
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


def _find_readers(
    root: Path, files: CourseFiles, course: Course | None, scene: CourseScene
) -> tuple[ModelReader, ...]:
    """List everything in the course that may read a model, or a file of it in another model."""
    own_files = _included_files(files, scene.model.source)
    readers = [*readers_of(course, root, files, scene.name)]
    readers += _declared_readers(scene.declarations)
    tables = {table.path: table for table in files.declarations}
    for model in files.models:
        source = model.source
        shared = own_files.intersection((source.path, *model_files(root, source.path, source.text)))
        if not shared or source.path == scene.model.source.path:
            continue
        readers += readers_of(course, root, files, model.name)
        if source.path not in own_files:
            readers.append(_reference_reader(files, source, source.path, shared))
        table = tables.get(f"{source.path.removesuffix('.xml')}.toml")
        declarations = None if table is None else parse_declarations(table).value
        if declarations is not None:
            readers += _declared_readers(declarations)
            keys = {scenario.keyframe for scenario in declarations.scenarios} - {None}
            names = frozenset(key for key in keys if isinstance(key, str))
            kinds = frozenset(["Keyframe"] if keys - names else [])
            readers.append(ModelReader(declarations.source.path, names, kinds=kinds))
    for mjcf in () if course is None else mjcf_texts(course):
        if shared := own_files.intersection(model_files(root, TEXT_PATH, mjcf.text)):
            place = f"{mjcf.place.path}:{mjcf.place.line}"
            source = Source(TEXT_PATH, mjcf.text)
            readers.append(_reference_reader(files, source, place, shared))
    return tuple(readers)


_INCLUDED = re.compile(r"<include\s[^>]*?\bfile\s*=\s*[\"']([^\"']+)")
_REFERENCE = re.compile(r"(?<![\w-])(?!name\s*=)\w+\s*=\s*[\"']([^\"']*)[\"']")


def _included_files(files: CourseFiles, source: Source) -> frozenset[str]:
    """A model's file and those that it may include, which are not told apart by their folders."""
    included, texts = {source.path}, [source.text]
    while texts:
        names = {Path(file).name for file in _INCLUDED.findall(texts.pop())}
        for part in (model.source for model in files.models):
            if part.path not in included and Path(part.path).name in names:
                included.add(part.path)
                texts.append(part.text)
    return frozenset(included)


def _reference_reader(
    files: CourseFiles, source: Source, place: str, shared: frozenset[str]
) -> ModelReader:
    """What a model, or a text in a lesson, needs of the files that it shares with another one."""
    attached = shared - _included_files(files, source)  # where names get a prefix
    ranking = sorted(attached, key=lambda path: (Path(path).name not in source.text, path))
    opaque = f"it attaches {ranking[0]}" if ranking else ""
    return ModelReader(place, frozenset(_REFERENCE.findall(source.text)), opaque=opaque)


def _declared_readers(declarations: Declarations) -> list[ModelReader]:
    """What the file beside a model asks of it."""
    scenarios = declarations.scenarios
    names = {s.observable.name for s in scenarios if s.observable is not None}
    fields = {"energy"} if any("energy" in (s.conserved or ()) for s in scenarios) else set()
    kinds: set[str] = set()
    for part in (part for sweep in declarations.sweeps for part in sweep.variations):
        things, _, field = part.parameter.rpartition(".")
        kind, _, name = things.partition(":")
        names |= {name} - {""}
        kinds |= set() if name else {VIEWS.get(kind, kind)}
        field = field.partition("[")[0]
        fields |= {field, "pos"} if field in _SHAPES else {field}
    words = frozenset(fields)
    path = declarations.source.path
    reader = ModelReader(path, frozenset(names), words, words, kinds=frozenset(kinds))
    return [reader] if names or fields else []
