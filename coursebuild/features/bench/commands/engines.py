"""`coursebuild bench --engines`: the course's models in other engines."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import Options, UsageError
from coursebuild.core.model.measurements import EngineReport
from coursebuild.core.model.report_files import ENGINES
from coursebuild.features.bench.commands.measurement import (
    Measurement,
    MeasuringRun,
    english,
    file_of,
    forbid_quick,
    grid_lines,
    measurement_json,
    plain_text,
    run_measurement,
    write_records,
)
from coursebuild.features.bench.commands.measuring import FailedJobError, Mjbench
from coursebuild.features.bench.grids import machine_text
from coursebuild.features.bench.scenario_view import engine_view
from coursebuild.pipeline.scenes import CourseScene, find_scenes
from coursebuild.report.text import BOLD, YELLOW, Style, visible

_INDENT = "  "


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
            return bench_engines(
                options,
                mjbench,
                tuple(arguments.scenes),
                choose_engines(mjbench, arguments.engines),
                quick=arguments.quick,
                record=arguments.record,
            )

    return run_measurement(
        arguments,
        measure,
        engines_text,
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
    records = [
        (ENGINES.path(report.model), file_of(mjbench, engines=value))
        for report, value in zip(measurement.reports, measurement.values, strict=True)
    ]
    outcome = write_records(options.root, measurement, records)
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


def engines_text(reports: Sequence[EngineReport], style: Style) -> str:
    """Write every model with its scenarios in other engines."""
    texts = []
    for report in reports:
        head = style.paint(visible(report.model), BOLD)
        if report.quick:
            head += "  " + style.paint("quick: at most 64 worlds", YELLOW)
        lines = [head, *style.wrap(machine_text(english(), report.machine), _INDENT)]
        for scenario in report.scenarios:
            view = engine_view(english(), scenario, report)
            lines += ["", _INDENT + style.paint(visible(view.title), BOLD)]
            for text in view.description:
                lines += style.wrap(plain_text(text), 2 * _INDENT)
            _, *grid_text = grid_lines(view.table, style)
            lines += ["", *(f"{2 * _INDENT}{line}".rstrip() for line in grid_text)]
            for note in view.notes:
                lines += style.wrap(note, 2 * _INDENT, YELLOW)
        texts.append("\n".join(lines) + "\n")
    return "\n".join(texts)
