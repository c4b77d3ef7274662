"""`coursebuild bench`: speed against error of the course's models.

Entry points: `bench(options, names, …)`, `check(…)`; `bench_text(scenes, style)`, the tables of the
models' pages, on a terminal.

1. Names mean models. One that does not compile is reported, and the others are measured.
2. Each scenario's report is stored by all that it depends on, so that a run that was stopped goes
   on where it was. Times are true of this machine only, so reports are not shared.
3. Recording writes the reports into `content/reports/`; checking measures again, whatever is
   stored, and compares figures of accuracy with what is recorded there.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any, TypeVar

from msgspec.structs import replace

from coursebuild.cli.arguments import add_cache, add_format, add_quiet
from coursebuild.core.engine.tool import code_digest
from coursebuild.core.files.errors import require
from coursebuild.core.run.script_environment import machine
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.features.bench.commands import measuring
from coursebuild.features.bench.commands.engines import (
    bench_engines,
    chosen_engines,
    engines_text,
)
from coursebuild.features.bench.commands.measurement import (
    Measurement,
    MeasuringRun,
    add_report_options,
    english,
    forbid_quick,
    grid_lines,
    measurement_json,
    plain_text,
    run_measurement,
    write_records,
)
from coursebuild.features.bench.grids import Grid, machine_text, power
from coursebuild.features.bench.scenario_view import scenario_view
from coursebuild.numerics.reports.records import BENCH, RecordCheck, ReportFailure, scene_departures
from coursebuild.numerics.reports.scene_report import (
    ScenarioReport,
    SceneReport,
    SweepReport,
    WorkPrecisionRow,
)
from coursebuild.numerics.reports.shown_errors import is_idle
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.scenes import CourseScene, find_scenes
from coursebuild.pipeline.shown_reports import read_record
from coursebuild.report.text import BOLD, FAINT, GREEN, RED, YELLOW, Style, visible

_T = TypeVar("_T")
_CODE = (
    "coursebuild/numerics",
    "coursebuild/features/bench/commands/measuring.py",
    "mjcourse/spatial",
)
"""The code on which reports depend."""
_INDENT = "  "
EXAMPLES = """\
examples:
  coursebuild bench --quick              a first look at all models
  coursebuild bench pendulum --record    what its page shows
  coursebuild bench pendulum --engines   the same model in other engines
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_quiet(parser)
    parser.add_argument(
        "scenes", nargs="*", metavar="SCENE", help="a model, as in models/SCENE.xml (default: all)"
    )
    add_format(parser, "text", "json")
    parser.add_argument(
        "--quick", action="store_true", help="fewer settings and rough times, for a first look"
    )
    parser.add_argument(
        "--engines",
        nargs="?",
        const="",
        metavar="NAMES",
        help="measure other engines instead: all that are installed, or some, as in mjx,warp",
    )
    add_report_options(parser)
    add_cache(parser)


def run(arguments: argparse.Namespace) -> int:
    """Measure models, or check their recorded reports."""
    require("scipy", "measure", "`coursebuild bench`")
    names, quick = tuple(arguments.scenes), arguments.quick
    if arguments.engines is not None:
        return _run_engines(arguments, names)

    def measure(options: Options) -> Measurement[Any]:
        if arguments.check:
            return check(options, names, quick=quick)
        return bench(options, names, quick=quick, record=arguments.record)

    return run_measurement(
        arguments,
        measure,
        lambda reports, style: "" if arguments.check else bench_text(reports, style),
        lambda measurement: measurement_json({"scenes": measurement.reports}, measurement),
        empty="there is no model to measure\n",
    )


def _run_engines(arguments: argparse.Namespace, names: tuple[str, ...]) -> int:
    """Measure models in other engines."""
    if arguments.check:
        message = "--check takes no --engines: 32 bits do not repeat from one device to the next"
        raise UsageError(message)
    engines, remarks = chosen_engines(arguments.engines)
    return run_measurement(
        arguments,
        lambda options: bench_engines(
            options, names, engines, remarks, quick=arguments.quick, record=arguments.record
        ),
        engines_text,
        lambda measurement: measurement_json({"engines": measurement.reports}, measurement),
        empty="there is no model to measure\n",
    )


