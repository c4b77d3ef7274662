"""A model of the course as the diet sees it: its files, who reads it, and what is to be kept.

1. Every script of the course that may use the model is a reader; so is every file of code, as
   scripts and labs may use it. A lab draws its model, so it may use all of it, except what code
   asks for by name or number. Observables that are declared for a model read it too; so do other
   models, and texts in lessons, that include or attach one of its files.
2. Scripts and labs run in a copy of the course with the changed files, and their output is compared
   with that in the course itself. The files that they read show which of them use the model.
3. A file that another model uses too, or that is not in `models/`, is not changed.
"""

from __future__ import annotations

import contextlib
import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import (
    Course,
    EffectError,
    FeatureBlock,
    Options,
    Source,
    Store,
    find_blocks,
    regex,
    temporary_folder,
)
from coursebuild.core.checks.compiled import mjcf_texts
from coursebuild.core.files.read import CourseFiles, read_bytes
from coursebuild.core.run.mjcf import TEXT_PATH, model_files
from coursebuild.core.scripts.extract import extract
from coursebuild.core.text.python_code import find_imports
from coursebuild.features.lab.model import Lab
from coursebuild.pipeline.load import load, package_files
from coursebuild.pipeline.options import Progress
from coursebuild.pipeline.scenes import CourseScene
from coursebuild.pipeline.verify import verify

_CODE = (".py", ".js", ".mjs", ".ts")
_COPIED_FOLDERS = ("content", "models")


class ReaderSource(Struct, frozen=True):
    """Something that may read a model, as mjbench is told of it."""

    path: str
    text: str | None = None
    """Code."""
    declarations: str | None = None
    """The text of a file of declarations."""
    names: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    drawn: bool = False
    """Whether it shows a picture of the model."""
    opaque: str = ""
    """Why it may use everything; empty where it does not."""


class ModelReaders(Struct, frozen=True):
    """Everything that may read a model."""

    sources: tuple[ReaderSource, ...] = ()
    modules: frozenset[str] = frozenset()
    """Names of modules that are among them."""


def readers_of(course: Course | None, root: Path, files: CourseFiles, model: str) -> ModelReaders:
    """List all code in the course that may use a model."""
    if course is None:
        opaque = ReaderSource("content/course.toml", opaque="the course cannot be read")
        return ModelReaders((opaque,))
    paths = [path for path in files.files if path.endswith(_CODE)]
    texts: dict[str, str | None] = {}
    for path in (*paths, *package_files(root, course)):
        texts[path] = None  # unless it can be read
        with contextlib.suppress(EffectError):
            texts[path] = read_bytes(root, path).decode("utf-8", "replace")
    texts |= {script.path: script.text for script in extract(course).value}
    modules = frozenset(name for path in texts for name in _module_names(path))
    users = _find_users({path: text or "" for path, text in texts.items()}, model)
    blocks = tuple(_block_readers(course, model))
    if not users and not blocks:
        return ModelReaders((), modules)
    code = tuple(
        ReaderSource(path, text, opaque="it cannot be read" if text is None else "")
        for path, text in texts.items()
        if path in users or path in files.files
    )
    return ModelReaders(blocks + code, modules)


def _module_names(path: str) -> frozenset[str]:
    """The words with which an import of a file of Python may begin."""
    file = Path(path)
    return frozenset((file.stem, *file.parent.parts)) if file.suffix == ".py" else frozenset()


def _find_users(texts: Mapping[str, str], model: str) -> frozenset[str]:
    """Find the Python that may use a model, what imports that, and what all of it imports."""
    names = {path: _module_names(path) for path in texts if path.endswith(".py")}
    imports = {path: find_imports(texts[path]) for path in names}
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


