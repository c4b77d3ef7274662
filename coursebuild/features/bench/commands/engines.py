"""`coursebuild bench --engines`: the course's models in other engines."""

from __future__ import annotations

import argparse

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import Options, UsageError
from coursebuild.core.model.measurements import EngineReport
from coursebuild.core.model.report_files import ENGINES
from coursebuild.features.bench.commands.measurement import (
    Measurement,
    MeasuringRun,
    forbid_quick,
    in_words,
    measurement_json,
    record_reports,
    run_measurement,
)
from coursebuild.features.bench.commands.measuring import FailedJobError, Mjbench
from coursebuild.pipeline.scenes import CourseScene, find_scenes


class EngineChoice(Struct, frozen=True):
    """Engines by name, with the versions of their packages, and what is not installed."""

    engines: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
    remarks: tuple[str, ...]


def run_engines(arguments: argparse.Namespace) -> int:
    """Measure models in other engines."""
    if arguments.check:
        message = "--check takes no --engines: 32 bits do not repeat from one device to the next"
        raise UsageError(message)
    if arguments.executor is not None:
        raise UsageError("--engines measures engines on this machine, not on others")

    def measure(options: Options) -> Measurement[EngineReport]:
        with Mjbench(options.root, "`coursebuild bench`") as mjbench:
            measurement = bench_engines(
                options,
                mjbench,
                tuple(arguments.scenes),
                choose_engines(mjbench, arguments.engines),
                quick=arguments.quick,
                record=arguments.record,
            )
            return in_words(arguments, mjbench, "engines", measurement)

    return run_measurement(
        arguments,
        measure,
        lambda measurement: measurement_json({"engines": measurement.values}, measurement),
        empty="there is no model to measure\n",
    )


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
    measurement = run.measure_each(scenes.value, run.measure)
    if not record:
        return measurement
    outcome = record_reports(options.root, mjbench, ENGINES, "engines", measurement)
    return replace(outcome, remarks=(*measurement.remarks, *outcome.remarks))


class _EngineRun(MeasuringRun[EngineReport]):
    """Measures scenes in engines, one after the other."""

    report_type = EngineReport
    choice: EngineChoice
    quick = False

    def measure(self, scene: CourseScene) -> bytes | None:
        """Report on a scene; `None` if it cannot be measured."""
        engines = self.choice.engines
        parts = (scene.name, scene.digest, self.quick, self.code, self.facts.machine, engines)
        names = [name for name, _ in engines]
        return self.load_or_measure(
            scene.name,
            "bench-engines",
            parts,
            lambda: self.mjbench.do("engines", scene, names=names, quick=self.quick),
            scene,
        )
