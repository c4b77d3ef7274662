"""The command `mjbench`."""

from __future__ import annotations

import argparse
import hashlib
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import msgspec
import mujoco

from mjbench import bench, diet, text
from mjbench.bench import CannotMeasureError, Subject
from mjbench.cases import DisagreementError, measure_case
from mjbench.engines.engine_run import UnknownEngineError, chosen_engines, measure_engines
from mjbench.host import LocalHost
from mjbench.machine import one_processor, package_version, this_machine
from mjbench.problems import all_problems
from mjbench.reports.diet_report import DietReport, Keep
from mjbench.reports.records import (
    BENCH,
    DIET,
    ENGINES,
    STABILITY,
    RecordError,
    case_departures,
    scene_departures,
)
from mjbench.schemas import schema_text

_COMMANDS = ("bench", "stability", "diet", "schema", "jobs")
_DESCRIPTION = """\
Measures MuJoCo models: speed against error of every integrator and timestep, the largest stable
timestep, and what a model could do without. `mjbench MODEL.xml` is `mjbench bench MODEL.xml`.
"""


class _UsageError(Exception):
    """The command cannot be done as it is given."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; 0 where all holds, 1 where something is to be done, 2 for a mistake in it."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words and words[0] not in _COMMANDS and not words[0].startswith("-"):
        words.insert(0, "bench")
    namespace = _parser().parse_args(words)
    try:
        status: int = namespace.run(namespace)
    except (_UsageError, UnknownEngineError, RecordError, OSError) as error:
        print(f"mjbench: error: {error}", file=sys.stderr)
        return 2
    except (CannotMeasureError, DisagreementError) as error:
        place = f"{error.place}: " if isinstance(error, CannotMeasureError) else ""
        print(f"mjbench: error: {place}{error}", file=sys.stderr)
        if isinstance(error, CannotMeasureError) and error.help:
            print(f"  help: {error.help}", file=sys.stderr)
        return 1
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("mjbench", description=_DESCRIPTION)
    version = package_version("mjbench")
    parser.add_argument("--version", action="version", version=f"mjbench {version}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def add(name: str, run: Callable[[argparse.Namespace], int], help: str) -> Any:
        command = commands.add_parser(name, help=help, description=help)
        command.set_defaults(run=run)
        return command

    command = add("bench", _bench, "measure speed against error")
    command.add_argument("model", type=Path, help="a MJCF file; MODEL.toml beside it has scenarios")
    help = "measure other engines instead: all, or some, as in mjx,warp"
    command.add_argument("--engines", nargs="?", const="", metavar="NAMES", help=help)
    command.add_argument("--quick", action="store_true", help="fewer settings and rough times")
    _add_report_options(command)
    command = add("stability", _stability, "measure MuJoCo on hard cases and compare with theory")
    command.add_argument("problems", nargs="*", metavar="PROBLEM", help="default: all of them")
    _add_report_options(command)
    command = add("diet", _diet, "find what a model contains but its scenarios do not need")
    command.add_argument("model", type=Path, help="a MJCF file")
    help = "code that reads the model: what it may notice stays"
    command.add_argument("--code", type=Path, nargs="*", default=[], metavar="FILE", help=help)
    command.add_argument("--quick", action="store_true", help="short runs and rough times")
    command.add_argument("--fix", action="store_true", help="remove what changes no bit of it")
    _add_report_options(command, check=False)
    command = add("schema", _schema, "print the JSON Schema of a format")
    command.add_argument("format", choices=("reports", "scenarios"))
    add("jobs", _jobs, "answer requests of another program: lines of JSON")
    return parser


def _add_report_options(command: argparse.ArgumentParser, *, check: bool = True) -> None:
    command.add_argument("--format", choices=("text", "json"), default="text")
    command.add_argument("--record", type=Path, metavar="FILE", help="write the report to a file")
    if check:
        help = "compare with a recorded report; times are never compared"
        command.add_argument("--check", type=Path, metavar="FILE", help=help)


def read_subject(file: Path) -> Subject:
    """A model file, with the declarations and the exact motion that lie beside it."""
    if not file.is_file():
        raise _UsageError(f"there is no file {file}")
    folder, mjcf = file.parent.resolve(), file.read_bytes()
    declarations, exact = file.with_suffix(".toml"), file.with_suffix(".exact.py")
    digest, parts = hashlib.sha256(mjcf), 0
    for file_beside in (declarations, exact):
        if file_beside.is_file():
            digest.update(file_beside.read_bytes())
    for part in map(Path, mujoco.mju_getXMLDependencies(str(folder / file.name))):
        if part.exists() and not part.samefile(file):
            digest.update(part.read_bytes())
            parts += part.stat().st_size
    return Subject(
        folder=str(folder),
        path=file.name,
        mjcf=mjcf.decode("utf-8", "surrogatepass"),
        name=file.stem,
        digest=digest.hexdigest(),
        declarations_path=declarations.name if declarations.is_file() else "",
        declarations=declarations.read_text("utf-8") if declarations.is_file() else "",
        exact=exact.name if exact.is_file() else "",
        parts=parts,
    )


def _host(subject: Subject) -> LocalHost:
    def tell(line: str) -> None:
        if sys.stderr.isatty():
            print(f"\r\x1b[K{subject.name}: {line}", end="", file=sys.stderr, flush=True)

    return LocalHost(Path(subject.folder), tell)


def _bench(arguments: argparse.Namespace) -> int:
    subject = read_subject(arguments.model)
    host, quick = _host(subject), arguments.quick
    if quick and (arguments.record or arguments.check):
        raise _UsageError("--quick measures only a part, which is not recorded or compared")
    if arguments.engines is not None:
        if arguments.check:
            raise _UsageError("32 bits do not repeat from one device to the next: no --check")
        names = [name.strip() for name in arguments.engines.split(",") if name.strip()]
        engines, remarks = chosen_engines(names)
        report = measure_engines(subject, engines, host, quick=quick)
        _print(arguments, report, text.engines_text(report), remarks)
        return _record(arguments, ENGINES.encode(report))
    timed = arguments.check is None
    recorded = None if timed else BENCH.decode(arguments.check.read_bytes())
    compiled_model = bench.compile_subject(subject, host, quick=quick)
    scenarios = [
        bench.run_scenario(compiled_model, number, host, quick=quick, timed=timed)
        for number in range(len(compiled_model.scenarios))
    ]
    sweeps = [
        bench.run_sweep(compiled_model, sweep.name, host, quick=quick, timed=timed)
        for sweep in compiled_model.declarations.sweeps
    ]
    scene = bench.join_parts(compiled_model, scenarios, sweeps, host, quick=quick, card=True)
    if recorded is not None:
        departures = scene_departures(recorded, scene, compiled_model.declarations.bench)
        _print(arguments, departures, text.departures_text(departures))
        return 1 if departures else 0
    _print(arguments, scene, text.scene_text(scene))
    return _record(arguments, BENCH.encode(scene))


def _stability(arguments: argparse.Namespace) -> int:
    problems = all_problems()
    cases = dict(problems) if not arguments.problems else {}
    for name in arguments.problems:
        matches = {n: p for n, p in problems.items() if n == name or n.startswith(f"{name}-")}
        if not matches:
            raise _UsageError(f"no hard case is called `{name}`: {', '.join(problems)}")
        cases |= matches
    recorded = None
    if arguments.check is not None:
        recorded = STABILITY.decode(arguments.check.read_bytes())
    machine, reports = this_machine(pinned=True), []
    for problem in cases.values():
        with one_processor():
            reports.append(measure_case(problem, machine, time.thread_time_ns))
    if recorded is not None:
        departures = case_departures([c for c in recorded if c.name in cases], reports)
        _print(arguments, departures, text.departures_text(departures))
        return 1 if departures else 0
    _print(arguments, reports, "\n".join(map(text.case_text, reports)))
    return _record(arguments, STABILITY.encode(tuple(reports)))


def _diet(arguments: argparse.Namespace) -> int:
    if arguments.quick and arguments.record:
        raise _UsageError("--quick looks only at a part, which is not recorded")
    readers = [
        diet.ReaderSource(file.name, file.read_text("utf-8", "replace")) for file in arguments.code
    ]
    modules = frozenset(file.stem for file in arguments.code if file.suffix == ".py")
    while True:
        subject = read_subject(arguments.model)
        keeps = tuple(_keeps(subject))
        result = diet.look_at(
            subject, _host(subject), readers, modules=modules, keeps=keeps, quick=arguments.quick
        )
        if not (arguments.fix and result.changes):
            break
        for change in result.changes:
            Path(subject.folder, change.path).write_bytes(change.after)
            print(f"changed {change.path}", file=sys.stderr)
    report: DietReport = result.report
    _print(arguments, report, text.diet_text(report))
    return _record(arguments, DIET.encode(report)) or (0 if report.ok else 1)


def _keeps(subject: Subject) -> Iterable[Keep]:
    """What the declarations keep, each with the first line that has it."""
    lines = subject.declarations.splitlines()
    for keep in subject.read_declarations().keep:
        places = ((n, line.find(keep.finding)) for n, line in enumerate(lines, 1))
        line, column = next((place for place in places if place[1] >= 0), (1, 0))
        yield Keep(keep.finding, keep.reason, subject.declarations_path, line, column + 1)


def _schema(arguments: argparse.Namespace) -> int:
    sys.stdout.write(schema_text(arguments.format))
    return 0


def _jobs(_: argparse.Namespace) -> int:
    from mjbench.jobs import serve

    serve()
    return 0


def _print(
    arguments: argparse.Namespace, report: object, words: str, remarks: Sequence[str] = ()
) -> None:
    if sys.stderr.isatty():
        print("\r\x1b[K", end="", file=sys.stderr)
    if arguments.format == "json":
        words = msgspec.json.format(msgspec.json.encode(report), indent=1).decode() + "\n"
    sys.stdout.write(words)
    for remark in remarks:
        print(remark, file=sys.stderr)


def _record(arguments: argparse.Namespace, data: bytes) -> int:
    if arguments.record is not None:
        arguments.record.write_bytes(data)
    return 0
