"""The command `mjbench`."""

from __future__ import annotations

import argparse
import hashlib
import math
import shutil
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import groupby, takewhile
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from mjbench import bench, diet, text
from mjbench.bench import CannotMeasureError, Subject, UsageError, read_subject
from mjbench.cases import measure_case
from mjbench.engines.engine_run import UnknownEngineError, chosen_engines, measure_engines
from mjbench.host import LocalHost
from mjbench.loop import LoopError, TimeLimitError, read_loop, time_limit
from mjbench.machine import one_processor, package_version, this_machine
from mjbench.parts import LATE, Parts
from mjbench.problems import all_problems
from mjbench.pruning.survey import StoppedSurvey
from mjbench.reports import PartFailure
from mjbench.reports.diet_report import DietReport, Keep
from mjbench.reports.model_report import CaseReport, SceneReport
from mjbench.reports.page import scene_page
from mjbench.reports.records import (
    BENCH,
    DIET,
    ENGINES,
    STABILITY,
    Departure,
    RecordError,
    case_departures,
    read_report,
    scene_departures,
)
from mjbench.reports.scene_report import ScenarioReport, SweepReport
from mjbench.reports.terminal import Style
from mjbench.schemas import schema_text
from mjbench.text import diet_text
from mjbench.work_precision import StoppedError

