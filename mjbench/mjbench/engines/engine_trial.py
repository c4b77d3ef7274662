"""What an engine is asked in a child process, and its answer beside a scene's reference.

It is asked for one motion, and for what a step of many worlds costs.

1. The worlds of a batch begin a little apart, so that they do not all take the same branches.
2. Steps are timed beside MuJoCo's own, in the same process and in turn: what slows the machine for
   a while slows both, and their ratio holds. Time is that of the wall, since engines use threads or
   another device.
3. The first step compiles; how much longer it takes than the second one is told apart.
"""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import os
import resource
import signal
import tempfile
import time
from collections.abc import Callable
from functools import partial
from multiprocessing.connection import Connection
from typing import Any, Literal, Protocol, Self, TypeAlias

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, replace

from mjbench.costs import Clock, time_jobs
from mjbench.detector import Peaks, judge
from mjbench.machine import this_machine
from mjbench.measure import energy_drift, errors
from mjbench.measured_setting import Basis
from mjbench.pilot import nudges, position_distances
from mjbench.problem import Array, Scenario
from mjbench.reports import Interval
from mjbench.reports.model_report import EngineRow, EngineScenario
from mjbench.scene import Scene
from mjbench.simulation import (
    STATE,
    EngineStates,
    full_state,
    initial_data,
    invariants,
    motion_of,
    runnable,
    silent,
    simulate,
)
from mjbench.work_precision import find_basis


class Variant(Struct, frozen=True):
    """One way to run an engine."""

    device: str
    """As the engine's own library names it, such as `cpu` or `cuda:0`."""
    label: str
    """What the device calls itself; empty for the processor, which the report names."""
    bits: Literal[32, 64]
    """Of its floating-point numbers."""
    threads: int = 0
    """How many it is told to use; 0 where it decides itself."""


class Worlds(Protocol):
    """Copies of a model that an engine simulates."""

    def advance(self, steps: int) -> None:
        """Make so many steps in every world, and wait until they are made."""

    def command(self, control: tuple[float, ...]) -> None:
        """Give this command to all worlds."""

    def reset(self) -> None:
        """Go back to the beginning."""

    def state(self) -> tuple[Array, Array]:
        """The `qpos` and `qvel` of the first world, in double precision."""


Start: TypeAlias = Callable[[Any, Any, Array, Variant], Worlds]
"""`mjModel`, `mjData` at the beginning, and `qvel` (worlds, nv) of each world → the worlds."""


class Engine(Struct, frozen=True):
    """An engine, as a table of functions."""

    title: str
    module: str
    """The module that is there where the engine is installed."""
    packages: tuple[str, ...]
    """Those that its figures depend on; the first brings the module."""
    variants: Callable[[int], list[Variant]]
    """The ways to run it here; the argument is the number of usable processors."""
    start: Start
    batched: bool = True
    """Whether it can simulate more than one world at a time."""


class RefusalError(Exception):
    """An engine does not do what it is asked, in words of this module: it takes too long."""


class EngineTrial(Struct, frozen=True):
    """What an engine is to simulate."""

    model: str
    """A file with the compiled model (MJB)."""
    scenario: Scenario
    count: int
    """The number of samples up to which the motion is compared."""


class EngineMotion(Struct, frozen=True, eq=False):
    """The motion of one world, at each sample."""

    qpos: Array
    qvel: Array
    compile_seconds: float


class EngineCost(Struct, frozen=True):
    """What a step of one world costs, among so many."""

    seconds: Interval
    ratio: Interval
    """To a step of MuJoCo itself in one world, timed in turn."""
    compile_seconds: float


_SPREAD = 1e-3
"""How far apart the worlds of a batch begin, as `pilot.nudges` has it."""
_REPEAT, _SLOWEST = 0.004, 20.0
"""Seconds that a repeat takes at least, unless that is the whole scenario: as short as a turn that
a busy system gives to one program. Seconds of a step beyond which an engine is not timed."""


class Batch(Struct, frozen=True, eq=False):
    """Worlds that are ready to be advanced."""

    model: Any
    worlds: Worlds
    count: int
    compile_seconds: float


def begin(engine: Engine, variant: Variant, trial: EngineTrial, count: int, clock: Clock) -> Batch:
    """Start an engine, and let it compile what it needs for so many worlds."""
    model = mujoco.MjModel.from_binary_path(trial.model)
    data = initial_data(trial.scenario, model)
    velocities = np.tile(data.qvel, (count, 1))
    # The first world begins as the scenario does.
    velocities[1:] += nudges(model, 2 * count, _SPREAD)[: count - 1, 1]
    instances: list[Worlds] = []

    def first() -> None:
        instances.append(engine.start(model, data, velocities, variant))
        instances[0].advance(1)

    with silent():
        took = _time(first, clock)
        took -= _time(partial(instances[0].advance, 1), clock)
    return Batch(model, instances[0], count, max(0.0, took))


