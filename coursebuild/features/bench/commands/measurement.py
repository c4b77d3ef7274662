"""How `bench`, `stability` and `diet` measure, and what they print and record."""

from __future__ import annotations

import argparse
import functools
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, TypeVar

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import (
    CLEAN,
    FAILURE,
    Diagnostic,
    EffectError,
    Executor,
    Options,
    UsageError,
    options_of,
    resolve_inside,
    write,
)
from coursebuild.core.engine.tool import code_digest
from coursebuild.core.files.course_root import read_regular
from coursebuild.core.files.errors import reason
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import write_atomic
from coursebuild.core.model.report_files import ReportFailure, ReportKind
from coursebuild.core.model.results import Machine
from coursebuild.core.text.characters import printable
from coursebuild.core.text.diagnostics import sort_diagnostics
from coursebuild.core.values import decode, encode, fingerprint
from coursebuild.features.bench.commands.measuring import (
    Facts,
    FailedJobError,
    Mjbench,
    diagnostic_of,
)
from coursebuild.pipeline.arguments import style_of
from coursebuild.pipeline.scenes import CourseScene, find_scenes
from coursebuild.report.text import (
    BOLD,
    FAINT,
    GREEN,
    RED,
    YELLOW,
    Column,
    Style,
    diagnostic_paragraphs,
    table,
)
from coursebuild.report.values import json_text, plural

_A = TypeVar("_A")
_T = TypeVar("_T")


class Departure(Struct, frozen=True):
    """A figure that is not what was recorded, in words."""

    where: str
    setting: str
    figure: str
    recorded: str
    measured: str
    band: str


class RecordCheck(Struct, frozen=True):
    """A recorded report compared with a new measurement."""

    name: str
    """The model, or `stability`."""
    path: str
    """The file of the recorded report."""
    departures: tuple[Departure, ...]
    remarks: tuple[str, ...] = ()
    """Other differences, which are no mistake by themselves."""


class Measurement(Struct, Generic[_T], frozen=True):
    """The result of a command that measures."""

    reports: tuple[_T, ...]
    """Reports on models, by name, or on hard cases, by number."""
    values: tuple[Any, ...] = ()
    """The same as mjbench gives them, with all fields: values of JSON."""
    diagnostics: tuple[Diagnostic, ...] = ()
    """Diagnostics of models and of what is declared for them."""
    failures: tuple[ReportFailure, ...] = ()
    checked: tuple[RecordCheck, ...] = ()
    remarks: tuple[str, ...] = ()
    text: str = ""
    """The reports in words; empty where they are not asked for."""

    @property
    def faults(self) -> str:
        """What is wrong, in words. Exit status and last line are both read from it."""
        errors = len(self.failures) + sum(d.is_error for d in self.diagnostics)
        figures = sum(len(check.departures) for check in self.checked)
        reports = sum(not getattr(report, "ok", True) for report in self.reports)
        counts = [plural(errors, "error")] if errors else []
        counts += [f"{plural(figures, 'figure')} not as recorded"] if figures else []
        counts += [f"faults in {plural(reports, 'report')}"] if reports else []
        return ", ".join(counts)

    @property
    def ok(self) -> bool:
        """Whether everything was measured and agrees with the record, and nothing is to be done."""
        return not self.faults


def measurement_json(reports: Mapping[str, object], measurement: Measurement[_T]) -> str:
    """Write the same as one JSON object."""
    names = [name for name in Measurement.__struct_fields__[2:] if name != "text"]
    rest = {name: getattr(measurement, name) for name in names}
    return json_text({**reports, **rest})


def format_checks(checks: Sequence[RecordCheck], style: Style) -> str:
    """Say of each recorded report that it holds, or which figures left their bands."""
    texts = []
    names = ("setting", "figure", "recorded", "measured", "band")
    for check in checks:
        verdict = style.paint(f"as recorded in {printable(check.path)}", GREEN)
        if check.departures:
            figures = plural(len(check.departures), "figure")
            verdict = style.paint(f"{figures} not as recorded in {printable(check.path)}", RED)
        lines = [f"{style.paint(printable(check.name), BOLD)}  {verdict}"]
        lines += ["  " + style.paint(printable(remark), YELLOW) for remark in check.remarks]
        for place in dict.fromkeys(departure.where for departure in check.departures):
            departures = [d for d in check.departures if d.where == place]
            columns = [
                Column(
                    name,
                    tuple(getattr(departure, name) for departure in departures),
                    left=name not in ("recorded", "measured"),
                )
                for name in names
            ]
            head, *rows = table(columns)
            lines += ["", "  " + style.paint(printable(place), BOLD)]
            lines += ["    " + style.paint(head, FAINT), *(f"    {row}" for row in rows)]
        texts.append("\n".join(lines) + "\n")
    return "\n".join(texts)


def add_report_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for reports in the course's folder."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--record", action="store_true", help="write the measurements to content/reports/"
    )
    group.add_argument(
        "--check",
        action="store_true",
        help="measure again, and fail if a figure has changed; times are never compared",
    )