_COMMANDS = ("bench", "stability", "diet", "show", "schema", "jobs")
_DESCRIPTION = """\
Measures MuJoCo models: speed against error of every integrator and timestep, the largest stable
timestep, and what a model could do without. `mjbench MODEL.xml` is `mjbench bench MODEL.xml`.
"""
_T = TypeVar("_T")
_STOPPED = 130
"""The exit status of a command that the user stopped."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; 0 where all holds, 1 where something is to be done, 2 for a mistake in it."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words and words[0] not in (*_COMMANDS, "-h", "--help", "--version"):
        words.insert(0, "bench")
    namespace = _parser().parse_args(words)
    try:
        status: int = namespace.run(namespace)
    except (KeyboardInterrupt, TimeLimitError):
        print("mjbench: stopped before there was a report", file=sys.stderr)
        return _STOPPED
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        print(f"mjbench: error: {place}{error.strerror}", file=sys.stderr)
        return 2
    except (UsageError, LoopError, UnknownEngineError) as error:
        print(f"mjbench: error: {error}", file=sys.stderr)
        return 2
    except CannotMeasureError as error:
        print(f"mjbench: error: {error.place}: {error}", file=sys.stderr)
        if error.help:
            print(f"  help: {error.help}", file=sys.stderr)
        return 1
    return status


def positive(text: str) -> float:
    """A number above 0; its name is what the message of an argument says."""
    number = float(text)
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"{text} is no number above 0")
    return number


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
    help = "MJCF, URDF, MJB, or Python with `spec`; MODEL.toml beside it has scenarios"
    command.add_argument("model", type=Path, help=help)
    help = "Python with `control(model, data)`, which gives the commands, and its `period` in s"
    command.add_argument("--control", type=Path, metavar="FILE", help=help)
    help = "how often it is asked; how much later its commands act"
    for name in ("--period", "--delay"):
        command.add_argument(name, type=float, metavar="SECONDS", help=help)
    help = "the standard deviation of its commands, relative to their range"
    command.add_argument("--noise", type=float, metavar="SHARE", help=help)
    help = (
        "what the task is about: errors are also of this sensor, or the place of this site or body"
    )
    command.add_argument("--task", default="", metavar="NAME", help=help)
    help = "measure other engines instead: all, or some, as in mjx,warp"
    command.add_argument("--engines", nargs="?", const="", metavar="NAMES", help=help)
    command.add_argument("--quick", action="store_true", help="fewer settings and rough times")
    help = "which it takes at most; each part has a share of them, and what is known is told"
    command.add_argument("--minutes", type=positive, metavar="M", help=help)
    help = "say where the time goes, by phase, under the settings that the verdict compares"
    command.add_argument("--profile", action="store_true", help=help)
    help = "write a page with verdicts, plots and tables"
    command.add_argument("--html", type=Path, metavar="FILE", help=help)
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
    help = "look for findings of these kinds alone"
    command.add_argument("--only", nargs="*", default=[], metavar="KIND", help=help)
    _add_report_options(command, check=False)
    command = add("show", _show, "show a recorded report")
    command.add_argument("report", type=Path, help="a file that --record has written")
    command.add_argument("--html", type=Path, metavar="FILE", help="write a page instead")
    command = add("schema", _schema, "print the JSON Schema of a format")
    command.add_argument("format", choices=("reports", "scenarios"))
    add("jobs", _jobs, "answer requests of another program: lines of JSON")
    return parser


def _add_report_options(command: argparse.ArgumentParser, *, check: bool = True) -> None:
    command.add_argument("--json", action="store_true", help="print the report as JSON")
    command.add_argument("--record", type=Path, metavar="FILE", help="write the report to a file")
    if check:
        help = "compare with a recorded report; times are never compared"
        command.add_argument("--check", type=Path, metavar="FILE", help=help)


def _host(subject: Subject) -> LocalHost:
    def tell(line: str) -> None:
        if sys.stderr.isatty():
            print(f"\r\x1b[K{subject.name}: {line}", end="", file=sys.stderr, flush=True)

    return LocalHost(Path(subject.folder), tell)


def _bench(arguments: argparse.Namespace) -> int:
    subject = read_subject(arguments.model)
    host, quick = _host(subject), arguments.quick
    if quick and (arguments.record or arguments.check):
        raise UsageError("--quick measures only a part, which is not recorded or compared")
    loop, options = None, (arguments.period, arguments.delay, arguments.noise)
    if arguments.control is not None:
        loop = read_loop(arguments.control, options[0], options[1] or 0.0, options[2] or 0.0)
        code = f"{subject.digest} {options}".encode() + arguments.control.read_bytes()
        subject = msgspec.structs.replace(subject, digest=hashlib.sha256(code).hexdigest())
    elif options != (None, None, None):
        raise UsageError("--period, --delay and --noise are of a controller: --control FILE")
    if arguments.profile and arguments.check:
        raise UsageError("--check compares no times, and --profile is of nothing else")
    if arguments.engines is not None:
        if loop or arguments.task or arguments.profile:
            message = "other engines are measured without controller, task and profile"
            raise UsageError(message)
        if arguments.check:
            raise UsageError("32 bits do not repeat from one device to the next: no --check")
        names = [name.strip() for name in arguments.engines.split(",") if name.strip()]
        engines, remarks = chosen_engines(names)
        report = measure_engines(subject, engines, host, quick=quick)
        _print(arguments, ENGINES.encode(report), text.engines_text(report, _style()), remarks)
        return 0
    timed = arguments.check is None
    recorded = None if timed else _read(arguments.check, BENCH.decode)
    with time_limit(60 * (arguments.minutes or math.inf)):
        compiled_model = bench.compile_subject(
            subject, host, quick=quick, loop=loop, task=arguments.task
        )
        scene, is_stopped = _measure_scene(
            compiled_model, host, quick=quick, timed=timed, profile=arguments.profile
        )
    if recorded is not None:
        departures = scene_departures(recorded, scene, compiled_model.declarations.bench)
        _print(arguments, _list(departures), text.departures_text(departures))
        return 1 if departures else 0
    parts = Parts()
    words = parts.run("the text", partial(text.scene_text, scene, _style()), "")
    page = None if arguments.html is None else parts.run("the page", partial(scene_page, scene), "")
    unmade = [f"{f.part} was not made: {f.reason}" for f in parts.failures]
    is_measured = not is_stopped and bool(scene.scenarios or not scene.failures)
    _print(arguments, BENCH.encode(scene), words, unmade, record=is_measured)
    if page:
        arguments.html.write_text(page, "utf-8")
    if is_stopped:
        print("mjbench: stopped; this is what is known", file=sys.stderr)
        return _STOPPED
    return int(not is_measured or bool(parts.failures))


def _measure_scene(
    compiled_model: bench.CompiledModel,
    host: LocalHost,
    *,
    quick: bool,
    timed: bool,
    profile: bool,
) -> tuple[SceneReport, bool]:
    """A model in all of its scenarios and sweeps, and whether the user or the time stopped it."""
    scenarios: list[ScenarioReport] = []
    parts, sweeps = Parts(), list[SweepReport]()

    def scenario(number: int) -> None:
        try:
            report = bench.run_scenario(
                compiled_model, number, host, quick=quick, timed=timed, profile=profile
            )
        except StoppedError as error:
            scenarios.append(error.report)  # which says itself what is not known
            parts.stopped = True
            return
        except CannotMeasureError as error:
            reason = f"{error.place}: {error}" + (f"; {error.help}" if error.help else "")
            name = compiled_model.scenarios[number].name
            parts.failures.append(PartFailure(f"the scenario {name}", reason))
            return
        scenarios.append(report)

    declared_sweeps = compiled_model.declarations.sweeps
    left = len(compiled_model.scenarios) + len(declared_sweeps)
    for number, scene in enumerate(compiled_model.scenarios):
        # Another seed asks the same again; what an author declares asks something else.
        share = 1.0 if compiled_model.subject.is_fair else 1 / (left - number)
        parts.run(f"the scenario {scene.name}", partial(scenario, number), None, share=share)
    for number, sweep in enumerate(declared_sweeps):
        run = partial(bench.run_sweep, compiled_model, sweep.name, host, quick=quick, timed=timed)
        share = 1 / (len(declared_sweeps) - number)
        report = parts.run(f"the sweep {sweep.name}", run, None, share=share)
        sweeps += [] if report is None else [report]
    failures = [*parts.failures, *(f for report in scenarios for f in report.failures)]
    is_stopped = parts.stopped or any(failure.reason.startswith(LATE) for failure in failures)
    join = partial(bench.join_parts, compiled_model, scenarios, sweeps, host, quick=quick)
    return join(failures=parts.failures), is_stopped


def _style() -> Style:
    return Style(shutil.get_terminal_size((100, 40)).columns, sys.stdout.isatty())


def _show(arguments: argparse.Namespace) -> int:
    """Show a report of any kind."""
    report = _read(arguments.report, read_report)
    if arguments.html is None:
        reports = report if isinstance(report, tuple) else (report,)
        sys.stdout.write("\n".join(text.report_text(r, _style()) for r in reports))
        return 0
    if not isinstance(report, SceneReport):
        raise UsageError(f"{arguments.report} is no report on a model in scenarios: no page")
    arguments.html.write_text(scene_page(report), "utf-8")
    return 0


def _read(file: Path, decode: Callable[[bytes], _T]) -> _T:
    """What a file of a report holds."""
    try:
        return decode(file.read_bytes())
    except RecordError as error:
        raise UsageError(f"{file} {error}") from None


def _stability(arguments: argparse.Namespace) -> int:
    problems = all_problems()
    cases = dict(problems) if not arguments.problems else {}
    for name in arguments.problems:
        matches = {n: p for n, p in problems.items() if n == name or n.startswith(f"{name}-")}
        if not matches:
            families = ", ".join(_families(problems))
            raise UsageError(f"no hard case or family of them is called `{name}`: {families}")
        cases |= matches
    recorded = None
    if arguments.check is not None:
        recorded = _read(arguments.check, STABILITY.decode)
    machine, reports, parts = this_machine(pinned=True), list[CaseReport](), Parts()
    for name, problem in cases.items():
        with one_processor():
            case = partial(measure_case, problem, machine, time.thread_time_ns)
            report = parts.run(name, case, None)
        if report is None:
            continue
        if recorded is None and not arguments.json:  # all of them take long
            print("\n" * bool(reports) + text.case_text(report, _style()), end="", flush=True)
        reports.append(report)
    failures = [f"{failure.part} was not measured: {failure.reason}" for failure in parts.failures]
    if recorded is not None:
        names = {report.name for report in reports}
        departures = case_departures([c for c in recorded if c.name in names], reports)
        _print(arguments, _list(departures), text.departures_text(departures), failures)
        return 1 if departures or failures else 0
    data = STABILITY.encode(tuple(reports))
    _print(arguments, data, "", failures, record=not failures)
    return _STOPPED if parts.stopped else int(bool(failures))


def _families(names: Iterable[str]) -> Iterator[str]:
    """What cases in a row are called together, such as `stack` for all stacks; of one, its name."""
    for _, group in groupby(names, key=lambda name: name.partition("-")[0]):
        words = zip(*(name.split("-") for name in group), strict=False)
        yield "-".join(word for word, *_ in takewhile(lambda w: len(set(w)) == 1, words))


def _diet(arguments: argparse.Namespace) -> int:
    if arguments.quick and arguments.record:
        raise UsageError("--quick looks only at a part, which is not recorded")
    readers = [
        diet.ReaderSource(file.name, file.read_text("utf-8", "replace")) for file in arguments.code
    ]
    modules = frozenset(file.stem for file in arguments.code if file.suffix == ".py")
    command = f"mjbench diet {arguments.model}"
    table = arguments.model.with_suffix(".toml").name
    while True:
        subject = read_subject(arguments.model)
        if subject.path.endswith((".mjb", ".urdf")):
            raise UsageError(f"the diet edits MJCF, and {arguments.model} is none")
        try:
            result = diet.look_at(
                _host(subject),
                subject=subject,
                readers=readers,
                modules=modules,
                keeps=tuple(_keeps(subject)),
                only=arguments.only,
                quick=arguments.quick,
            )
        except StoppedSurvey as stop:
            words = diet_text(stop.report, command, table, _style(), is_stopped=True)
            _print(arguments, DIET.encode(stop.report), words, record=False)
            print("mjbench: stopped; this is what is known", file=sys.stderr)
            return _STOPPED
        if not (arguments.fix and result.changes):
            break
        for change in result.changes:
            Path(subject.folder, change.path).write_bytes(change.after)
            print(f"changed {change.path}", file=sys.stderr)
    report: DietReport = result.report
    _print(arguments, DIET.encode(report), diet_text(report, command, table, _style()))
    return 0 if report.ok else 1


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
    arguments: argparse.Namespace,
    data: bytes,
    words: str,
    remarks: Sequence[str] = (),
    *,
    record: bool = True,
) -> None:
    """Print a report, which is `data` as a file, and write that file if asked and `record`."""
    if sys.stderr.isatty():
        print("\r\x1b[K", end="", file=sys.stderr)
    sys.stdout.write(data.decode() if arguments.json else words)
    for remark in remarks:
        print(remark, file=sys.stderr)
    if arguments.record is not None and record:
        arguments.record.write_bytes(data)
    elif arguments.record is not None:
        print(f"{arguments.record} is not written: not all was measured", file=sys.stderr)


def _list(departures: Sequence[Departure]) -> bytes:
    return msgspec.json.format(msgspec.json.encode(departures), indent=1) + b"\n"
