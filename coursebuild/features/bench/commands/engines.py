"""`coursebuild bench --engines`: the course's models in other engines.

An engine runs in a process of its own for each of its variants: if that dies, takes too long or
refuses the model, its row says so, and the others go on. Four thousand worlds are not tried where
64 say that they would take too long.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path

import msgspec
import mujoco
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.tool import code_digest
from coursebuild.core.files.errors import EffectError, UsageError, require
from coursebuild.core.files.locks import temporary_folder
from coursebuild.core.run.child import JsonChild
from coursebuild.core.run.script_environment import machine, package_version
from coursebuild.core.text.diagnostics import did_you_mean
from coursebuild.features.bench.commands import engine_main, measuring
from coursebuild.features.bench.commands.engine_main import Reply, Request
from coursebuild.features.bench.commands.measurement import (
    Measurement,
    MeasuringRun,
    english,
    forbid_quick,
    grid_lines,
    measurement_json,
    plain_text,
    run_measurement,
    write_records,
)
from coursebuild.features.bench.grids import machine_text
from coursebuild.features.bench.scenario_view import engine_view
from coursebuild.numerics.engines import MODULES
from coursebuild.numerics.engines.engine_trial import (
    Engine,
    EngineBasis,
    EngineTrial,
    engine_basis,
    judge_motion,
)
from coursebuild.numerics.reports.engine_report import (
    WORLDS,
    BatchCost,
    EngineReport,
    EngineRow,
    row_name,
)
from coursebuild.numerics.reports.records import ENGINES
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.scenes import CourseScene, find_scenes
from coursebuild.report.text import BOLD, YELLOW, Style, visible

_CODE = ("coursebuild/numerics", "coursebuild/features/bench/commands", "mjcourse/spatial")
"""The code on which reports depend."""
SECONDS = 900.0
"""Of the wall, for one answer of an engine; what it compiles is among it."""
_MEMORY = 16 << 10
"""MiB that an engine may take: 4,096 worlds need more than a script does."""
_ROUNDS = 12
"""About how often a step is made for its time to be known."""
_INDENT = "  "


class ChosenEngine(Struct, frozen=True):
    """An engine to measure."""

    name: str
    module: str
    """Where its table is."""
    engine: Engine

    @property
    def versions(self) -> tuple[tuple[str, str], ...]:
        """Its packages, with the versions that are installed."""
        return tuple((name, package_version(name)) for name in self.engine.packages)


def run_engines(arguments: argparse.Namespace) -> int:
    """Measure models in other engines."""
    if arguments.check:
        message = "--check takes no --engines: 32 bits do not repeat from one device to the next"
        raise UsageError(message)
    if arguments.executor is not None:
        raise UsageError("--engines measures engines on this machine, not on others")
    engines, remarks = chosen_engines(arguments.engines)
    return run_measurement(
        arguments,
        lambda options: bench_engines(
            options,
            tuple(arguments.scenes),
            engines,
            remarks,
            quick=arguments.quick,
            record=arguments.record,
        ),
        engines_text,
        lambda measurement: measurement_json({"engines": measurement.reports}, measurement),
        empty="there is no model to measure\n",
    )


def chosen_engines(
    text: str, modules: Iterable[str] = MODULES
) -> tuple[tuple[ChosenEngine, ...], tuple[str, ...]]:
    """The engines that an option names; if it is empty, all that are installed.

    The second is a remark about each that is not installed, where none was named. An `EffectError`
    where the package of one that was named is missing.
    """
    engines = {
        name: ChosenEngine(name, module, engine)
        for module in modules
        for name, engine in importlib.import_module(module).ENGINES.items()
    }
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    for name in names:
        if name not in engines:
            help = str(did_you_mean(name, engines))
            raise UsageError(f"there is no engine `{name}`", help=help)
        require(engines[name].engine.module, "engines", f"the engine `{name}`")
    if names:
        return tuple(engines[name] for name in names), ()
    installed, remarks = [], []
    for choice in engines.values():
        try:
            is_installed = find_spec(choice.engine.module) is not None
        except ModuleNotFoundError:  # not even its package
            is_installed = False
        if is_installed:
            installed.append(choice)
        else:
            command = "`pip install 'coursebuild[engines]'`"
            remarks.append(f"{choice.engine.title} is not installed: {command} brings it")
    return tuple(installed), tuple(remarks)


def bench_engines(
    options: Options,
    names: tuple[str, ...],
    engines: tuple[ChosenEngine, ...],
    remarks: tuple[str, ...] = (),
    *,
    quick: bool = False,
    record: bool = False,
    seconds: float = SECONDS,
) -> Measurement[EngineReport]:
    """Measure the models that the names mean in other engines; with `record` into the course."""
    if record:
        forbid_quick("--record", quick=quick)
    scenes = find_scenes(options.root, names)
    run = _EngineRun(options, engines, quick=quick, seconds=seconds)
    run.diagnostics += scenes.diagnostics
    run.remarks += remarks
    measurement = run.measure_each(scenes.value, run.measure)
    if not record:
        return measurement
    records = (
        (ENGINES.path(report.model), ENGINES.encode(report)) for report in measurement.reports
    )
    outcome = write_records(options.root, measurement, records)
    return replace(outcome, remarks=(*measurement.remarks, *outcome.remarks))


class _EngineRun(MeasuringRun):
    """Measures scenes in engines, one after the other."""

    def __init__(
        self, options: Options, engines: tuple[ChosenEngine, ...], *, quick: bool, seconds: float
    ) -> None:
        super().__init__(options)
        self.engines, self.quick, self.seconds = engines, quick, seconds
        self.machine = machine()
        self.code = code_digest(*_CODE)

    def measure(self, scene: CourseScene) -> EngineReport | None:
        """Report on a scene; `None` if it cannot be measured."""
        versions = [(choice.name, choice.versions) for choice in self.engines]
        parts = (scene.name, scene.digest, self.quick, self.code, self.machine, versions)
        return self.load_or_measure(
            scene.name, "bench-engines", parts, EngineReport, lambda: self._engine_report(scene)
        )

    def _engine_report(self, scene: CourseScene) -> EngineReport:
        compiled_scene = measuring.compile_scene(self.options.root, scene, quick=self.quick)
        load, scenarios = os.getloadavg()[0], []
        with measuring.report_errors(scene), temporary_folder() as folder:
            path = str(Path(folder, "model.mjb"))
            mujoco.mj_saveModel(compiled_scene.model, path, None)
            for physics in compiled_scene.scenarios:
                self.progress.describe(scene.name, f"{physics.name}: the reference")
                basis = engine_basis(compiled_scene.model, physics, quick=self.quick)
                trial = EngineTrial(path, physics.scenario, len(physics.scenario.times))
                rows = tuple(
                    row for choice in self.engines for row in self._rows(choice, basis, trial)
                )
                scenarios.append(replace(basis.report, rows=rows))
        return EngineReport(
            scene.name, scene.digest, self.quick, self.machine, load, tuple(scenarios)
        )

    def _rows(
        self, choice: ChosenEngine, basis: EngineBasis, trial: EngineTrial
    ) -> Iterator[EngineRow]:
        """A row for each way to run an engine; one that says why there is none."""
        row = EngineRow(
            engine=choice.name,
            title=choice.engine.title,
            versions=choice.versions,
            status="ok",
            position=None,
            attitude=None,
            velocity=None,
        )
        with _EngineChild(choice, self.seconds) as child:
            reply = child.reply(action="list")
        if reply.refusal:
            yield _refuse(row, reply)
            return
        for variant in reply.variants:
            named_row = replace(row, **msgspec.structs.asdict(variant))
            self.progress.describe(basis.pilot.scene.name, row_name(named_row))
            with _EngineChild(choice, self.seconds) as child:
                reply = child.reply(action="motion", variant=variant, trial=trial)
                if reply.motion is None:
                    yield _refuse(named_row, reply)
                    continue
                named_row = judge_motion(basis, named_row, reply.motion)
                costs, expected = [_batch_cost(1, reply)], 0.0
                counts = WORLDS[1:2] if self.quick else WORLDS[1:]
                for worlds in counts if choice.engine.batched else ():
                    if expected * worlds * _ROUNDS > self.seconds:
                        remark = f"not tried: a step would take about {expected * worlds:.2g} s"
                        costs.append(BatchCost(worlds, remark=remark))
                        continue
                    reply = child.reply(action="costs", variant=variant, trial=trial, worlds=worlds)
                    expected = 0.0 if reply.cost is None else reply.cost.seconds.value
                    costs.append(_batch_cost(worlds, reply))
                yield replace(named_row, costs=tuple(costs))


def _refuse(row: EngineRow, reply: Reply) -> EngineRow:
    status = "unsupported" if reply.unsupported else "failed"
    return replace(row, status=status, message=reply.refusal)


def _batch_cost(worlds: int, reply: Reply) -> BatchCost:
    if (cost := reply.cost) is None:
        return BatchCost(worlds, remark=reply.refusal)
    return BatchCost(worlds, cost.seconds, cost.ratio, cost.compile_seconds)


class _EngineChild(JsonChild):
    """The process of an engine; it is started again after it died."""

    def __init__(self, choice: ChosenEngine, seconds: float) -> None:
        # It is killed after ten times as long as it may compute, which is not limited here.
        super().__init__(engine_main.__file__, seconds / 10, memory=_MEMORY)
        self._choice, self._wall = choice, seconds

    def reply(self, **request: object) -> Reply:
        """What the engine says; a refusal where its process crashed or took too long."""
        choice, processors = self._choice, machine().processors
        question = Request(tuple(sys.path), choice.module, choice.name, processors, **request)  # type: ignore[arg-type]
        try:
            answer = self.ask(msgspec.to_builtins(question))
        except EffectError as error:
            return Reply(refusal=error.message)
        if answer is not None:
            return msgspec.convert(answer, Reply)
        death = self.death()
        if self.timed_out:
            death = f"took longer than {self._wall:g} s"
        return Reply(refusal=f"its process {death}")


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
