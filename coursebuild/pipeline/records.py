"""What scripts ran with, and the files beside lessons that keep it (`core.model.lesson_record`)."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import FileChange
from coursebuild.core.model import Course, Document, Recording, find_blocks, output_numbers
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.model.lesson_record import (
    FIGURE,
    LessonRecord,
    Provenance,
    Recorded,
    Versions,
    data_digest,
    describe_comparison,
    figure_heading,
    output_heading,
    record_path,
    recording_digest,
)
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.pages.listings import find_imports
from coursebuild.core.run.packages import distributions
from coursebuild.core.run.script_environment import conditions
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.scripts.figures import ReadFile, compare_figure
from coursebuild.pipeline.options import Options


def with_provenance(
    runs: Mapping[str, ScriptRun],
    scripts: Iterable[Extraction],
    options: Options,
    imports: Mapping[str, frozenset[str]],
) -> dict[str, ScriptRun]:
    """The runs, by path, each with what it ran with here.

    One that was known before has it already, and one that the course keeps ran elsewhere. `imports`
    has the modules that scripts import, as far as they are known.
    """
    texts = {script.path: script.text for script in scripts}
    new_runs = [
        run for run in runs.values() if run.did_run and run.provenance is None and not run.recorded
    ]
    imports_by_path = {
        run.path: imports[run.path] if run.path in imports else find_imports(texts[run.path])
        for run in new_runs
    }
    modules_by_path = {
        run.path: imports_by_path[run.path] if run.trace is None else frozenset(run.trace.modules)
        for run in new_runs
    }
    modules = frozenset[str]().union(*modules_by_path.values())
    interpreter = options.interpreter
    folders = None if interpreter is None else interpreter.packages
    rows = distributions(options.store, modules, folders)
    packages = {module: (name, version) for module, name, version in rows}
    surroundings = dict(conditions({}, interpreter))
    python = surroundings["Python"].removeprefix("C")

    @functools.cache
    def imports_of(path: str) -> frozenset[str]:
        try:
            text = read_bytes(options.root, path).decode("utf-8", "replace")
        except EffectError:
            return frozenset()
        return find_imports(text)

    def provenance(run: ScriptRun) -> Provenance:
        names = {*imports_by_path[run.path]}
        for path in () if run.trace is None else run.trace.files:
            is_of_course = path.endswith(".py") and not path.startswith("mjcourse/")  # our package
            names |= imports_of(path) if is_of_course else frozenset()
        names |= {"mujoco"} if "mjcourse" in names else set()
        all_packages = _versions(packages, modules_by_path[run.path])
        direct = _versions(packages, names & modules_by_path[run.path])
        requirements = tuple(pair for pair in all_packages if pair not in direct)
        return Provenance(python, surroundings["platform"], direct, requirements)

    return {**runs, **{run.path: replace(run, provenance=provenance(run)) for run in new_runs}}


def _versions(packages: Mapping[str, tuple[str, str]], modules: Iterable[str]) -> Versions:
    return tuple(sorted({packages[module] for module in modules if module in packages}))


def record_changes(
    course: Course,
    documents: Iterable[Document],
    runs: Sequence[ScriptRun],
    root: Path,
    read: ReadFile,
) -> Iterator[FileChange]:
    """The changes of records by which they hold what was recorded from these runs.

    The line of a recording that is unchanged stays as it is, whatever a script runs with now. One
    that has no line gets it where a run bears the recording out.
    """
    by_path = {run.path: run for run in runs if run.outcome is Outcome.OK}
    for document in documents:
        before = course.records.get(document.source.path, LessonRecord())
        after = before.with_recordings(_recordings(course, document, by_path, before, read))
        path = record_path(document.source.path)
        old, name = _read(root, path), document.source.path.rpartition("/")[2]
        new = after.text(name).encode() or None
        if after != before and new != old:
            yield FileChange(path, old, new)


def _recordings(
    course: Course,
    document: Document,
    runs: Mapping[str, ScriptRun],
    record: LessonRecord,
    read: ReadFile,
) -> Iterator[tuple[str, Recorded | None]]:
    numbers = output_numbers(document)
    for recording in find_blocks(document, Recording):
        script = recording.script
        if script is None or not recording.readable:
            continue
        digest, run = recording_digest(recording), runs.get(script)
        recorded, comparison = record.find(script, digest), course.comparison_of(recording)
        if recorded is None and run is not None and run.provenance is not None:
            holds = compare(recording, comparison, run.stdout).status != "drift"
            words = describe_comparison(comparison)
            recorded = Recorded(digest, words, run.provenance) if holds else None
        yield output_heading(script, numbers[recording.span.start]), recorded
    for figure in recorded_figures(document):
        data, run = read(figure.path), runs.get(figure.script)
        if data is None:
            continue
        recorded = record.find(figure.script, data_digest(data))
        if recorded is None and run is not None and run.provenance is not None:
            holds = next(compare_figure(figure, run, data, record), None) is None
            recorded = Recorded(data_digest(data), FIGURE, run.provenance) if holds else None
        yield figure_heading(figure.script, figure.name), recorded


def _read(root: Path, path: str) -> bytes | None:
    try:
        return read_bytes(root, path)
    except EffectError:
        return None
