"""Measuring one scenario of a scene: the compiled model, the clock, and what goes wrong.

Entry points: `scenarios_of(root, scene)`, `measured(loaded, …)`; `with_card(root, scene, report)`,
what a model is made of and how fast the browser's engine runs it.

1. The clock is the processor time of this thread: it stands still while others run.
2. MuJoCo's warnings are not printed: it would also write them into the working directory, which is
   the author's.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model.results import ScriptJob
from coursebuild.core.model.scenarios import DeclaredSweep
from coursebuild.core.run.machine import one_processor
from coursebuild.core.run.runner import ScriptServer
from coursebuild.core.text.diagnostics import diagnose
from coursebuild.core.text.source import Source
from coursebuild.features.bench.commands.runs import CannotError
from coursebuild.numerics.bench import measure_scenario
from coursebuild.numerics.engine import silent
from coursebuild.numerics.problem import Array, Scenario
from coursebuild.numerics.pruning.compare import watch
from coursebuild.numerics.pruning.reachability import possible_pairs
from coursebuild.numerics.reports.bench import ScenarioReport, SceneCard, SceneReport
from coursebuild.numerics.reports.cases import exact_file
from coursebuild.numerics.reports.sweep import SweepReport
from coursebuild.numerics.scene import EXACT_SCRIPT, ExactMotion, SceneError, scenes
from coursebuild.numerics.scene import Scene as PhysicsScene
from coursebuild.numerics.sweep import measure_sweep
from coursebuild.pipeline.scenes import CourseScene

_SECONDS = 20.0
"""Processor time that a run may take."""


class CompiledScene(Struct, frozen=True):
    """A scene, compiled in this process."""

    scene: CourseScene
    model: Any
    """An `mjModel`."""
    scenarios: tuple[PhysicsScene, ...]
    spec: Any = None
    """An `mjSpec` of it, from which it can be compiled otherwise."""


def scenarios_of(root: Path, scene: CourseScene, *, quick: bool) -> CompiledScene:
    """Compile a scene, and work out its scenarios.

    Raises:
        CannotError: they cannot be.
    """
    with _told(scene):
        model = _compiled(root, scene)
        known = _exact(root, scene)
        found = scenes(model, scene.declared, quick=quick)
        named = tuple(replace(one, exact=known) for one in found)
        spec = mujoco.MjSpec.from_file(str(root / scene.model.source.path))
        return CompiledScene(scene, model, named, spec)


def measured(
    loaded: CompiledScene, number: int, *, quick: bool, timed: bool, tell: Callable[[str], None]
) -> ScenarioReport:
    """Measure a scenario, by its number.

    Raises:
        CannotError: it cannot be.
    """
    clock = time.thread_time_ns if timed else None
    with _told(loaded.scene), one_processor():
        chosen = loaded.scenarios[number]
        return measure_scenario(loaded.model, chosen, quick=quick, clock=clock, tell=tell)


def swept(
    loaded: CompiledScene,
    sweep: DeclaredSweep,
    *,
    quick: bool,
    timed: bool,
    tell: Callable[[str], None],
) -> SweepReport:
    """Measure a sweep that the course declares.

    Raises:
        CannotError: it cannot be.
    """
    tell(sweep.name)
    clocks = (time.thread_time_ns, time.perf_counter_ns) if timed else None
    found = (one for one in loaded.scenarios if sweep.scenario in (None, one.name))
    with _told(loaded.scene):
        return measure_sweep(loaded.spec, next(found), sweep, clocks, quick=quick)


@contextmanager
def _told(scene: CourseScene) -> Iterator[None]:
    """What goes wrong meanwhile is told at its place, and what MuJoCo warns of not at all."""
    source = scene.model.source
    try:
        with silent():
            yield
    except SceneError as error:
        place = error.span or scene.declared.source.span(0, 0)
        wrong = diagnose("scenario-model", place, error.message, help=error.help)
        raise CannotError(wrong) from None
    except mujoco.FatalError as error:  # such as a model that asks for less memory than it needs
        said = f"the model `{scene.name}` cannot be measured: {' '.join(str(error).split())}"
        raise CannotError(diagnose("model-error", source.span(0, 0), said)) from None


def _compiled(root: Path, scene: CourseScene) -> Any:
    path = str(root / scene.model.source.path)
    return mujoco.MjModel.from_xml_path(path, assets={path: scene.model.source.text.encode()})


def _exact(root: Path, scene: CourseScene) -> ExactMotion | None:
    """What the course knows of the motion: its code runs as a script does, in a child."""
    path = exact_file(scene.name)
    if not (root / path).is_file():
        return None
    span = Source(path, "").span(0, 0)

    def states(times: Array, qpos: Array, qvel: Array) -> tuple[Array, Array | None]:
        asked = {"times": times.tolist(), "qpos": qpos.tolist(), "qvel": qvel.tolist()}
        script = os.path.relpath(EXACT_SCRIPT, root)
        job = ScriptJob(script, (path, json.dumps(asked)), _SECONDS, ())
        with ScriptServer() as server:
            (run,) = server.run(root, (job,), parallel=1)
        try:
            found = msgspec.json.decode(run.stdout, type=list[list[list[float]]])
            parts = [np.array(part) for part in zip(*found, strict=True)]
        except (msgspec.DecodeError, ValueError):
            last = run.stderr.strip().splitlines()[-1:] or [run.outcome.value]
            message = f"`{path}` says no motion: {last[0]}"
            help = "it defines `motion(time, qpos, qvel)`, which gives the positions at a time in s"
            raise SceneError(message, span, help) from None
        return parts[0], parts[1] if len(parts) > 1 else None

    return ExactMotion(span, states)


def with_card(
    root: Path, scene: CourseScene, report: SceneReport, seconds: float = _SECONDS
) -> SceneReport:
    """The report with the model's card; a run in the browser's engine may take so many `seconds`.

    Raises:
        EffectError: an engine cannot be loaded.
    """
    from coursebuild.core.run.mjcf import existing_files

    source = scene.model.source
    with silent():  # what it warns of, it would write into the working directory
        model = _compiled(root, scene)
        found = scenes(model, scene.declared)
        touched = {pair for one in found for pair in watch(model, one).touching_pairs}
    files = (root / path for path in existing_files(root, source.path, source.text))
    card = SceneCard(
        bodies=int(model.nbody) - 1,
        geoms=int(model.ngeom),
        freedom=int(model.nv),
        possible=len(possible_pairs(model)),
        touched=len(touched),
        mjcf=len(source.text.encode()) + sum(path.stat().st_size for path in files),
        mjb=int(mujoco.mj_sizeModel(model)),
        browser=_in_browser(root, scene, found[0].scenario, seconds),
    )
    return replace(report, card=card)


def _in_browser(root: Path, scene: CourseScene, scenario: Scenario, seconds: float) -> float | None:
    """Simulated time over the time that it takes in a browser; `None` where that is not known."""
    from coursebuild.features.lab.engines.speed import real_time_factor

    key = None if scenario.keyframe < 0 else scenario.keyframe
    run = scenario.duration, scene.facts.timestep
    return real_time_factor(root, scene.model.source, key, run, seconds)
