"""`coursebuild stability`: MuJoCo on hard cases, beside what theory says.

1. A name means a problem, or a family of them (`damped-spring` is all of its damping ratios), or a
   model of the course whose exact motion it gives, or of which it knows theory: what `bench`
   measures of it is a hard case too.
2. All problems are recorded in one file. Where some are named, recording them leaves the others as
   they are, and checking them ignores the others.
3. Where the two references of a case are further apart than they may be, it is an error, and
   nothing is recorded.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from coursebuild.cli.arguments import add_cache, add_executors, add_format, add_quiet
from coursebuild.core.engine.tool import code_digest
from coursebuild.core.files.errors import require
from coursebuild.core.pages import urls
from coursebuild.core.run.script_environment import engine_version, machine, one_processor
from coursebuild.core.text.near import nearest
from coursebuild.core.values import decode, encode
from coursebuild.features.bench.commands import bench
from coursebuild.features.bench.commands.measurement import (
    Measurement,
    MeasuringRun,
    add_report_options,
    english,
    grid_lines,
    measurement_json,
    plain_text,
    read_task,
    run_measurement,
    write_records,
)
from coursebuild.features.numerics import case_view
from coursebuild.numerics.cases import DisagreementError, measure_case
from coursebuild.numerics.problems import all_problems
from coursebuild.numerics.reports.case_report import (
    CaseReport,
    ErrorLine,
    case_quantities,
    course_cases,
    exact_file,
)
from coursebuild.numerics.reports.records import (
    STABILITY,
    RecordCheck,
    ReportFailure,
    case_departures,
)
from coursebuild.numerics.reports.scene_report import SceneReport
from coursebuild.numerics.reports.shown_errors import seconds_text, status_text
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.scenes import find_scenes, read_record
from coursebuild.report.text import BOLD, Column, Style, table
from coursebuild.report.values import json_text

_CODE = ("coursebuild/numerics", "mjcourse/spatial")
"""The code that measurements depend on."""
EXAMPLES = """\
examples:
  coursebuild stability impact           one family of hard cases
  coursebuild stability falling_ball     a model of the course whose exact motion it gives
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_quiet(parser)
    parser.add_argument(
        "problems",
        nargs="*",
        metavar="PROBLEM",
        help="a hard case, a family of them, or a model of the course (default: all)",
    )
    add_format(parser, "text", "json")
    add_report_options(parser)
    add_cache(parser)
    add_executors(parser)


def run(arguments: argparse.Namespace) -> int:
    """Measure, or check by measuring again."""
    require("scipy", "measure", "`coursebuild stability`")
    names = tuple(arguments.problems)

    def measure(options: Options) -> Measurement[Any]:
        if arguments.check:
            return check_stability(options, names)
        return stability(options, names, record=arguments.record)

    def as_json(measurement: Measurement[Any]) -> str:
        if measurement.ok and not (arguments.record or arguments.check):
            return json_text(measurement.reports)
        return measurement_json({"cases": measurement.reports}, measurement)

    return run_measurement(
        arguments,
        measure,
        lambda reports, style: "" if arguments.check else stability_text(reports, style),
        as_json,
    )


def stability(
    options: Options, names: tuple[str, ...] = (), *, record: bool = False
) -> Measurement[CaseReport]:
    """Measure the cases of these names, or all without names; `record` writes them down."""
    own_models, built_in = _split(options, names)
    problems = _select_problems(options, built_in) if built_in or not own_models else []
    measurement: Measurement[CaseReport] = Measurement(())
    if problems:
        measurement = _CaseRun(options).all(problems)
        if record and not measurement.failures:
            old: tuple[CaseReport, ...] | ReportFailure = ()
            if names and (options.root / STABILITY.path()).exists():
                old = read_record(options.root, STABILITY)
            if isinstance(old, ReportFailure):
                measurement = replace(measurement, failures=(old,))
            else:
                rest = [c for c in old if c.name in all_problems() and c.name not in problems]
                cases = (*rest, *measurement.reports)
                whole = tuple(sorted(cases, key=lambda case: (case.case, case.name)))
                records = [(STABILITY.path(), STABILITY.encode(whole))]
                measurement = write_records(options.root, measurement, records)
    if not own_models:
        return measurement
    return _join_reports(measurement, bench.bench(options, own_models, record=record))


def _join_reports(
    measurement: Measurement[CaseReport], of_course: Measurement[SceneReport]
) -> Measurement[CaseReport]:
    course_reports = [case for scene in of_course.reports for case in course_cases(scene)]
    return Measurement(
        reports=(*measurement.reports, *course_reports),
        diagnostics=of_course.diagnostics,
        failures=(*measurement.failures, *of_course.failures),
        checked=(*measurement.checked, *of_course.checked),
        remarks=(*measurement.remarks, *of_course.remarks),
    )