def run_motion(batch: Batch, trial: EngineTrial) -> EngineMotion:
    """The motion of a trial in one world."""
    scenario, worlds, states = trial.scenario, batch.worlds, []
    steps = scenario.steps(float(batch.model.opt.timestep))
    with silent():
        worlds.reset()
        for _, inputs in zip(range(trial.count), scenario.inputs(scenario.sample), strict=False):
            if inputs.controls:
                worlds.command(inputs.controls)
            worlds.advance(steps)
            states.append(worlds.state())
    qpos, qvel = (np.array(part) for part in zip(*states, strict=True))
    return EngineMotion(qpos, qvel, batch.compile_seconds)


def run_costs(batch: Batch, trial: EngineTrial, clock: Clock) -> EngineCost:
    """What a step of one world costs among a batch; a `RefusalError` where it takes too long."""
    model, worlds, count = batch.model, batch.worlds, batch.count
    until = trial.scenario.holds()[0][1]  # until the command changes
    most = round(until / float(model.opt.timestep))
    with silent():
        worlds.reset()
        steps = 1
        while True:
            seconds = _time(partial(worlds.advance, steps), clock)
            if seconds > _SLOWEST:
                raise RefusalError(f"a step of {count:,} worlds takes {seconds:.0f} s")
            if seconds >= _REPEAT or steps == most:
                break
            steps = min(most, steps * (2 if seconds > _REPEAT / 10 else 8))

        def work() -> None:
            worlds.reset()
            worlds.advance(steps)

        data = initial_data(trial.scenario, model)
        beginning = full_state(model, data)

        def own_steps(repeats: int) -> None:
            for _ in range(repeats):
                mujoco.mj_setState(model, data, beginning, STATE)
                mujoco.mj_step(model, data, steps)

        # What takes as long is disturbed as often.
        repeats = max(1, round(_REPEAT / _time(partial(own_steps, 1), clock)))

        _, timing = time_jobs([partial(own_steps, repeats), work], 0, clock, quick=True)
    share = repeats / count
    return EngineCost(
        timing.nanoseconds.scale(1e-9 / (steps * count)),
        timing.ratio.scale(share),
        batch.compile_seconds,
    )


def _time(work: Callable[[], None], clock: Clock) -> float:
    before = clock()
    work()
    return (clock() - before) * 1e-9


def engine_basis(model: Any, scene: Scene, *, quick: bool = False) -> tuple[Basis, EngineStates]:
    """What motions are compared with, and how MuJoCo itself moves at the model's own setting."""
    basis = find_basis(model, scene, quick=quick)
    return basis, simulate(basis.pilot.setup, runnable(model)).states


def engine_scenario(basis: Basis, rows: tuple[EngineRow, ...]) -> EngineScenario:
    """The report on a scenario."""
    scene, reference = basis.pilot.scene, basis.reference
    return EngineScenario(
        name=scene.name,
        title=scene.title,
        duration=scene.scenario.duration,
        horizon=reference.horizon,
        reference=reference.kind,
        source=reference.source,
        floor=reference.floor.place,
        velocity_floor=reference.floor.velocity,
        setting=basis.baseline,
        rows=rows,
    )


def judge_motion(
    basis: Basis, baseline: EngineStates, row: EngineRow, motion: EngineMotion
) -> EngineRow:
    """Add to a row how far a motion is from the reference, and what it does to energy."""
    model, scenario, reference = basis.model, basis.pilot.scene.scenario, basis.reference
    row = replace(row, compile_seconds=motion.compile_seconds)
    times = scenario.times[: len(motion.qpos)]
    qpos, qvel = motion.qpos, motion.qvel
    states = EngineStates(times, qpos, qvel, np.zeros((len(times), int(model.na))))
    beginning, scratch = initial_data(scenario, model), initial_data(scenario, model)
    moments = [(beginning.qpos, beginning.qvel), *zip(qpos, qvel, strict=True)]
    with silent():  # of states that are no numbers
        energies = np.array([invariants(model, scratch, *moment)[:2] for moment in moments])
    energy = float(energies.sum(axis=1).max())
    peaks = Peaks(float(np.abs(qpos).max()), float(np.abs(qvel).max()), energy=energy)
    beginning.energy[:] = energies[0]
    judgement = judge(beginning, peaks, basis.pilot.setup)
    if not judgement.ok:
        return replace(row, status="diverged", message="; ".join(judgement.reasons))
    exact, count = motion_of(model, reference.states), len(reference.states.times)
    near = errors(motion_of(model, states.head(count)), exact, reference.floor)
    apart = position_distances(model, states.qpos[:count], baseline.qpos[:count])
    drift = None if basis.energy is None else energy_drift(energies, basis.energy)
    return replace(row, **asdict(near), apart=float(apart.max()), energy_drift=drift)


