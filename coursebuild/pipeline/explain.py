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
    is_there,
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
from coursebuild.report.explained import Explanation, RunExplanation, State


def explain(options: Options, name: str) -> Explanation:
    """What is known of a script, lab, lesson, page, model, or any file of the project.

    Raises:
        UsageError: the course cannot be read, or nothing in it is called so.
    """
    return _Explainer(load_course(options.root), options).explain(name)


class _Explainer:
    """Knows a course and its last results."""

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
        trials = feature_trials(course).items()
        inputs = ((name, kind.inputs(trial), trial) for name, (kind, trial) in trials)
        self.labs = {
            name: (trial_inputs, trial)
            for name, trial_inputs, trial in inputs
            if trial_inputs is not None
        }

    def explain(self, name: str) -> Explanation:
        path = path_from_root(name, self.root)
        for candidate in (name, path):
            explanation = self._find_by_name(candidate)
            if explanation is not None:
                return explanation
        dependents = self._find_dependents(path)
        whole = self._models_with(path)
        if not dependents and not whole and not (self.root / path).exists():
            closest = nearest(name, [*self.scripts, *self.labs, *self.documents, *RULES])
            help = f"did you mean `{closest}`?" if closest is not None else ""
            raise UsageError(f"nothing of this course is called `{name}`", help=help)
        return self._explain_file(path, "file", dependents)

    def _find_by_name(self, name: str) -> Explanation | None:
        if name in self.scripts:
            dependents = self._find_dependents(name)
            explanation = self._explain_script(name)
            return Explanation(
                name, "script", (explanation,), dependents, shown_in=self._documents_using(name)
            )
        if name in self.labs:
            return Explanation(name, "lab", (self._explain_lab(name),))
        part = self.documents.get(name)
        if part is not None:
            scripts = [
                self._explain_script(p)
                for p, (e, _) in self.scripts.items()
                if e.document == part.path
            ]
            labs = [
                self._explain_lab(name)
                for name, (_, trial) in self.labs.items()
                if trial.block.span.path == part.path
            ]
            kind: Literal["lesson", "page"] = "lesson" if isinstance(part, Lesson) else "page"
            return Explanation(part.path, kind, (*scripts, *labs))
        for model in self.course.models:
            path = model.source.path
            if name in (model.name, path):
                return self._explain_file(path, "model", self._find_dependents(path))
        return None

    def _explain_file(
        self, path: str, kind: Literal["model", "file"], dependents: tuple[RunExplanation, ...]
    ) -> Explanation:
        files = self.models.get(path, ())
        whole, documents = self._models_with(path), self._documents_using(path)
        return Explanation(path, kind, (), dependents, files, whole, documents)

    def _models_with(self, path: str) -> tuple[str, ...]:
        return tuple(model for model, files in self.models.items() if path in files)

    # --- scripts and labs

    def _explain_script(self, path: str) -> RunExplanation:
        extraction, job = self.scripts[path]
        if extraction.script.norun:
            return RunExplanation("script", path, extraction.owner, "norun")
        inputs = self.memory.inputs(job, extraction.data)
        record = self.memory.find_record(inputs)
        if record is not None:
            return _describe_run("script", path, extraction.owner, record, ())
        last, reasons = self.memory.last_record(path), self.memory.reasons(inputs)
        return _describe_run("script", path, extraction.owner, last, tuple(reasons))

    def _explain_lab(self, name: str) -> RunExplanation:
        inputs, trial = self.labs[name]
        last = self.memory.last_record(inputs.path)
        holds = last is not None and self._is_lab_remembered(last, inputs)
        reasons = [] if holds else self.memory.reasons(inputs)
        return _describe_run("lab", name, trial.owner, last, tuple(reasons))

    def _is_lab_remembered(self, last: RunRecord, inputs: Inputs) -> bool:
        is_unchanged = not last.reason_forgotten and last.inputs == inputs
        return is_unchanged and not list(state_changes(last.dependencies, self.memory.states))

    def _find_dependents(self, path: str) -> tuple[RunExplanation, ...]:
        """Find scripts and labs whose last results depend on a file or on its folder's listing."""
        dependents = []
        for script in self.scripts:
            if script != path and self._depends(self.memory.last_record(script), path):
                dependents.append(self._explain_script(script))
        for name, (inputs, trial) in self.labs.items():
            models = [f"models/{model}.xml" for model in trial.block.models()]
            if path in models or self._depends(self.memory.last_record(inputs.path), path):
                dependents.append(self._explain_lab(name))
        return tuple(dependents)

    def _depends(self, last: RunRecord | None, path: str) -> bool:
        folder = path.rpartition("/")[0]
        return last is not None and any(
            (d.kind is Kind.FILE and d.name == path)
            or (d.kind is Kind.LISTING and d.name in (path, folder))
            or (d.kind is Kind.SOUGHT and path in sought_files(d.name))
            for d in last.dependencies
        )

    # --- pages

    def _documents_using(self, path: str) -> tuple[str, ...]:
        return tuple(
            document.source.path
            for document in self.course.documents
            if any(True for _ in _uses(document, path))
        )


def _uses(document: Document, path: str) -> Iterator[object]:
    """The parts of a document that show a file, link to it, or quote its output."""
    for block in document_blocks(document):
        if isinstance(block, FeatureBlock) and path in _files_shown_by(block):
            yield block
        for inline in walk_inlines(block_inlines(block)):
            match inline:
                case Image(url=url) if local_file(url, document.source.path) == path:
                    yield inline
                case Link(target=UrlTarget(url=url)) if _leads_to(url, document, path):
                    yield inline
                case Link(target=ModelTarget(name=name)) if f"models/{name}.xml" == path:
                    yield inline
                case Link(target=ExampleTarget(path=example)) if example == path:
                    yield inline
                case NumberBinding(script=script) if script == path:
                    yield inline
                case _:
                    pass


def _files_shown_by(block: FeatureBlock) -> Iterator[str]:
    """The files of models that a block shows or is about, and of reports on the latter."""
    for model in (*block.models(), *block.mentioned_models()):
        yield f"models/{model}.xml"
    yield from map(BENCH.path, block.mentioned_models())


def _leads_to(url: str, document: Document, path: str) -> bool:
    return "://" not in url and local_file(url, document.source.path) == path


def _describe_run(
    kind: Literal["script", "lab"],
    name: str,
    owner: str,
    record: RunRecord | None,
    reasons: tuple[str, ...],
) -> RunExplanation:
    state: State = "would run" if reasons else "remembered"
    if record is None:
        return RunExplanation(kind, name, owner, state, reasons)
    depends = [describe(d) for d in record.dependencies if is_there(d)]
    depends += [f"{subject}: {value}" for subject, value in record.inputs.conditions]
    return RunExplanation(
        kind,
        name,
        owner,
        state,
        reasons,
        tuple(dict.fromkeys(depends)),
        record.timestamp,
        record.stored_run.seconds,
        record.stored_run.outcome.value,
    )