def _split(options: Options, names: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The names of models of the course, and those of hard cases."""
    models = tuple(name for name in names if (options.root / f"models/{name}.xml").is_file())
    for scene in find_scenes(options.root, models).value if models else ():
        has_theory = any(
            scenario.expected or scenario.limits or scenario.closed_form
            for scenario in scene.declarations.scenarios
        )
        if not has_theory and not (options.root / exact_file(scene.name)).is_file():
            help = f"give its motion in {exact_file(scene.name)}, "
            help += "or `expected` or `limits` of a scenario"
            raise UsageError(f"no theory is known for `{scene.name}`", help=help)
    return models, tuple(name for name in names if name not in models)


def check_stability(options: Options, names: tuple[str, ...] = ()) -> Measurement[CaseReport]:
    """Measure again, and compare with the record; without a record nothing is measured."""
    own_models, built_in = _split(options, names)
    measurement: Measurement[CaseReport] = Measurement(())
    if built_in or not own_models:
        problems = _select_problems(options, built_in)
        recorded = read_record(options.root, STABILITY)
        if isinstance(recorded, ReportFailure):
            measurement = Measurement((), failures=(recorded,))
        else:
            measurement = _CaseRun(options, use_store=False).all(problems)
            new = {case.name for case in measurement.reports}
            old = [case for case in recorded if not built_in or case.name in new]
            engine = engine_version()
            other_engines = sorted({case.machine.engine for case in old} - {engine})
            remarks = tuple(
                f"recorded with MuJoCo {name}, measured with {engine}" for name in other_engines
            )
            departures = case_departures(old, measurement.reports)
            check = RecordCheck("stability", STABILITY.path(), departures, remarks)
            measurement = replace(measurement, checked=(check,))
    if not own_models:
        return measurement
    return _join_reports(measurement, bench.check(options, own_models))


class _CaseRun(MeasuringRun):
    """Measures hard cases one after the other."""

    function = f"{__name__}:measure_part"

    def all(self, problems: list[str]) -> Measurement[CaseReport]:
        """Measure the problems of these names."""
        self.machine, self.code = machine(pinned=True), code_digest(*_CODE)

        def measure_once(name: str) -> CaseReport | None:
            return self.load_or_measure(
                name, "stability", self._parts(name), CaseReport, lambda: self._measure(name)
            )

        with one_processor():
            return self.measure_each(problems, measure_once)

    def _parts(self, name: str) -> tuple[object, ...]:
        return name, self.code, self.machine

    def tasks(self, name: str) -> Iterator[tuple[Any, ...]]:
        """The case, if it is not stored."""
        if self.load("stability", self._parts(name), CaseReport) is None:
            yield (name,)

    def _measure(self, name: str) -> CaseReport | None:
        if (report := decode(self.results.pop((name,), b""), CaseReport)) is not None:
            return report
        try:
            return measure_case(all_problems()[name], self.machine, time.thread_time_ns)
        except DisagreementError as error:
            help = "neither is known to be right, so errors against them mean nothing"
            self.failures.append(ReportFailure(str(error), help))
            return None


def measure_part(root: Path, data: bytes) -> bytes:
    """Measure a hard case, as a task of `Executor.map`."""
    if (request := read_task(data)) is None:
        return b""
    (name,), timed_machine = request
    try:
        with one_processor():
            return encode(measure_case(all_problems()[name], timed_machine, time.thread_time_ns))
    except DisagreementError:  # which is found and told where the command is
        return b""


def _select_problems(options: Options, names: tuple[str, ...]) -> list[str]:
    """The names of all problems that these names mean; of all problems without names."""
    problem_names = tuple(all_problems())
    selection = set() if names else set(problem_names)
    for name in names:
        matches = {p for p in problem_names if p == name or p.startswith(f"{name}-")}
        if not matches:
            models = {path.stem for path in (options.root / "models").rglob("*.xml")}
            suggestion = nearest(name, (*problem_names, *models))
            all_of_them = "known: " + ", ".join(problem_names)
            help = all_of_them if suggestion is None else f"did you mean `{suggestion}`?"
            raise UsageError(f"no hard case or model is called `{name}`", help=help)
        selection |= matches
    return [problem for problem in problem_names if problem in selection]


def stability_text(reports: Sequence[CaseReport], style: Style) -> str:
    """The reports as text, with a blank line between cases."""
    texts = []
    for report in reports:
        view = case_view(english(), urls.Place(urls.NUMERICS), report)
        number = f"case {report.case}: " if report.case else ""
        lines = [style.paint(report.name, BOLD) + f"  {number}{report.title}"]
        for text in (*view.sentences, *view.notes):
            lines += style.wrap(plain_text(text), "  ")
        for block in (*(grid_lines(grid, style) for grid in view.tables), _errors(report)):
            lines += ["", *(f"  {line}".rstrip() for line in block)] if block else []
        texts.append("\n".join(lines) + "\n")
    return "\n".join(texts)


def _errors(report: CaseReport) -> list[str]:
    """The largest error of each run, by timestep and integrator."""
    quantity = next(iter(case_quantities(report)), None)
    if quantity is None:
        return []
    runs = {(line.timestep, line.integrator): line for line in report.errors}
    steps = sorted({step for step, _ in runs}, reverse=True)

    def cell(run: ErrorLine | None) -> str:
        error = None if run is None else quantity.value_of(run)
        if run is None or error is None:
            return "" if run is None else status_text(run.status)
        return f"<{quantity.least:.1e}" if error <= quantity.least * (1 + 1e-9) else f"{error:.2e}"

    columns = [Column(quantity.label, tuple(seconds_text(h, 4) for h in steps), left=True)]
    for name in dict.fromkeys(name for _, name in runs):
        columns.append(Column(name, tuple(cell(runs.get((step, name))) for step in steps)))
    return table(columns)