def bench(
    options: Options,
    names: tuple[str, ...] = (),
    *,
    quick: bool = False,
    record: bool = False,
    measuring: Any = measuring,
) -> Measurement[SceneReport]:
    """Measure the models that the names mean; without names, all.

    `record`: each model's report is also written into the course. `measuring`: the module that
    measures.

    Raises:
        UsageError: no model is called so, or only a part is to be recorded.
    """
    if record:
        forbid_quick("--record", quick=quick)
    scenes = find_scenes(options.root, names)
    run = SceneRun(options, scenes.diagnostics, measuring, quick=quick, cards=record)
    measurement = run.measure_each(scenes.value, run.measure)
    if not record:
        return measurement
    records = ((BENCH.path(report.model), BENCH.encode(report)) for report in measurement.reports)
    return write_records(options.root, measurement, records)


def check(
    options: Options,
    names: tuple[str, ...] = (),
    *,
    quick: bool = False,
    measuring: Any = measuring,
) -> Measurement[SceneReport]:
    """Measure again, and compare with the recorded reports.

    A model without a recorded report, or with one that cannot be read, is not measured.

    Raises:
        UsageError: no model is called so, or only a part is to be measured.
    """
    forbid_quick("--check", quick=quick)
    scenes = find_scenes(options.root, names)
    run = SceneRun(options, scenes.diagnostics, measuring, use_store=False)
    recorded: dict[str, SceneReport] = {}
    for scene in scenes.value:
        report = read_record(options.root, BENCH, scene.name)
        if isinstance(report, ReportFailure):
            run.failures.append(report)
        else:
            recorded[scene.name] = report
    by_name = {scene.name: scene for scene in scenes.value if scene.name in recorded}
    measurement = run.measure_each(tuple(by_name.values()), run.measure)
    checks = [
        _compare(recorded[report.model], report, by_name[report.model])
        for report in measurement.reports
    ]
    return replace(measurement, checked=tuple(checks))


def _compare(recorded: SceneReport, report: SceneReport, scene: CourseScene) -> RecordCheck:
    remarks = []
    if recorded.digest != report.digest:
        remarks.append("the model or its scenarios have changed since it was recorded")
    old, new = recorded.machine, report.machine
    for program, before, now in (
        ("MuJoCo ", old.engine, new.engine),
        ("NumPy ", old.numpy, new.numpy),
        ("Python ", old.python, new.python),
        ("", old.system, new.system),
    ):
        if before != now:
            remarks.append(f"recorded with {program}{before}, measured with {now}")
    departures = scene_departures(recorded, report, scene.declarations.bench)
    return RecordCheck(report.model, BENCH.path(report.model), departures, tuple(remarks))


class SceneRun(MeasuringRun):
    """Measures scenes one after the other."""

    def __init__(
        self,
        options: Options,
        diagnostics: Sequence[Diagnostic],
        measuring: Any,
        *,
        quick: bool = False,
        use_store: bool = True,
        cards: bool = False,
    ) -> None:
        super().__init__(options, diagnostics, use_store=use_store)
        self.quick = quick
        self.cards = cards
        """Whether reports also say what the models are made of."""
        self.measuring = measuring
        self.machine = machine(pinned=True)
        self.code = code_digest(*_CODE)

    def measure(self, scene: CourseScene) -> SceneReport | None:
        """Report on a scene; `None` if it cannot be measured."""
        parts = (scene.name, scene.digest, self.quick, self.code, self.machine)
        all_parts = (*parts, self.cards)
        return self.load_or_measure(
            scene.name, "bench", all_parts, SceneReport, lambda: self._report(scene, parts)
        )

    def _report(self, scene: CourseScene, parts: tuple[object, ...]) -> SceneReport:
        # A check compares no times, so it measures none.
        root, timed, name = self.options.root, self.use_store, scene.name
        compiled_scene = self.measuring.compile_scene(root, scene, quick=self.quick)

        def tell(text: str) -> None:
            self.progress.describe(name, text)

        settings = {"quick": self.quick, "timed": timed, "tell": tell}
        report = SceneReport(
            model=name,
            digest=scene.digest,
            quick=self.quick,
            machine=self.machine,
            scenarios=tuple(
                self._load_or_measure_part(
                    "bench-scenarios",
                    (*parts, n),
                    ScenarioReport,
                    partial(self.measuring.run_scenario, compiled_scene, n, **settings),
                )
                for n in range(len(compiled_scene.scenarios))
            ),
            sweeps=tuple(
                self._load_or_measure_part(
                    "bench-sweeps",
                    (*parts, sweep.name),
                    SweepReport,
                    partial(self.measuring.run_sweep, compiled_scene, sweep, **settings),
                )
                for sweep in scene.declarations.sweeps
            ),
        )
        if self.cards and report.scenarios:
            tell("what it is made of")
            report = self.measuring.add_card(root, scene, report)
        return report

    def _load_or_measure_part(
        self, kind: str, parts: tuple[object, ...], report_type: type[_T], measure: Callable[[], _T]
    ) -> _T:
        """Load the report on a scenario or a sweep, or measure it now."""
        report = self.load(kind, parts, report_type)
        if report is None:
            report = measure()
            self.save(kind, parts, report)
        return report


