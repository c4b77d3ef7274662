"""`coursebuild bench`: speed against error of the course's models; `--engines`: in other engines.

1. Each scenario's report is stored by all that it depends on, so that a run that was stopped goes
   on where it was. Times are true of this machine only, so reports are not shared.
2. Recording writes the reports into `content/reports/`; checking measures again, whatever is
   stored, and compares figures of accuracy with what is recorded there.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from typing import Any

import msgspec
from msgspec import Raw, Struct
from msgspec.structs import replace

from coursebuild.api import Diagnostic, Options, UsageError
from coursebuild.core.model.measurements import EngineReport, SceneReport
from coursebuild.core.model.report_files import BENCH, ENGINES, ReportFailure
from coursebuild.core.model.scenarios import keyframe_scenarios
from coursebuild.features.bench.commands.measurement import (
    Departure,
    Measurement,
    MeasuringRun,
    RecordCheck,
    add_report_options,
    forbid_quick,
    in_words,
    measurement_json,
    record_reports,
    recorded_value,
    run_measurement,
    task_of,
)
from coursebuild.features.bench.commands.measuring import FailedJobError, Mjbench
from coursebuild.pipeline.arguments import add_cache, add_executors, add_format, add_quiet
from coursebuild.pipeline.scenes import CourseScene, find_scenes, read_record

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
    add_executors(parser)


def run(arguments: argparse.Namespace) -> int:
    """Measure models, or check their recorded reports."""
    names, quick, record = tuple(arguments.scenes), arguments.quick, arguments.record
    if arguments.engines is not None:
        if arguments.check:
            raise UsageError(
                "--check takes no --engines: 32 bits do not repeat from one device to the next"
            )
        if arguments.executor is not None:
            raise UsageError("--engines measures engines on this machine, not on others")
    report, field = ("bench", "scenes") if arguments.engines is None else ("engines", "engines")

    def measure(options: Options, mjbench: Mjbench) -> Measurement[Any]:
        if arguments.check:
            return check(options, mjbench, names, quick=quick)
        measurement: Measurement[Any]
        if arguments.engines is None:
            measurement = bench(options, mjbench, names, quick=quick, record=record)
        else:
            choice = choose_engines(mjbench, arguments.engines)
            measurement = bench_engines(options, mjbench, names, choice, quick=quick, record=record)
        return in_words(arguments, mjbench, report, measurement)

    return run_measurement(
        arguments,
        "bench",
        measure,
        lambda measurement: measurement_json({field: measurement.values}, measurement),
        empty="there is no model to measure\n",
    )


def bench(
    options: Options,
    mjbench: Mjbench,
    names: tuple[str, ...] = (),
    *,
    quick: bool = False,
    record: bool = False,
) -> Measurement[SceneReport]:
    """Measure the models that the names mean, without names all; with `record` into the course."""
    if record:
        forbid_quick("--record", quick=quick)
    scenes = find_scenes(options.root, names)
    run = SceneRun(options, mjbench, scenes.diagnostics, quick=quick, cards=record)
    measurement = run.measure_each(scenes.value)
    if record:
        return record_reports(options.root, mjbench, BENCH, "bench", measurement)
    return measurement


def check(
    options: Options, mjbench: Mjbench, names: tuple[str, ...] = (), *, quick: bool = False
) -> Measurement[SceneReport]:
    """Measure again, and compare with the recorded reports.

    A model without a recorded report, or with one that cannot be read, is not measured.
    """
    forbid_quick("--check", quick=quick)
    scenes = find_scenes(options.root, names)
    run = SceneRun(options, mjbench, scenes.diagnostics, use_store=False)
    recorded: dict[str, SceneReport] = {}
    for scene in scenes.value:
        report = read_record(options.root, BENCH, scene.name)
        if isinstance(report, ReportFailure):
            run.failures.append(report)
        else:
            recorded[scene.name] = report
    by_name = {scene.name: scene for scene in scenes.value if scene.name in recorded}
    measurement = run.measure_each(tuple(by_name.values()))
    checks = []
    for report, value in zip(measurement.reports, measurement.values, strict=True):
        record, remarks = recorded[report.model], []
        if record.digest != report.digest:
            remarks.append("the model or its scenarios have changed since it was recorded")
        old, new = record.machine, report.machine
        for program, before, now in (
            ("MuJoCo ", old.engine, new.engine),
            ("NumPy ", old.numpy, new.numpy),
            ("Python ", old.python, new.python),
            ("", old.system, new.system),
        ):
            if before != now:
                remarks.append(f"recorded with {program}{before}, measured with {now}")
        path = BENCH.path(report.model)
        bands = by_name[report.model].declarations.bench
        old_value = recorded_value(options.root, BENCH, report.model)
        data = mjbench.do("compare", recorded=old_value, measurement=value, bands=bands)
        departures = msgspec.json.decode(data, type=tuple[Departure, ...])
        checks.append(RecordCheck(report.model, path, departures, tuple(remarks)))
    return replace(measurement, checked=tuple(checks))


class SceneRun(MeasuringRun[SceneReport]):
    """Measures scenes one after the other."""

    report_type, kind = SceneReport, "bench"

    def __init__(
        self,
        options: Options,
        mjbench: Mjbench,
        diagnostics: Sequence[Diagnostic],
        *,
        quick: bool = False,
        use_store: bool = True,
        cards: bool = False,
    ) -> None:
        super().__init__(options, mjbench, diagnostics, use_store=use_store)
        self.quick = quick
        self.cards = cards
        """Whether reports also say what the models are made of."""

    def measure(self, scene: CourseScene) -> bytes | None:
        """Report on a scene; `None` if it cannot be measured."""
        parts = self._parts(scene)
        return self.load_or_measure(scene, (*parts, self.cards), lambda: self._report(scene, parts))

    def _parts(self, scene: CourseScene) -> tuple[object, ...]:
        return scene.name, scene.digest, self.quick, self.code, self.facts.pinned

    def tasks(self, scene: CourseScene) -> Iterator[tuple[Any, ...]]:
        """The scenarios of a scene, and its sweeps, that are not stored."""
        parts = self._parts(scene)
        if self.load(self.kind, (*parts, self.cards), bytes) is not None:
            return
        for job, key in self._jobs(scene):
            if self.load(f"bench-{job}", (*parts, *key.values()), bytes) is None:
                yield task_of(job, scene, **key, **self._settings())

    def _jobs(self, scene: CourseScene) -> Iterator[tuple[str, dict[str, Any]]]:
        """The sweeps of a scene, and its scenarios."""
        # Sweeps come first, since a value that the model cannot have is told at once.
        yield from (("sweep", {"name": sweep.name}) for sweep in scene.declarations.sweeps)
        yield from (("scenario", {"number": number}) for number in range(_scenario_count(scene)))

    def _report(self, scene: CourseScene, parts: tuple[object, ...]) -> bytes:
        reports: dict[str, list[Raw]] = {"sweep": [], "scenario": []}
        for job, key in self._jobs(scene):
            place = f"bench-{job}", (*parts, *key.values())
            data = self.load(*place, bytes)
            if data is None:
                data = self.do_job(job, scene, **key, **self._settings())
                self.save(*place, data)
            reports[job].append(Raw(data))
        values = {
            "scenarios": reports["scenario"],
            "sweeps": reports["sweep"],
            "quick": self.quick,
        }
        return self.mjbench.do("join", scene, **values, card=self.cards)

    def _settings(self) -> dict[str, bool]:
        # A check compares no times, so it measures none.
        return {"quick": self.quick, "timed": self.use_store}


def _scenario_count(scene: CourseScene) -> int:
    """How many scenarios are measured: none that nobody declared where nothing can move."""
    scenarios = scene.declarations.scenarios
    usual = keyframe_scenarios(scene.facts.keyframes) if scene.facts.nv else ()
    return len(scenarios or usual)


class EngineChoice(Struct, frozen=True):
    """Engines by name, with the versions of their packages, and what is not installed."""

    engines: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
    remarks: tuple[str, ...]


def choose_engines(mjbench: Mjbench, text: str) -> EngineChoice:
    """The engines that an option names; if it is empty, all that are installed."""
    names = [name.strip() for name in text.split(",") if name.strip()]
    try:
        return msgspec.json.decode(mjbench.do("choose-engines", names=names), type=EngineChoice)
    except FailedJobError as error:
        raise UsageError(str(error), help=error.failure.help) from None


def bench_engines(
    options: Options,
    mjbench: Mjbench,
    names: tuple[str, ...],
    choice: EngineChoice,
    *,
    quick: bool = False,
    record: bool = False,
) -> Measurement[EngineReport]:
    """Measure the models that the names mean in other engines; with `record` into the course."""
    if record:
        forbid_quick("--record", quick=quick)
    scenes = find_scenes(options.root, names)
    run = _EngineRun(options, mjbench, scenes.diagnostics)
    run.choice, run.quick = choice, quick
    run.remarks += choice.remarks
    measurement = run.measure_each(scenes.value)
    if record:
        return record_reports(options.root, mjbench, ENGINES, "engines", measurement)
    return measurement


class _EngineRun(MeasuringRun[EngineReport]):
    """Measures scenes in engines, one after the other."""

    report_type, kind = EngineReport, "bench-engines"
    choice: EngineChoice
    quick = False

    def measure(self, scene: CourseScene) -> bytes | None:
        """Report on a scene; `None` if it cannot be measured."""
        engines = self.choice.engines
        parts = (scene.name, scene.digest, self.quick, self.code, self.facts.machine, engines)
        names = [name for name, _ in engines]
        return self.load_or_measure(
            scene, parts, lambda: self.mjbench.do("engines", scene, names=names, quick=self.quick)
        )
