"""Runs that the course keeps: of scripts whose fence says `record=once`, since they take long.

Entry points: `recorded_runs`, which take the place of runs; `check_recorded_runs`; `keep_runs`,
which `update --long` calls.

`content/reports/NAME.run.json` holds what a script printed, when and on which machine, with the
state of every file of the project that it looked at. As long as these, its text and its options are
as they were, what it printed counts as if it had run now.
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
from coursebuild.core.run.machine import machine
from coursebuild.core.run.memory import States
from coursebuild.core.run.run_record import RunRecord, record_of
from coursebuild.core.scripts.extract import Extraction, jobs
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.numerics.reports.records import FOLDER
from coursebuild.pipeline.options import Options


class RecordedRun(Struct, frozen=True):
    """What a file holds."""

    machine: Machine
    packages: tuple[str, ...]
    """Versions of the installed packages that the script imported."""
    record: RunRecord

    def run(self) -> ScriptRun:
        """The run as if it had been made now."""
        date = time.strftime("%Y-%m-%d", time.gmtime(self.record.timestamp))
        where = ", ".join(filter(None, (self.machine.cpu, self.machine.system)))
        versions = f"MuJoCo {self.machine.engine}, Python {self.machine.python}"
        return replace(self.record.restore(()), recorded=f"{date}, {versions}, {where}")


def recorded_runs(scripts: Iterable[Extraction], options: Options) -> dict[str, ScriptRun]:
    """The runs that the course keeps, by path; of a script without one, that it was not run."""
    if options.long:
        return {}
    once = [each for each in scripts if each.script.once]
    known = {each.path: _read(each, options) for each in once}
    return {
        path: ScriptRun(path, Outcome.NORUN, 0, "", "", 0.0) if kept is None else kept.run()
        for path, kept in known.items()
    }


def check_recorded_runs(scripts: Iterable[Extraction], options: Options) -> Iterator[Diagnostic]:
    """A diagnostic for each script of which the course keeps no run that still counts."""
    states = States(options.root, options.store, options.interpreter)
    for extraction in scripts:
        if not extraction.script.once:
            continue
        kept, path = _read(extraction, options), extraction.path
        if kept is None:
            message = f"`{path}` is recorded once, and no run of it is kept in {_path(path)}"
        else:
            why = input_changes(kept.record.inputs, _inputs(extraction))
            why += state_changes(kept.record.dependencies, states)
            if not why:
                continue
            message = f"what is recorded of `{path}` is of another state of the course: {why[0]}"
        fence = extraction.script.span.first_line()
        help = f"run `coursebuild update --long {extraction.owner}`"
        yield diagnose("recorded-run", fence, message, help=help)


def keep_runs(scripts: Iterable[Extraction], runs: Sequence[ScriptRun], options: Options) -> None:
    """Keep the runs of scripts that are recorded once, as far as these went well."""
    states = States(options.root, options.store, options.interpreter)
    by_path = {run.path: run for run in runs}
    for extraction in scripts:
        run, path = by_path.get(extraction.path), _path(extraction.path)
        if run is None or not extraction.script.once or run.outcome is not Outcome.OK:
            continue
        looked = dependencies_of(run, (), states.places, states)
        record = record_of(
            _inputs(extraction),
            tuple(_of_the_project(looked, states)),
            int(time.time()),
            "",
            replace(run, seconds=round(run.seconds, 1), stderr="", figures=()),
        )
        packages = tuple(one.state for one in looked if one.kind is Kind.MODULE and one.state)
        kept = RecordedRun(machine(interpreter=options.interpreter), packages, record)
        before = _read(extraction, options)
        if before is not None and replace(before.record, timestamp=0) == replace(
            record, timestamp=0
        ):
            continue
        file = options.root / path
        data = msgspec.json.format(msgspec.json.encode(kept), indent=2) + b"\n"
        expected = file.read_bytes() if file.exists() else None
        write_atomic(options.root, path, data, expected=expected)


def _of_the_project(looked: Iterable[Dependency], states: States) -> Iterator[Dependency]:
    """What is the same on every machine.

    An environment in the folder of the course is not, nor is our library, which elsewhere is
    installed.
    """
    places = dict(states.places)
    folders = (places["prefix"], f"{places['library']}/mjcourse")
    others = tuple(f"{os.path.relpath(folder, states.root)}/" for folder in folders)
    for one in looked:
        of_course = one.kind in (Kind.FILE, Kind.LISTING, Kind.SOUGHT)
        if of_course and not one.name.startswith(others):
            yield one


def _inputs(extraction: Extraction) -> Inputs:
    """What is known before the script runs and is the same on every machine."""
    (job,) = jobs([extraction])
    return replace(inputs_of(job, extraction.data, ()), timeout=0.0, version="")


def _path(script: str) -> str:
    name = script.removeprefix("examples/").removesuffix(".py").replace("/", "-")
    return f"{FOLDER}/{name}.run.json"


def _read(extraction: Extraction, options: Options) -> RecordedRun | None:
    try:
        data = (options.root / _path(extraction.path)).read_bytes()
        kept = msgspec.json.decode(data, type=RecordedRun)
    except (OSError, msgspec.DecodeError):
        return None
    return kept if kept.record.inputs.path == extraction.path else None