_OWN_MARK, _FRONT_MARK = ">", "*"


def bench_text(scenes: Sequence[SceneReport], style: Style) -> str:
    """Write every model with its scenarios, and a blank line between models."""
    return "\n".join(_scene(scene, style) for scene in scenes)


def _scene(scene: SceneReport, style: Style) -> str:
    head = style.paint(visible(scene.model), BOLD)
    if scene.quick:
        head += "  " + style.paint("quick: fewer settings, rough times", YELLOW)
    lines = [head, *style.wrap(machine_text(english(), scene.machine), _INDENT)]
    if not scene.scenarios:
        lines.append(f"{_INDENT}nothing in it can move, so nothing was measured")
    for scenario in scene.scenarios:
        lines += ["", *_scenario(scenario, style)]
    for sweep in scene.sweeps:
        view = scenario_view(english(), sweep)
        marks = (((_OWN_MARK, BOLD) if row.own else (" ", "")) for row in sweep.rows)
        lines += ["", _title(sweep.name, sweep.title, style)]
        lines += _table(view.settings, marks, f"{_OWN_MARK} as the model is", style)
        lines += _notes(view.notes, style)
    return "\n".join(lines) + "\n"


def _scenario(report: ScenarioReport, style: Style) -> list[str]:
    view = scenario_view(english(), report)
    lines = [_title(report.name, report.title, style)]
    texts = [plain_text(text) for text in view.description]
    if report.figure:  # a page says this and the next in its plot
        texts.append(f"It measures {report.figure}.")
    if report.velocity_floor > report.floor:
        texts.append(f"Velocities are known to {plain_text(power(report.velocity_floor, 1))}.")
    for text in (*texts, *report.notes):
        lines += style.wrap(text, 2 * _INDENT)
    legend = f"{_OWN_MARK} the scene's own   {_FRONT_MARK} on the Pareto front"
    shown_rows = (row for row in report.rows if not is_idle(row))
    lines += _table(view.settings, map(_mark, shown_rows), legend, style)
    colour = GREEN if report.verdict.on_front and not report.verdict.noticeable else YELLOW
    if report.verdict.text:
        lines += ["", *style.wrap(report.verdict.text, 2 * _INDENT, colour)]
    for grid in (view.orders, view.stable):
        if grid is not None:
            lines += ["", *(f"{2 * _INDENT}{line}".rstrip() for line in grid_lines(grid, style))]
    return [*lines, *_notes(view.notes, style)]


def _title(name: str, title: str, style: Style) -> str:
    return _INDENT + style.paint(visible(name), BOLD) + (f"  {visible(title)}" if title else "")


def _table(
    grid: Grid, marks: Iterable[tuple[str, str]], legend: str, style: Style
) -> Iterator[str]:
    yield ""
    if not grid.rows:
        yield f"{2 * _INDENT}no setting was measured"
        return
    _, *lines = grid_lines(grid, style, tuple(marks))
    for line in (*lines, style.paint(legend, FAINT)):
        yield f"{2 * _INDENT}{line}".rstrip()


def _mark(row: WorkPrecisionRow) -> tuple[str, str]:
    code = BOLD if row.own else RED if row.status in ("diverged", "reset") else ""
    code = code or (YELLOW if row.status != "ok" else GREEN if row.front else "")
    return (_OWN_MARK if row.own else " ") + (_FRONT_MARK if row.front else " "), code


def _notes(notes: Sequence[str], style: Style) -> list[str]:
    return ["" for _ in notes[:1]] + [
        line for note in notes for line in style.wrap(note, 2 * _INDENT, YELLOW)
    ]