def _block_readers(course: Course, model: str) -> Iterator[ReaderSource]:
    """Yield the labs and other blocks that show a model."""
    for document in course.documents:
        for block in find_blocks(document, FeatureBlock):
            if model not in block.models():
                continue
            reader = ReaderSource(f"{block.span.path}:{block.span.line}", drawn=True)
            if not isinstance(block, Lab):
                yield reader
                continue
            names = re.findall(r"\"((?:[^\"\\]|\\.)*)\"", block.config)
            has_numbers = re.search(r"\"key(frame)?\"\s*:\s*\d", block.config)
            yield replace(
                reader,
                text="\n".join(piece.text for _, piece in block.code),
                names=tuple(names),
                kinds=("Keyframe",) if has_numbers else (),
            )


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
            # Copy the course to another folder, and link what no change concerns
            for entry in sorted(self.options.root.iterdir()):
                if entry.name in _COPIED_FOLDERS and entry.is_dir():
                    shutil.copytree(entry, root / entry.name)
                elif entry.name not in ("examples", "public") and not entry.name.startswith("."):
                    (root / entry.name).symlink_to(entry)
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


class DietModel:
    """A model of the course, its files and its readers."""

    def __init__(
        self, root: Path, files: CourseFiles, course: Course | None, scene: CourseScene
    ) -> None:
        self.scene = scene
        path = scene.model.source.path
        self.keeps = [
            {
                "finding": keep.finding,
                "reason": keep.reason,
                "path": keep.finding_span.path,
                "line": keep.finding_span.line,
                "column": keep.finding_span.column,
            }
            for keep in scene.declarations.keep
        ]
        parts = model_files(root, path, scene.model.source.text)
        self.locked = {
            part: f"{part} is not in models/"
            for part in parts
            if not (part.startswith("models/") and part.endswith(".xml"))
        }
        """The files of the model that must not be changed, with the reason."""
        self.paths = (path, *parts)
        """All files of the model, whether or not they are there."""
        own_files = {*self.paths}
        for model in files.models:
            user = model.source.path
            if user not in own_files:
                used_files = model_files(root, user, model.source.text)
                for part in sorted(own_files.intersection(used_files)):
                    self.locked.setdefault(part, f"{user} uses {part} too")
        self.readers = _find_readers(root, files, course, scene)


def _find_readers(
    root: Path, files: CourseFiles, course: Course | None, scene: CourseScene
) -> ModelReaders:
    """List everything in the course that may read a model, or a file of it in another model."""
    own_files = _included_files(files, scene.model.source)
    own_readers = readers_of(course, root, files, scene.name)
    sources, modules = [*own_readers.sources], own_readers.modules
    tables = {table.path: table for table in files.declarations}
    for model in files.models:
        source = model.source
        shared = own_files.intersection((source.path, *model_files(root, source.path, source.text)))
        if not shared or source.path == scene.model.source.path:
            continue
        model_readers = readers_of(course, root, files, model.name)
        sources += model_readers.sources
        modules |= model_readers.modules
        if source.path not in own_files:
            sources.append(_reference_reader(files, source, source.path, shared))
        table = tables.get(f"{source.path.removesuffix('.xml')}.toml")
        if table is not None:
            sources.append(ReaderSource(table.path, declarations=table.text))
    for mjcf in () if course is None else mjcf_texts(course):
        if shared := own_files.intersection(model_files(root, TEXT_PATH, mjcf.text)):
            place = f"{mjcf.place.path}:{mjcf.place.line}"
            source = Source(TEXT_PATH, mjcf.text)
            sources.append(_reference_reader(files, source, place, shared))
    return ModelReaders(tuple(sources), modules)


_INCLUDED = regex(r"<include\s[^>]*?\bfile\s*=\s*[\"']([^\"']+)")
_REFERENCE = regex(r"(?<![\w-])(?!name\s*=)\w+\s*=\s*[\"']([^\"']*)[\"']")


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
) -> ReaderSource:
    """What a model, or a text in a lesson, needs of the files that it shares with another one."""
    attached = shared - _included_files(files, source)  # where names get a prefix
    ranking = sorted(attached, key=lambda path: (Path(path).name not in source.text, path))
    opaque = f"it attaches {ranking[0]}" if ranking else ""
    return ReaderSource(place, names=tuple(_REFERENCE.findall(source.text)), opaque=opaque)
