"""`coursebuild stability`: MuJoCo on hard cases, beside what theory says.

1. A name means a problem, or a family of them (`damped-spring` is all of its damping ratios).
2. All problems are recorded in one file. Where some are named, recording them leaves the others as
   they are, and checking them ignores the others.
3. Where the two references of a case are further apart than they may be, it is an error, and
   nothing is recorded.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from typing import Any

import msgspec
from msgspec.structs import replace

from coursebuild.api import Options, UsageError
from coursebuild.core.model.measurements import CaseReport
from coursebuild.core.model.report_files import STABILITY, ReportFailure
from coursebuild.core.run.script_environment import engine_version
from coursebuild.core.text.near import nearest
from coursebuild.features.bench.commands.measurement import (
    Departure,
    Measurement,
    MeasuringRun,
    RecordCheck,
    add_report_options,
    file_of,
    in_words,
    measurement_json,
    recorded_value,
    run_measurement,
    task_of,
    write_records,
)
from coursebuild.features.bench.commands.measuring import Mjbench
from coursebuild.pipeline.arguments import add_cache, add_executors, add_format, add_quiet
from coursebuild.pipeline.scenes import read_record
from coursebuild.report.values import json_text

EXAMPLES = """\
examples:
  coursebuild stability damped-spring    one family of hard cases
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_quiet(parser)
    parser.add_argument(
        "problems",
        nargs="*",
        metavar="PROBLEM",
        help="a hard case, or a family of them (default: all)",
    )
    add_format(parser, "text", "json")
    add_report_options(parser)
    add_cache(parser)
    add_executors(parser)


def run(arguments: argparse.Namespace) -> int:
    """Measure, or check by measuring again."""
    names = tuple(arguments.problems)

    def measure(options: Options, mjbench: Mjbench) -> Measurement[Any]:
        if arguments.check:
            return check_stability(options, mjbench, names)
        measurement = stability(options, mjbench, names, record=arguments.record)
        return in_words(arguments, mjbench, "cases", measurement)

    def as_json(measurement: Measurement[Any]) -> str:
        if measurement.ok and not (arguments.record or arguments.check):
            return json_text(measurement.values)
        return measurement_json({"cases": measurement.values}, measurement)

    return run_measurement(arguments, "stability", measure, as_json)


def stability(
    options: Options, mjbench: Mjbench, names: tuple[str, ...] = (), *, record: bool = False
) -> Measurement[CaseReport]:
    """Measure the cases of these names, or all without names; `record` writes them down."""
    run = _CaseRun(options, mjbench)
    measurement = run.measure_each(_select_problems(run.facts.problems, names))
    if record and not measurement.failures:
        return _record(options, mjbench, run.facts.problems, measurement, names)
    return measurement


def _record(
    options: Options,
    mjbench: Mjbench,
    problems: Sequence[str],
    measurement: Measurement[CaseReport],
    names: tuple[str, ...],
) -> Measurement[CaseReport]:
    """Write the cases down; where some are named, the others stay as they are recorded."""
    rest: list[Any] = []
    if names and (options.root / STABILITY.path()).exists():
        old = read_record(options.root, STABILITY)
        if isinstance(old, ReportFailure):
            return replace(measurement, failures=(old,))
        kept_names = set(problems) - {report.name for report in measurement.reports}
        values = recorded_value(options.root, STABILITY)
        rest = [value for value in values if value["name"] in kept_names]
    data = file_of(mjbench, cases=[*rest, *measurement.values])
    return write_records(options.root, measurement, [(STABILITY.path(), data)])


def check_stability(
    options: Options, mjbench: Mjbench, names: tuple[str, ...] = ()
) -> Measurement[CaseReport]:
    """Measure again, and compare with the record; without a record nothing is measured."""
    run = _CaseRun(options, mjbench, use_store=False)
    problems = _select_problems(run.facts.problems, names)
    recorded = read_record(options.root, STABILITY)
    if isinstance(recorded, ReportFailure):
        return Measurement((), failures=(recorded,))
    measurement = run.measure_each(problems)
    new = {case.name for case in measurement.reports}
    old = [case for case in recorded if not names or case.name in new]
    engine = engine_version()
    other_engines = sorted({case.machine.engine for case in old} - {engine})
    remarks = tuple(
        f"recorded with MuJoCo {name}, measured with {engine}" for name in other_engines
    )
    names_of_old = {case.name for case in old}
    values = recorded_value(options.root, STABILITY)
    old_values = [value for value in values if value["name"] in names_of_old]
    data = mjbench.do("compare", recorded_cases=old_values, measured_cases=measurement.values)
    departures = msgspec.json.decode(data, type=tuple[Departure, ...])
    check = RecordCheck("stability", STABILITY.path(), departures, remarks)
    return replace(measurement, checked=(check,))


class _CaseRun(MeasuringRun[CaseReport]):
    """Measures hard cases one after the other."""

    report_type, kind = CaseReport, "stability"

    def measure(self, name: str) -> bytes | None:
        """Report on a case; `None` where its references disagree."""
        return self.load_or_measure(
            name, self._parts(name), lambda: self.do_job("case", None, name=name)
        )

    def _parts(self, name: str) -> tuple[object, ...]:
        return name, self.code, self.facts.pinned

    def tasks(self, name: str) -> Iterator[tuple[Any, ...]]:
        """The case, if it is not stored."""
        if self.load(self.kind, self._parts(name), bytes) is None:
            yield task_of("case", None, name=name)


def _select_problems(problem_names: tuple[str, ...], names: tuple[str, ...]) -> list[str]:
    """The names of all problems that these names mean; of all problems without names."""
    selection = set() if names else set(problem_names)
    for name in names:
        matches = {p for p in problem_names if p == name or p.startswith(f"{name}-")}
        if not matches:
            suggestion = nearest(name, problem_names)
            all_of_them = "known: " + ", ".join(problem_names)
            help = all_of_them if suggestion is None else f"did you mean `{suggestion}`?"
            raise UsageError(f"no hard case is called `{name}`", help=help)
        selection |= matches
    return [problem for problem in problem_names if problem in selection]
