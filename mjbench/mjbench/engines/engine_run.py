"""A model in other engines.

An engine runs in a process of its own for each of its variants: if that dies, takes too long or
refuses the model, its row says so, and the others go on. Four thousand worlds are not tried where
64 say that they would take too long.
"""

from __future__ import annotations

import importlib
import os
import tempfile
from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path

import mujoco
from msgspec import Struct
from msgspec.structs import asdict, replace

from mjbench.bench import (
    CannotMeasureError,
    Subject,
    compile_subject,
    report_errors,
)
from mjbench.engines import MODULES
from mjbench.engines.engine_trial import (
    Engine,
    EngineChild,
    EngineTrial,
    Reply,
    Request,
    engine_basis,
    engine_scenario,
    judge_motion,
)
from mjbench.host import Host
from mjbench.machine import package_version, this_machine
from mjbench.measured_setting import Basis
from mjbench.reports.model_report import WORLDS, BatchCost, EngineReport, EngineRow
from mjbench.simulation import EngineStates

SECONDS = 900.0
"""Of the wall, for one answer of an engine; what it compiles is among it."""
_ROUNDS = 12
"""About how often a step is made for its time to be known."""


class UnknownEngineError(Exception):
    """There is no engine of a name, or its package is not installed."""


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


def chosen_engines(
    names: Iterable[str] = (), modules: Iterable[str] = MODULES
) -> tuple[tuple[ChosenEngine, ...], tuple[str, ...]]:
    """The engines of these names; without names, all that are installed.

    The second is a remark about each that is not installed, where none was named. An
    `UnknownEngineError` where one that was named is not there.
    """
    engines = {
        name: ChosenEngine(name, module, engine)
        for module in modules
        for name, engine in importlib.import_module(module).ENGINES.items()
    }
    if names := tuple(dict.fromkeys(names)):
        for name in names:
            if name not in engines:
                names_there = ", ".join(engines)
                raise UnknownEngineError(f"there is no engine `{name}`: known are {names_there}")
            if not _is_installed(engines[name].engine):
                raise UnknownEngineError(_absence(engines[name].engine))
        return tuple(engines[name] for name in names), ()
    installed = tuple(choice for choice in engines.values() if _is_installed(choice.engine))
    absent = (choice.engine for choice in engines.values() if choice not in installed)
    return installed, tuple(map(_absence, absent))


def _absence(engine: Engine) -> str:
    return f"{engine.title} is not installed: `pip install 'mjbench[engines]'` brings it"


def _is_installed(engine: Engine) -> bool:
    try:
        return find_spec(engine.module) is not None
    except ModuleNotFoundError:  # not even its package
        return False


def measure_engines(
    subject: Subject,
    engines: tuple[ChosenEngine, ...],
    host: Host,
    *,
    quick: bool,
    seconds: float = SECONDS,
) -> EngineReport:
    """Report on a model in engines; a `CannotMeasureError` where it cannot be measured at all."""
    compiled_model = compile_subject(subject, host, quick=quick)
    for scene in compiled_model.scenarios:
        if scene.scenario.forces or scene.scenario.poses:
            message = "other engines are measured without pushes and poses"
            raise CannotMeasureError(message, scene.declaration.table, cause="scenario")
    load, scenarios = os.getloadavg()[0], []
    with report_errors(subject), tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder, "model.mjb"))
        mujoco.mj_saveModel(compiled_model.model, path, None)
        for scene in compiled_model.scenarios:
            host.tell(f"{scene.name}: the reference")
            basis, states = engine_basis(compiled_model.model, scene, quick=quick)
            trial = EngineTrial(path, scene.scenario, len(scene.scenario.times))
            run = _ScenarioRun(basis, states, trial, host, quick, seconds)
            rows = tuple(row for choice in engines for row in run.rows(choice))
            scenarios.append(engine_scenario(basis, rows))
    return EngineReport(subject.name, subject.digest, quick, this_machine(), load, tuple(scenarios))


class _ScenarioRun(Struct, frozen=True, eq=False):
    """A scenario that engines compute."""

    basis: Basis
    baseline: EngineStates
    trial: EngineTrial
    host: Host
    quick: bool
    seconds: float

    def rows(self, choice: ChosenEngine) -> Iterator[EngineRow]:
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
        with self._child(choice) as child:
            reply = child.reply(Request())
        if reply.refusal:
            yield _refuse(row, reply)
            return
        for variant in reply.variants:
            named_row = replace(row, **asdict(variant))
            name = f"{choice.engine.title}, {variant.bits} bits, {variant.label or variant.device}"
            self.host.tell(f"{self.basis.pilot.scene.name}: {name}")
            with self._child(choice) as child:
                request = Request(variant, self.trial, moves=True)
                reply = child.reply(request)
                if reply.motion is None:
                    yield _refuse(named_row, reply)
                    continue
                named_row = judge_motion(self.basis, self.baseline, named_row, reply.motion)
                costs = [_batch_cost(1, reply)]
                if choice.engine.batched:
                    costs += self._batch_costs(child, replace(request, moves=False))
                yield replace(named_row, costs=tuple(costs))

    def _batch_costs(self, child: EngineChild, request: Request) -> Iterator[BatchCost]:
        expected = 0.0
        for worlds in WORLDS[1:2] if self.quick else WORLDS[1:]:
            if expected * worlds * _ROUNDS > self.seconds:
                remark = f"not tried: a step would take about {expected * worlds:.2g} s"
                yield BatchCost(worlds, remark=remark)
                continue
            reply = child.reply(replace(request, worlds=worlds))
            expected = 0.0 if reply.cost is None else reply.cost.seconds.value
            yield _batch_cost(worlds, reply)

    def _child(self, choice: ChosenEngine) -> EngineChild:
        return EngineChild(choice.module, choice.name, self.seconds)


def _refuse(row: EngineRow, reply: Reply) -> EngineRow:
    status = "unsupported" if reply.unsupported else "failed"
    return replace(row, status=status, message=reply.refusal)


def _batch_cost(worlds: int, reply: Reply) -> BatchCost:
    if (cost := reply.cost) is None:
        return BatchCost(worlds, remark=reply.refusal)
    return BatchCost(worlds, cost.seconds, cost.ratio, cost.compile_seconds)
