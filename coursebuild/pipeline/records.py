"""What scripts ran with, and the files beside lessons that keep it (`core.model.lesson_record`)."""

from __future__ import annotations

import functools
import posixpath
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import FileChange, change_files
from coursebuild.core.model import Course, Document, output_numbers
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.model.lesson_record import (
    FIGURE,
    Addresses,
    LessonRecord,
    Provenance,
    Recorded,
    Versions,
    data_digest,
    describe_comparison,
    record_path,
    recording_digest,
)
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.run.script_environment import InstalledPackages, conditions
from coursebuild.core.scripts.bound_places import document_values
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.scripts.figures import ReadFile, compare_figure
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.text.python_code import find_imports
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.recordings import read_recorded


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
    extractions = {script.path: script for script in scripts}
    new_runs = [
        run for run in runs.values() if run.did_run and run.provenance is None and not run.recorded
    ]
    imports_by_path = {run.path: imports_of(extractions[run.path], imports) for run in new_runs}
    modules_by_path = {
        run.path: imports_by_path[run.path] if run.trace is None else frozenset(run.trace.modules)
        for run in new_runs
    }
    modules = frozenset[str]().union(*modules_by_path.values())
    interpreter = options.interpreter
    folders = None if interpreter is None else interpreter.packages
    rows = InstalledPackages(options.store, folders).distributions(modules)
    packages = {module: (name, version) for module, name, version in rows}
    surroundings = dict(conditions({}, interpreter))
    python = surroundings["Python"].removeprefix("C")

    @functools.cache
    def imports_of_file(path: str) -> frozenset[str]:
        try:
            text = read_bytes(options.root, path).decode("utf-8", "replace")
        except EffectError:
            return frozenset()
        return find_imports(text)

    def provenance(run: ScriptRun) -> Provenance:
        if commands := extractions[run.path].commands:  # of what version they are is not known
            program = posixpath.basename(commands[0][0])
            return Provenance("", surroundings["platform"], ((program, ""),))
        names = {*imports_by_path[run.path]}
        for path in () if run.trace is None else run.trace.files:
            is_of_course = path.endswith(".py") and not path.startswith("mjcourse/")  # our package
            names |= imports_of_file(path) if is_of_course else frozenset()
        names |= {"mujoco"} if "mjcourse" in names else set()
        all_packages = _versions(packages, modules_by_path[run.path])
        direct = _versions(packages, names & modules_by_path[run.path])
        requirements = tuple(pair for pair in all_packages if pair not in direct)
        code = data_digest(extractions[run.path].data)
        return Provenance(python, surroundings["platform"], direct, requirements, code)

    return {**runs, **{run.path: replace(run, provenance=provenance(run)) for run in new_runs}}


def imports_of(script: Extraction, imports: Mapping[str, frozenset[str]]) -> frozenset[str]:
    """The top-level modules that a script imports; `imports` has those of some, by path."""
    if not script.script.is_python:
        return frozenset()
    return imports[script.path] if script.path in imports else find_imports(script.text)


def _versions(packages: Mapping[str, tuple[str, str]], modules: Iterable[str]) -> Versions:
    return tuple(sorted({packages[module] for module in modules if module in packages}))


def write_records(
    course: Course,
    documents: Iterable[Document],
    outputs: PrintedOutputs,
    addresses: Addresses,
    root: Path,
) -> Sequence[FileChange]:
    """Write what `record_changes` finds, beside other commands; return it."""
    read = functools.partial(read_recorded, root)
    changes = [*record_changes(course, documents, outputs, addresses, root, read)]
    if changes:
        change_files(root, changes, beside_commands=True)
    return changes


def record_changes(
    course: Course,
    documents: Iterable[Document],
    outputs: PrintedOutputs,
    addresses: Addresses,
    root: Path,
    read: ReadFile,
) -> Iterator[FileChange]:
    """The changes of records by which they hold what is recorded, and where values were printed.

    The line of a recording that is unchanged stays as it is, whatever a script runs with now. One
    that has no line gets it where a run bears the recording out.
    """
    for document in documents:
        path = document.source.path
        before = course.records.get(path, LessonRecord())
        recordings = tuple(_recordings(document, outputs, before, read))
        values = document_values(document, outputs)
        at = {replace(value, path=""): addresses[value] for value in values if value in addresses}
        after = LessonRecord(recordings, at)
        old, new = read_recorded(root, record_path(path)), after.text.encode() or None
        if after != before and new != old:
            yield FileChange(record_path(path), old, new)


def _recordings(
    document: Document, outputs: PrintedOutputs, record: LessonRecord, read: ReadFile
) -> Iterator[Recorded]:
    numbers = output_numbers(document)
    for verdict in outputs.of_document(document):
        recording, script = verdict.recording, verdict.recording.script or ""
        digest, run = recording_digest(recording), outputs.runs.get(script)
        holds = verdict.status in ("verified", "volatile")
        name = f"{script} output {numbers[recording.span.start]}"
        comparison = describe_comparison(verdict.comparison)
        yield from _recorded(record, script, name, digest, comparison, run if holds else None)
    for figure in recorded_figures(document):
        data, run = read(figure.path), outputs.runs.get(figure.script)
        if data is None:
            continue
        name, digest = f"{figure.script} {figure.name}", data_digest(data)
        entry = record.find(figure.script, digest)
        made_with = None if run is None else run.provenance
        is_known = made_with and entry and entry.provenance.code == made_with.code
        if run is not None and not is_known:
            run = run if next(compare_figure(figure, run, data, record), None) is None else None
        yield from _recorded(record, figure.script, name, digest, FIGURE, run)


def _recorded(
    record: LessonRecord,
    script: str,
    name: str,
    digest: str,
    comparison: str,
    run: ScriptRun | None,
) -> Iterator[Recorded]:
    """How a recording was made: as is known, or else as in the run that bears it out."""
    if (recorded_before := record.find(script, digest)) is not None:
        made_with = recorded_before.provenance
        if run is not None and run.provenance is not None:  # this text gives the same
            made_with = replace(made_with, code=run.provenance.code)
        yield replace(recorded_before, of=name, provenance=made_with)
    elif run is not None and run.outcome is Outcome.OK and run.provenance is not None:
        yield Recorded(name, digest, comparison, run.provenance)