_MEMORY = 16 << 30
"""Bytes that an engine may take: 4,096 worlds need more than most programs do."""
_LONGEST = 300
"""Characters of a refusal."""


class Request(Struct, frozen=True):
    """What an engine is asked: without a variant, which of these there are."""

    variant: Variant | None = None
    trial: EngineTrial | None = None
    worlds: int = 1
    moves: bool = False
    """Whether for a motion too, which comes with the costs: it is compiled only once."""


class Reply(Struct, frozen=True):
    """What it says: what was asked for, or why there is none."""

    variants: tuple[Variant, ...] = ()
    motion: EngineMotion | None = None
    cost: EngineCost | None = None
    refusal: str = ""
    """In the engine's own words."""
    unsupported: bool = False
    """Whether it says that it does not have a feature."""


class EngineChild:
    """An engine in a process of its own, in a temporary folder where it leaves what it compiles."""

    def __init__(self, module: str, name: str, seconds: float) -> None:
        """`seconds`: how long, by the wall, one answer may take."""
        self._engine, self._seconds = (module, name), seconds
        self._folder = tempfile.TemporaryDirectory()
        self._process: multiprocessing.context.SpawnProcess | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()
        self._folder.cleanup()

    def reply(self, request: Request) -> Reply:
        """What the engine says; a refusal where its process crashed or took too long."""
        if self._process is None:
            self._start()
        with contextlib.suppress(EOFError, OSError):  # it died
            self._connection.send(request)
            if self._connection.poll(self._seconds):
                reply: Reply = self._connection.recv()
                return reply
        return Reply(refusal=f"its process {self._death()}")

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, other_end = context.Pipe()
        arguments = other_end, *self._engine, self._folder.name
        self._process = context.Process(target=_serve, args=arguments, daemon=True)
        self._process.start()
        other_end.close()

    def _stop(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(OSError):
            os.killpg(process.pid or 0, signal.SIGKILL)
        process.kill()
        process.join()
        self._connection.close()

    def _death(self) -> str:
        """What ended the child, after it gave no answer."""
        assert self._process is not None
        self._process.join(1.0)
        status = self._process.exitcode
        self._stop()
        if status is None:
            return f"took longer than {self._seconds:g} s"
        if status < 0:
            return f"crashed ({signal.Signals(-status).name})"
        return f"ended with status {status}"


def _serve(connection: Connection, module: str, name: str, folder: str) -> None:
    """Answer requests, in the child, until the parent goes."""
    os.setsid()
    os.chdir(folder)
    null = os.open(os.devnull, os.O_WRONLY)
    for output in (1, 2):
        os.dup2(null, output)  # engines print what they compile
    # The threads of JAX's pool on the processor, by default one for each core. Two wait for each
    # other: 4,096 worlds of a model with contacts stopped for ever within some hundred steps
    # (jaxlib 0.10.2, two cores), and ran through with eight.
    os.environ.setdefault("NPROC", str(max(8, 2 * (os.cpu_count() or 1))))
    os.environ["TMPDIR"] = folder
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with contextlib.suppress(OSError, ValueError):  # only Linux counts data so
        resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY, _MEMORY))
    with contextlib.suppress(EOFError):
        while True:
            request: Request = connection.recv()
            try:
                reply = _answer(module, name, request)
            except MemoryError:
                reply = Reply(refusal="there is not enough memory")
            except Exception as error:  # whatever it raises is its answer
                is_missing = isinstance(error, NotImplementedError)
                reply = Reply(refusal=_words(error), unsupported=is_missing)
            connection.send(reply)


def _answer(module: str, name: str, request: Request) -> Reply:
    engine: Engine = importlib.import_module(module).ENGINES[name]
    variant, trial, clock = request.variant, request.trial, time.perf_counter_ns
    if variant is None or trial is None:
        return Reply(tuple(engine.variants(this_machine().processors)))
    batch = begin(engine, variant, trial, request.worlds, clock)
    motion = run_motion(batch, trial) if request.moves else None
    return Reply(motion=motion, cost=run_costs(batch, trial, clock))


def _words(error: Exception) -> str:
    """An exception in one line, cut where it gets long."""
    text = " ".join(str(error).split())
    if isinstance(error, RefusalError):
        return text
    text = f"{type(error).__name__}: {text}" if text else type(error).__name__
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"
