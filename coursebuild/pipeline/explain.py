"""`coursebuild explain PATH`: would it run again, why, and what depends on it.

Entry point: `explain(options, name)`. The lessons are read and parsed; nothing is run, compiled or
written, and neither NumPy nor MuJoCo is imported.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from coursebuild.core.model import (
    Course,
    Document,
    ExampleTarget,
    FeatureBlock,
    Image,
    Lesson,
    Link,
    ModelTarget,
    NumberBinding,
    UrlTarget,
    block_inlines,
    document_blocks,
    local_file,
    walk_inlines,
)
from coursebuild.core.registry import feature_trials
from coursebuild.core.run.dependencies import (
    Inputs,
    Kind,
    describe,
    sought_files,
    state_changes,
)
from coursebuild.core.run.mjcf import existing_files
from coursebuild.core.run.run_record import RunRecord
from coursebuild.core.scripts.extract import extract, jobs
from coursebuild.core.text.diagnostics import nearest
from coursebuild.core.text.rules import RULES
from coursebuild.numerics.reports.records import BENCH
from coursebuild.pipeline.load import load_course
from coursebuild.pipeline.options import Options, UsageError, documents_by_name, path_from_root
from coursebuild.report.explained import Explained, Explanation, State


def explain(options: Options, name: str) -> Explanation:
    """What is known of a script, lab, lesson, page, model, or any file of the project.

    Raises:
        UsageError: the course cannot be read, or nothing in it is called so.
    """
    return _Explainer(load_course(options.root), options).of(name)


class _Explainer:
    def __init__(self, course: Course, options: Options) -> None:
        self.course = course
        self.root = options.root
        self.memory = options.for_course(course).memory()
        self.models = {
            model.source.path: existing_files(options.root, model.source.path, model.source.text)
            for model in course.models
        }
        extractions = extract(course).value
        self.documents = documents_by_name(course)
        self.scripts = {
            extraction.path: (extraction, job)
            for extraction, job in zip(extractions, jobs(extractions), strict=True)
        }
        tried = feature_trials(course).items()
        inputs = ((name, kind.inputs(trial), trial) for name, (kind, trial) in tried)
        self.labs = {name: (known, trial) for name, known, trial in inputs if known is not None}

    def of(self, name: str) -> Explanation:
        path = path_from_root(name, self.root)
        for candidate in (name, path):
            found = self._named(candidate)
            if found is not None:
                return found
        dependents = self._dependents(path)
        whole = self._part_of(path)
        if not dependents and not whole and not (self.root / path).exists():
            near = nearest(name, [*self.scripts, *self.labs, *self.documents, *RULES])
            help = f"did you mean `{near}`?" if near is not None else ""
            raise UsageError(f"nothing of this course is called `{name}`", help=help)
        return self._file(path, "file", dependents)

    def _named(self, name: str) -> Explanation | None:
        if name in self.scripts:
            dependents = self._dependents(name)
            own = self._script(name)
            return Explanation(name, "script", (own,), dependents, shown=self._shown(name))
        if name in self.labs:
            return Explanation(name, "lab", (self._lab(name),))
        part = self.documents.get(name)
        if part is not None:
            scripts = [
                self._script(p) for p, (e, _) in self.scripts.items() if e.document == part.path
            ]
            labs = [
                self._lab(name)
                for name, (_, trial) in self.labs.items()
                if trial.block.span.path == part.path
            ]
            kind: Literal["lesson", "page"] = "lesson" if isinstance(part, Lesson) else "page"
            return Explanation(part.path, kind, (*scripts, *labs))
        for model in self.course.models:
            path = model.source.path
            if name in (model.name, path):
                return self._file(path, "model", self._dependents(path))
        return None

    def _file(
        self, path: str, kind: Literal["model", "file"], dependents: tuple[Explained, ...]
    ) -> Explanation:
        files = self.models.get(path, ())
        whole, shown = self._part_of(path), self._shown(path)
        return Explanation(path, kind, (), dependents, files, whole, shown)

    def _part_of(self, path: str) -> tuple[str, ...]:
        return tuple(model for model, files in self.models.items() if path in files)

    # --- scripts and labs

    def _script(self, path: str) -> Explained:
        extraction, job = self.scripts[path]
        if extraction.script.norun:
            return Explained("script", path, extraction.owner, "norun")
        inputs = self.memory.inputs(job, extraction.data)
        record = self.memory.find_record(inputs)
        if record is not None:
            return _explained("script", path, extraction.owner, record, ())
        last, reasons = self.memory.last_record(path), self.memory.reasons(inputs)
        return _explained("script", path, extraction.owner, last, tuple(reasons))

    def _lab(self, name: str) -> Explained:
        inputs, trial = self.labs[name]
        last = self.memory.last_record(inputs.path)
        holds = last is not None and self._lab_holds(last, inputs)
        reasons = [] if holds else self.memory.reasons(inputs)
        return _explained("lab", name, trial.owner, last, tuple(reasons))

    def _lab_holds(self, last: RunRecord, inputs: Inputs) -> bool:
        same = not last.reason_forgotten and last.inputs == inputs
        return same and not list(state_changes(last.dependencies, self.memory.states))

    def _dependents(self, path: str) -> tuple[Explained, ...]:
        """Scripts and labs whose last results depend on a file or on the listing of its folder."""
        found = []
        for script in self.scripts:
            if script != path and self._depends(self.memory.last_record(script), path):
                found.append(self._script(script))
        for name, (inputs, trial) in self.labs.items():
            models = [f"models/{model}.xml" for model in trial.block.models()]
            if path in models or self._depends(self.memory.last_record(inputs.path), path):
                found.append(self._lab(name))
        return tuple(found)

    def _depends(self, last: RunRecord | None, path: str) -> bool:
        folder = path.rpartition("/")[0]
        return last is not None and any(
            (d.kind is Kind.FILE and d.name == path)
            or (d.kind is Kind.LISTING and d.name in (path, folder))
            or (d.kind is Kind.SOUGHT and path in sought_files(d.name))
            for d in last.dependencies
        )

    # --- pages

    def _shown(self, path: str) -> tuple[str, ...]:
        return tuple(
            document.source.path
            for document in self.course.documents
            if any(True for _ in _uses(document, path))
        )


def _uses(document: Document, path: str) -> Iterator[object]:
    """What in a document shows a file, links to it, or quotes its output."""
    for block in document_blocks(document):
        if isinstance(block, FeatureBlock) and path in _shown_of(block):
            yield block
        for inline in walk_inlines(block_inlines(block)):
            match inline:
                case Image(url=url) if local_file(url, document.source.path) == path:
                    yield inline
                case Link(target=UrlTarget(url=url)) if _local(url, document, path):
                    yield inline
                case Link(target=ModelTarget(name=name)) if f"models/{name}.xml" == path:
                    yield inline
                case Link(target=ExampleTarget(path=other)) if other == path:
                    yield inline
                case NumberBinding(script=script) if script == path:
                    yield inline
                case _:
                    pass


def _shown_of(block: FeatureBlock) -> Iterator[str]:
    """The models that a block shows or is about, and recorded reports on the latter."""
    for model in (*block.models(), *block.mentioned_models()):
        yield f"models/{model}.xml"
    yield from map(BENCH.path, block.mentioned_models())


def _local(url: str, document: Document, path: str) -> bool:
    return "://" not in url and local_file(url, document.source.path) == path


def _explained(
    kind: Literal["script", "lab"],
    name: str,
    owner: str,
    record: RunRecord | None,
    reasons: tuple[str, ...],
) -> Explained:
    state: State = "would run" if reasons else "remembered"
    if record is None:
        return Explained(kind, name, owner, state, reasons)
    depends = [describe(dependency) for dependency in record.dependencies]
    depends += [f"{what}: {value}" for what, value in record.inputs.conditions]
    return Explained(
        kind,
        name,
        owner,
        state,
        reasons,
        tuple(depends),
        record.timestamp,
        record.stored_run.seconds,
        record.stored_run.outcome.value,
    )
