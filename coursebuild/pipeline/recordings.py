"""Recorded runs and figures: what scripts gave once, in files of the course.

The fence of a script that takes long says `record=once`. `content/reports/NAME.run.json` holds what
it printed, when and on which machine, with the state of every file of the project that it read. As
long as these files, its text and its options are unchanged, the recorded run counts as if the
script had run now.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import Path

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.drawing.safe_svg import read_svg
from coursebuild.core.engine.store import Store
from coursebuild.core.engine.tool import step_key
from coursebuild.core.files.course_root import read_regular
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import write_atomic
from coursebuild.core.model import Course
from coursebuild.core.model.addresses import RecordedFigure, recorded_figures
from coursebuild.core.model.lesson_record import LessonRecord, shown_versions
from coursebuild.core.model.report_files import FOLDER
from coursebuild.core.model.results import Machine, Outcome, ScriptRun
from coursebuild.core.run.dependencies import (
    Inputs,
    Kind,
    dependencies_of,
    input_changes,
    inputs_of,
    state_changes,
)
from coursebuild.core.run.run_record import RunRecord, record_of
from coursebuild.core.run.run_store import States
from coursebuild.core.run.script_environment import machine
from coursebuild.core.scripts.extract import Extraction, jobs
from coursebuild.core.scripts.figure_data import read_figure_data
from coursebuild.core.scripts.figures import SVG_HELP, figure_difference, prepare_figure
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Source
from coursebuild.pipeline.options import Options


class RecordedRun(Struct, frozen=True):
    """A recorded run, as its file holds it."""

    machine: Machine
    record: RunRecord

    def run(self) -> ScriptRun:
        """Return the run as if it had been made now."""
        date = time.strftime("%Y-%m-%d", time.gmtime(self.record.timestamp))
        host = ", ".join(filter(None, (self.machine.cpu, self.machine.system)))
        run = self.record.restore(())
        versions = shown_versions([run.provenance])
        return replace(run, recorded=", ".join((date, *versions, host)))


def recorded_runs(scripts: Iterable[Extraction], options: Options) -> dict[str, ScriptRun]:
    """Return the recorded runs by path; a script without one counts as not run."""
    if options.long:
        return {}
    once = [extraction for extraction in scripts if extraction.script.once]
    stored_runs = {extraction.path: _read_run(extraction, options) for extraction in once}
    return {
        path: ScriptRun(path, Outcome.NORUN, 0, "", "", 0.0)
        if recorded_run is None
        else recorded_run.run()
        for path, recorded_run in stored_runs.items()
    }


def keep_prepared(store: Store, name: str, data: bytes) -> bytes | str:
    """`prepare_figure`, once for each drawing."""
    key = step_key("figure", name.rpartition(".")[2], data)
    earlier = store.get("figures", key, bytes)
    if earlier is not None:
        return earlier
    prepared = prepare_figure(name, data)
    if isinstance(prepared, bytes):
        store.put("figures", key, prepared)
    return prepared


def check_recorded_runs(scripts: Iterable[Extraction], options: Options) -> Iterator[Diagnostic]:
    """Diagnose scripts that have no recorded run, or one that no longer holds."""
    states = States(options.root, options.store, options.interpreter)
    for extraction in scripts:
        if not extraction.script.once:
            continue
        recorded_run, path = _read_run(extraction, options), extraction.path
        if recorded_run is None:
            message = f"`{path}` is recorded once, but no run of it is kept in {_path(path)}"
        else:
            changes = input_changes(recorded_run.record.inputs, _inputs(extraction))
            changes += state_changes(recorded_run.record.dependencies, states)
            if not changes:
                continue
            message = (
                f"what is recorded of `{path}` is of another state of the course: {changes[0]}"
            )
        fence = extraction.script.span.first_line()
        help = f"run `coursebuild update --long {extraction.owner}`"
        yield diagnose("recorded-run", fence, message, help=help)


def record_runs(scripts: Iterable[Extraction], runs: Sequence[ScriptRun], options: Options) -> None:
    """Record the successful runs of scripts that are recorded once."""
    states = States(options.root, options.store, options.interpreter)
    by_path = {run.path: run for run in runs}
    # Not the same on every machine are files of an environment inside the course's folder, and
    # those of our library, which may be installed elsewhere.
    places = dict(states.places)
    folders = (places["prefix"], f"{places['library']}/mjcourse")
    local_folders = tuple(f"{os.path.relpath(folder, states.root)}/" for folder in folders)
    for extraction in scripts:
        run, path = by_path.get(extraction.path), _path(extraction.path)
        if run is None or not extraction.script.once or run.outcome is not Outcome.OK:
            continue
        dependencies = dependencies_of(run, (), states.places, states)
        portable = tuple(
            dependency
            for dependency in dependencies
            if dependency.kind in (Kind.FILE, Kind.LISTING, Kind.SOUGHT, Kind.EXISTENCE)
            and not dependency.name.startswith(local_folders)
        )
        record = record_of(
            _inputs(extraction),
            portable,
            int(time.time()),
            "",
            replace(run, seconds=round(run.seconds, 1), stderr="", figures=(), unrepeated=False),
        )
        recorded_run = RecordedRun(machine(interpreter=options.interpreter), record)
        before = _read_run(extraction, options)
        if before is not None and replace(before.record, timestamp=0) == replace(
            record, timestamp=0
        ):
            continue
        file = options.root / path
        data = msgspec.json.format(msgspec.json.encode(recorded_run), indent=2) + b"\n"
        expected = read_regular(file) if file.exists() else None
        write_atomic(options.root, path, data, expected=expected)


def _inputs(extraction: Extraction) -> Inputs:
    """The inputs of a script that are the same on every machine."""
    (job,) = jobs([extraction])
    return replace(inputs_of(job, extraction.data, ()), timeout=0.0, version="")


def _path(script: str) -> str:
    name = script.removeprefix("examples/").removesuffix(".py").replace("/", "-")
    return f"{FOLDER}/{name}.run.json"


def _read_run(extraction: Extraction, options: Options) -> RecordedRun | None:
    try:
        data = read_regular(options.root / _path(extraction.path))
        recorded_run = msgspec.json.decode(data, type=RecordedRun)
    except (OSError, msgspec.DecodeError):
        return None
    return recorded_run if recorded_run.record.inputs.path == extraction.path else None


# --- figures and other drawings


def find_figures(course: Course, documents: Collection[str] | None) -> list[RecordedFigure]:
    """The figures of scripts in these documents, or in all."""
    return [
        figure
        for document in course.documents
        if documents is None or document.source.path in documents
        for figure in recorded_figures(document)
    ]


def read_recorded(root: Path, path: str) -> bytes | None:
    """A file of the course; `None` where there is none."""
    try:
        return read_bytes(root, path)
    except EffectError:
        return None


def write_figures(
    course: Course,
    documents: Collection[str] | None,
    runs: Sequence[ScriptRun],
    options: Options,
    *,
    dry_run: bool,
) -> tuple[list[str], list[Diagnostic]]:
    """Write the drawings that differ from the recorded ones; a remark for each, and failures."""
    by_path = {run.path: run for run in runs if run.outcome is Outcome.OK}
    remarks: list[str] = []
    failures: list[Diagnostic] = []
    for figure in find_figures(course, documents):
        run = by_path.get(figure.script)
        data = dict(run.figures).get(figure.name) if run is not None else None
        drawing = prepare_figure(figure.name, data) if data is not None else ""
        recorded = read_recorded(options.root, figure.path)
        if run is None or isinstance(drawing, str):
            continue
        if recorded is not None:
            lesson_record = course.records.get(figure.span.path, LessonRecord())
            _, wording = figure_difference(figure, run, recorded, drawing, lesson_record)
            lacks_data = read_figure_data(recorded) is None
            if not wording and not (lacks_data and read_figure_data(drawing) is not None):
                continue
        try:
            if not dry_run:
                write_atomic(options.root, figure.path, drawing, expected=recorded)
        except (EffectError, OSError) as error:
            failures.append(diagnose("output-not-updatable", figure.span, str(error)))
        else:
            remarks.append(f"{'would draw' if dry_run else 'drew'} {figure.path}")
    return remarks, failures


_SIGNATURES = {
    ".png": rb"\x89PNG",
    ".jpg": rb"\xff\xd8\xff",
    ".jpeg": rb"\xff\xd8\xff",
    ".gif": rb"GIF8[79]a",
    ".webp": rb"RIFF....WEBP",
}
"""How pictures begin."""


def check_drawings(course: Course, options: Options) -> Iterator[Diagnostic]:
    """Judge the pictures, which are published as they are: what they are, and all of an SVG."""
    for path in course.files:
        kind = path[path.rfind(".") :].lower()
        is_drawing = kind in (".svg", ".svgz") and course.html != "trusted"
        if not (is_drawing or kind in _SIGNATURES):
            continue
        data = read_recorded(options.root, path) or b""
        if not re.match(_SIGNATURES.get(kind, b""), data, re.DOTALL):
            message = f"`{path}` is no picture of the kind that its name says"
            help = "save it again in this format, or rename it"
            yield diagnose("image-forbidden", Source(path, "").span(0, 0), message, help=help)
        if is_drawing:

            def find_fault(data: bytes = data) -> bytes:
                drawing = read_svg(data)
                return drawing.encode() if isinstance(drawing, str) else b""

            key = step_key("drawing", data)
            fault = options.store.get_or_make("drawings", key, find_fault)
            if fault:
                message = f"`{path}` {fault.decode()}"
                help = f'{SVG_HELP}, unless the map says `html = "trusted"`'
                place = Source(path, "").span(0, 0)
                yield diagnose("image-forbidden", place, message, help=help)