def run_measurement(
    arguments: argparse.Namespace,
    command: str,
    measure: Callable[[Options, Mjbench], Measurement[Any]],
    json: Callable[[Measurement[Any]], str],
    *,
    empty: str = "",
) -> int:
    """Measure with the options that the arguments give, print it, and return the exit status.

    `json` writes the whole; `empty` is for no text at all.
    """
    options = options_of(arguments)
    try:
        with Mjbench(options.root, f"`coursebuild {command}`") as mjbench:
            measurement = measure(options, mjbench)
    finally:
        options.store.close()
    status = CLEAN if measurement.ok else FAILURE
    if arguments.format == "json":
        return write(json(measurement), status)
    style = style_of(sys.stdout)
    failures = ""
    for failure in measurement.failures:
        message = style.paint(f": {printable(failure.message)}", BOLD)
        failures += f"{style.paint('error', RED)}{message}\n"
        failures += f"  help: {printable(failure.help)}\n" if failure.help else ""
    parts = [
        *diagnostic_paragraphs(measurement.diagnostics, style),
        failures,
        measurement.text,
        format_checks(measurement.checked, style),
        "".join(f"{printable(remark)}\n" for remark in measurement.remarks),
        f"{style.paint(measurement.faults, RED)}\n" if measurement.faults else "",
    ]
    return write("\n".join(part for part in parts if part) or empty, status)


def in_words(
    arguments: argparse.Namespace,
    mjbench: Mjbench,
    kind: str,
    measurement: Measurement[_T],
    **settings: str,
) -> Measurement[_T]:
    """The measurement with its reports in words, which mjbench writes, if these are printed.

    `kind` and `settings`: as the job `text` takes them.
    """
    if arguments.format == "json" or not measurement.values:
        return measurement
    style = style_of(sys.stdout)
    look = {"width": style.width, "colour": style.colour, **settings}
    data = mjbench.do("text", None, **{kind: measurement.values}, **look)
    return replace(measurement, text=msgspec.json.decode(data, type=str))


class MeasuringRun(Generic[_T]):
    """Measures one thing after the other, or takes the result from the store.

    Only one run of a course measures at a time, since two would disturb each other's times; the
    second finds what the first has measured.
    """

    stage, success = "measuring", "measured"
    """Words of the progress display: for the stage, and for a thing that was measured."""
    function = f"{__name__}:do_task"
    """Measures a task in another process: `module:name`, as in `Executor.map`."""
    report_type: type[_T]
    kind: str
    """That of the entries of the store which hold reports."""

    def __init__(
        self,
        options: Options,
        mjbench: Mjbench,
        diagnostics: Iterable[Diagnostic] = (),
        *,
        use_store: bool = True,
    ) -> None:
        self.options = options
        self.mjbench = mjbench
        self.use_store = use_store
        """Whether results are taken from the store, and put into it."""
        self.diagnostics = list(diagnostics)
        self.failures: list[ReportFailure] = []
        self.remarks: list[str] = []
        self.results: dict[tuple[Any, ...], bytes] = {}
        """What other processes have measured, by tasks."""
        self.progress = options.progress
        options.store.listen(self.progress.say)

    @functools.cached_property
    def facts(self) -> Facts:
        """What mjbench is here."""
        return self.mjbench.facts()

    @functools.cached_property
    def code(self) -> tuple[str, str]:
        """The code on which reports depend: mjbench's, and what exact motions may import."""
        return self.facts.code, code_digest("mjcourse/spatial")

    def measure_each(self, things: Sequence[Any]) -> Measurement[_T]:
        """Measure each thing, and collect the reports."""
        reports: list[bytes | None] = []
        if things:
            with self.progress.stage(self.stage, len(things)):
                if self.options.executor is not None:
                    self._measure_elsewhere(self.options.executor, things)
                reports = [self.measure(thing) for thing in things]
        present = [report for report in reports if report is not None]
        return Measurement(
            tuple(msgspec.json.decode(report, type=self.report_type) for report in present),
            tuple(msgspec.json.decode(report) for report in present),
            sort_diagnostics(self.diagnostics),
            failures=tuple(self.failures),
            remarks=tuple(self.remarks),
        )

    def _measure_elsewhere(self, executor: Executor, things: Sequence[Any]) -> None:
        """Have other processes measure what nobody has measured, so far as they can."""
        tasks = [task for thing in things for task in self.tasks(thing)]
        data = [encode((task, self.facts.machine)) for task in tasks]
        for task, result in zip(
            tasks, executor.map(self.function, self.options.root, data), strict=True
        ):
            self.results[task] = result
        if left := sum(not result for result in self.results.values()):
            self.progress.say(f"{left} of {plural(len(tasks), 'part')} can only be measured here")

    def measure(self, thing: Any) -> bytes | None:
        """Report on a thing, a scene or the name of a hard case; `None` if it cannot be."""
        raise NotImplementedError

    def tasks(self, thing: Any) -> Iterable[tuple[Any, ...]]:
        """What there is to measure of a thing: jobs for `do_task`, each by plain values.

        The name of the job, the model's name and its digest, and the values as pairs.
        """
        return ()

    def do_job(self, job: str, scene: CourseScene | None, **values: object) -> bytes:
        """What mjbench gives for a job, here or in another process."""
        data = self.results.pop(task_of(job, scene, **values), b"")
        return data or self.mjbench.do(job, scene, **values)

    def load_or_measure(
        self,
        thing: CourseScene | str,
        parts: tuple[object, ...],
        measure: Callable[[], bytes | None],
    ) -> bytes | None:
        """Load the report on a thing by all that it depends on, or measure the thing now."""
        report = self.load(self.kind, parts, bytes)
        if report is None:
            with project_lock(self.options.root, self.progress.say, name="bench-lock"):
                # The run that held the lock may have measured it.
                report = self.load(self.kind, parts, bytes)
                if report is None:
                    report = self._measure(thing, measure)
                    if report is not None:
                        self.save(self.kind, parts, report)
                    return report
        self.progress.skip()
        return report

    def _measure(
        self, thing: CourseScene | str, measure: Callable[[], bytes | None]
    ) -> bytes | None:
        report, name = None, thing if isinstance(thing, str) else thing.name
        self.progress.start(name)
        self.mjbench.tell = functools.partial(self.progress.describe, name)
        start = time.monotonic()
        try:
            report = measure()
        except FailedJobError as error:
            if isinstance(thing, str):
                self.failures.append(ReportFailure(str(error), error.failure.help))
            else:
                self.diagnostics.append(diagnostic_of(error.failure, thing))
        verdict = f"not {self.success}" if report is None else self.success
        self.progress.finish(name, verdict, time.monotonic() - start)
        return report

    def load(self, kind: str, parts: tuple[object, ...], form: type[_A]) -> _A | None:
        """Load the stored value that depends on these parts, if there is one."""
        if not self.use_store:
            return None
        return self.options.store.get_value(kind, fingerprint(parts), form)

    def save(self, kind: str, parts: tuple[object, ...], value: object) -> None:
        """Store a value under the parts on which it depends."""
        if self.use_store:
            self.options.store.put_value(kind, fingerprint(parts), value)


