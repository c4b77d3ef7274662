"""Recorded runs: of scripts that take long, whose fence says `record=once`.

Entry points: `recorded_runs`, which take the place of runs; `check_recorded_runs`; `record_runs`,
which `update --long` calls.

`content/reports/NAME.run.json` holds what a script printed, when and on which machine, with the
state of every file of the project that it read. As long as these files, its text and its options
are unchanged, the recorded run counts as if the script had run now.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator, Sequence

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.files.write import write_atomic
from coursebuild.core.model.results import Machine, Outcome, ScriptRun
from coursebuild.core.run.dependencies import (
    Dependency,
    Inputs,
    Kind,
    dependencies_of,
    input_changes,
    inputs_of,
    state_changes,
)
from coursebuild.core.run.memory import States
from coursebuild.core.run.run_record import RunRecord, record_of
from coursebuild.core.run.script_environment import machine
from coursebuild.core.scripts.extract import Extraction, jobs
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.numerics.reports.records import FOLDER
from coursebuild.pipeline.options import Options


class RecordedRun(Struct, frozen=True):
    """A recorded run, as its file holds it."""

    machine: Machine
    packages: tuple[str, ...]
    """Versions of the installed packages that the script imported."""
    record: RunRecord

    def run(self) -> ScriptRun:
        """Return the run as if it had been made now."""
        date = time.strftime("%Y-%m-%d", time.gmtime(self.record.timestamp))
        host = ", ".join(filter(None, (self.machine.cpu, self.machine.system)))
        versions = f"MuJoCo {self.machine.engine}, Python {self.machine.python}"
        return replace(self.record.restore(()), recorded=f"{date}, {versions}, {host}")


def recorded_runs(scripts: Iterable[Extraction], options: Options) -> dict[str, ScriptRun]:
    """Return the recorded runs by path; a script without one counts as not run."""
    if options.long:
        return {}
    once = [extraction for extraction in scripts if extraction.script.once]
    stored_runs = {extraction.path: _read(extraction, options) for extraction in once}
    return {
        path: ScriptRun(path, Outcome.NORUN, 0, "", "", 0.0)
        if recorded_run is None
        else recorded_run.run()
        for path, recorded_run in stored_runs.items()
    }


def check_recorded_runs(scripts: Iterable[Extraction], options: Options) -> Iterator[Diagnostic]:
    """Diagnose scripts that have no recorded run, or one that no longer holds."""
    states = States(options.root, options.store, options.interpreter)
    for extraction in scripts:
        if not extraction.script.once:
            continue
        recorded_run, path = _read(extraction, options), extraction.path
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
    for extraction in scripts:
        run, path = by_path.get(extraction.path), _path(extraction.path)
        if run is None or not extraction.script.once or run.outcome is not Outcome.OK:
            continue
        dependencies = dependencies_of(run, (), states.places, states)
        record = record_of(
            _inputs(extraction),
            tuple(_find_portable(dependencies, states)),
            int(time.time()),
            "",
            replace(run, seconds=round(run.seconds, 1), stderr="", figures=()),
        )
        packages = tuple(
            dependency.state
            for dependency in dependencies
            if dependency.kind is Kind.MODULE and dependency.state
        )
        recorded_run = RecordedRun(machine(interpreter=options.interpreter), packages, record)
        before = _read(extraction, options)
        if before is not None and replace(before.record, timestamp=0) == replace(
            record, timestamp=0
        ):
            continue
        file = options.root / path
        data = msgspec.json.format(msgspec.json.encode(recorded_run), indent=2) + b"\n"
        expected = file.read_bytes() if file.exists() else None
        write_atomic(options.root, path, data, expected=expected)


def _find_portable(dependencies: Iterable[Dependency], states: States) -> Iterator[Dependency]:
    """Find the dependencies that are the same on every machine.

    Files of an environment inside the course's folder are not, nor are those of our library, which
    may be installed elsewhere.
    """
    places = dict(states.places)
    folders = (places["prefix"], f"{places['library']}/mjcourse")
    excluded_folders = tuple(f"{os.path.relpath(folder, states.root)}/" for folder in folders)
    for dependency in dependencies:
        of_course = dependency.kind in (Kind.FILE, Kind.LISTING, Kind.SOUGHT)
        if of_course and not dependency.name.startswith(excluded_folders):
            yield dependency


def _inputs(extraction: Extraction) -> Inputs:
    """The inputs of a script that are the same on every machine."""
    (job,) = jobs([extraction])
    return replace(inputs_of(job, extraction.data, ()), timeout=0.0, version="")


def _path(script: str) -> str:
    name = script.removeprefix("examples/").removesuffix(".py").replace("/", "-")
    return f"{FOLDER}/{name}.run.json"


def _read(extraction: Extraction, options: Options) -> RecordedRun | None:
    try:
        data = (options.root / _path(extraction.path)).read_bytes()
        recorded_run = msgspec.json.decode(data, type=RecordedRun)
    except (OSError, msgspec.DecodeError):
        return None
    return recorded_run if recorded_run.record.inputs.path == extraction.path else None