def task_of(job: str, scene: CourseScene | None, **values: object) -> tuple[Any, ...]:
    """A job for `do_task`."""
    name, digest = ("", "") if scene is None else (scene.name, scene.digest)
    return job, name, digest, tuple(values.items())


def do_task(root: Path, data: bytes) -> bytes:
    """Do a job of mjbench about a model or about none, as a task of `Executor.map`."""
    with Mjbench(root, "a measurement") as mjbench:
        task = read_task(data, mjbench)
        if task is None:
            return b""
        job, name, digest, values = task
        scenes = {s.digest: s for s in find_scenes(root, (name,)).value} if name else {"": None}
        if digest not in scenes:  # its files were edited
            return b""
        try:
            return mjbench.do(job, scenes[digest], **dict(values))
        except FailedJobError:  # which is found and told where the command is
            return b""


def read_task(data: bytes, mjbench: Mjbench) -> tuple[Any, ...] | None:
    """The task that another process has sent; `None` if this is another machine than its own."""
    task, machine = decode(data, tuple[tuple[object, ...], Machine]) or ((), None)
    if machine is None:
        return None
    own_machine = replace(mjbench.facts().machine, processors=machine.processors)
    return task if own_machine == machine else None


def forbid_quick(option: str, *, quick: bool) -> None:
    """Forbid `--quick` with an option for full measurements, by a `UsageError`."""
    if quick:
        raise UsageError(
            f"{option} cannot be combined with --quick: recorded measurements are complete"
        )


def record_reports(
    root: Path, mjbench: Mjbench, kind: ReportKind[Any], name: str, measurement: Measurement[Any]
) -> Measurement[Any]:
    """Write the reports on models into the course; `name`: what the job `write` calls them."""
    records = [
        (kind.path(report.model), file_of(mjbench, **{name: value}))
        for report, value in zip(measurement.reports, measurement.values, strict=True)
    ]
    return write_records(root, measurement, records)


def write_records(
    root: Path, measurement: Measurement[_T], records: Iterable[tuple[str, bytes]]
) -> Measurement[_T]:
    """Write reports, given as (path, bytes), and add what was done to the measurement."""
    failures, remarks = [*measurement.failures], [*measurement.remarks]
    for path, data in records:
        try:
            target = resolve_inside(root, path)
            before = read_regular(target) if target.exists() else None
            if before != data:
                write_atomic(root, path, data, expected=before)
            remarks.append(f"{path} is unchanged" if before == data else f"wrote {path}")
        except EffectError as error:
            failures.append(ReportFailure(error.message, error.help))
        except OSError as error:
            failures.append(ReportFailure(f"{path} cannot be written: {reason(error)}"))
    return replace(measurement, failures=tuple(failures), remarks=tuple(remarks))


def file_of(mjbench: Mjbench, **report: object) -> bytes:
    """The file of a report, which mjbench writes."""
    return msgspec.json.decode(mjbench.do("write", None, **report), type=str).encode()


def recorded_value(root: Path, kind: ReportKind[Any], model: str = "") -> Any:
    """A recorded report with all its fields; it has been read before."""
    return msgspec.json.decode(read_bytes(root, kind.path(model)))[kind.field]
