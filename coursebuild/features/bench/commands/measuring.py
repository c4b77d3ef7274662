"""Measures the scenarios of a scene, with its compiled model and a clock.

The clock is the processor time of this thread: it stands still while others run.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import msgspec
import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model.results import Outcome, ScriptJob
from coursebuild.core.model.scenarios import DeclaredSweep
from coursebuild.core.run.script_environment import one_processor
from coursebuild.core.run.script_server import ScriptServer
from coursebuild.core.text.diagnostics import diagnose
from coursebuild.core.text.source import Source
from coursebuild.features.bench.commands.measurement import CannotMeasureError
from coursebuild.numerics.problem import Array
from coursebuild.numerics.pruning.comparison import watch
from coursebuild.numerics.pruning.reachability import possible_pairs
from coursebuild.numerics.reports.case_report import exact_file
from coursebuild.numerics.reports.scene_report import (
    ScenarioReport,
    SceneCard,
    SceneReport,
    SweepReport,
)
from coursebuild.numerics.scene import (
    EXACT_SCRIPT,
    ExactMotion,
    ExactStates,
    SceneError,
    scenes,
)
from coursebuild.numerics.scene import Scene as PhysicsScene
from coursebuild.numerics.simulation import silent
from coursebuild.numerics.sweep import THREADS, measure_sweep
from coursebuild.numerics.work_precision import measure_scenario
from coursebuild.pipeline.scenes import CourseScene

_SECONDS = 20.0
"""Limit of a run, in seconds of processor time."""


class CompiledScene(Struct, frozen=True):
    """A scene, compiled in this process."""

    scene: CourseScene
    model: Any
    """An `mjModel`."""
    scenarios: tuple[PhysicsScene, ...]
    spec: Any = None
    """Its `mjSpec`, from which it can be compiled with other parameters."""


def compile_scene(root: Path, scene: CourseScene, *, quick: bool) -> CompiledScene:
    """Compile a scene and find its scenarios; a `CannotMeasureError` where it cannot be done."""
    with report_errors(scene):
        model = _compile_model(root, scene)
        exact = _exact_motion(root, scene)
        scenarios = scenes(model, scene.declarations, quick=quick)
        scenarios = tuple(replace(scenario, exact=exact) for scenario in scenarios)
        spec = mujoco.MjSpec.from_file(str(root / scene.model.source.path))
        return CompiledScene(scene, model, scenarios, spec)


def run_scenario(
    compiled_scene: CompiledScene,
    number: int,
    *,
    quick: bool,
    timed: bool,
    tell: Callable[[str], None],
) -> ScenarioReport:
    """Measure a scenario, given by its number; a `CannotMeasureError` where it cannot be done."""
    clock = time.thread_time_ns if timed else None
    with report_errors(compiled_scene.scene), one_processor():
        scenario = compiled_scene.scenarios[number]
        return measure_scenario(compiled_scene.model, scenario, quick=quick, clock=clock, tell=tell)


def run_sweep(
    compiled_scene: CompiledScene,
    sweep: DeclaredSweep,
    *,
    quick: bool,
    timed: bool,
    tell: Callable[[str], None],
    piece: slice | None = None,
) -> SweepReport:
    """Measure a sweep, or a piece without threads; a `CannotMeasureError` if it cannot be done."""
    tell(sweep.name)
    clocks = (time.thread_time_ns, time.perf_counter_ns) if timed else None
    scenario = next(s for s in compiled_scene.scenarios if sweep.scenario in (None, s.name))
    threads = tuple(part for part in sweep.variations if part.parameter == THREADS)
    single_thread = tuple(part for part in sweep.variations if part.parameter != THREADS)
    reports = []
    with report_errors(compiled_scene.scene):
        for variations in filter(None, (single_thread, threads if piece is None else ())):
            part = replace(sweep, variations=variations)
            # One processor, unless what is measured is how it goes on several.
            with one_processor() if variations is single_thread else nullcontext():
                report = measure_sweep(
                    compiled_scene.spec, scenario, part, clocks, quick=quick, piece=piece
                )
            reports.append(report)
    return replace(reports[0], rows=tuple(row for report in reports for row in report.rows))


@contextmanager
def report_errors(
    scene: CourseScene, failure: str = "the model `{}` cannot be measured", *errors: type[Exception]
) -> Iterator[None]:
    """Turn errors into a `CannotMeasureError` with their places, and silence MuJoCo's warnings.

    `failure` says what is not possible because of one of `errors`, or of what MuJoCo refuses to
    run, such as a model that asks for less memory than it needs.
    """
    try:
        with silent():
            yield
    except SceneError as error:
        place = error.span or scene.declarations.source.span(0, 0)
        diagnostic = diagnose("scenario-model", place, error.message, help=error.help)
        raise CannotMeasureError(diagnostic) from None
    except (mujoco.FatalError, *errors) as error:
        message = f"{failure.format(scene.name)}: {' '.join(str(error).split())}"
        place = scene.model.source.span(0, 0)
        raise CannotMeasureError(diagnose("model-error", place, message)) from None


def _compile_model(root: Path, scene: CourseScene) -> Any:
    path = str(root / scene.model.source.path)
    return mujoco.MjModel.from_xml_path(path, assets={path: scene.model.source.text.encode()})


def _exact_motion(root: Path, scene: CourseScene) -> ExactMotion | None:
    """Return the exact motion, if the course has code for it, which runs in a child."""
    path = exact_file(scene.name)
    if not (root / path).is_file():
        return None
    span = Source(path, "").span(0, 0)

    def states(times: Array, qpos: Array, qvel: Array) -> ExactStates:
        request = {"times": times.tolist(), "qpos": qpos.tolist(), "qvel": qvel.tolist()}
        script = os.path.relpath(EXACT_SCRIPT, root)
        job = ScriptJob(script, (path, json.dumps(request)), _SECONDS, ())
        with ScriptServer() as server:
            (run,) = server.run(root, (job,), parallel=1)
        try:
            answer = msgspec.json.decode(run.stdout, type=_Answer)
            motions = {}
            for name in ("motion", "acceleration"):
                if (rows := getattr(answer, name)) is not None:
                    qpos, *rest = (np.array(part) for part in zip(*rows, strict=True))
                    motions[name] = (qpos, rest[0] if rest else None)
        except (msgspec.DecodeError, ValueError):
            last = run.stderr.strip().splitlines()[-1:] or [run.outcome.value]
            reasons = {
                Outcome.OK: "its numbers of coordinates change" if run.stdout else "it exits",
                Outcome.TIMEOUT: f"it takes longer than {_SECONDS:g} s",
            }
            message = f"`{path}` gives no motion: {reasons.get(run.outcome, last[0])}"
            help = "define `motion(time, qpos, qvel)` there, for the positions at a time in s"
            raise SceneError(message, span, help) from None
        return ExactStates(motions, answer.expected)

    return ExactMotion(span, states)


class _Answer(Struct, frozen=True):
    """What the script that evaluates an exact motion says; each part where its file has it."""

    motion: list[list[list[float]]] | None = None
    acceleration: list[list[list[float]]] | None = None
    expected: dict[str, float] = {}


def add_card(
    root: Path, scene: CourseScene, report: SceneReport, seconds: float = _SECONDS
) -> SceneReport:
    """Add the model's card to its report; a run in the browser's engine may take `seconds`."""
    from coursebuild.core.run.mjcf import existing_files
    from coursebuild.features.lab.engines.browser import real_time_factor

    source = scene.model.source
    with silent():  # MuJoCo would write its warnings into the working directory
        model = _compile_model(root, scene)
        scenarios = scenes(model, scene.declarations)
        touching_pairs = {
            pair for scenario in scenarios for pair in watch(model, scenario).touching_pairs
        }
    files = (root / path for path in existing_files(root, source.path, source.text))
    first = scenarios[0].scenario
    key = None if first.keyframe < 0 else first.keyframe
    run = first.duration, scene.facts.timestep
    card = SceneCard(
        bodies=int(model.nbody) - 1,
        geoms=int(model.ngeom),
        freedom=int(model.nv),
        possible=len(possible_pairs(model)),
        touched=len(touching_pairs),
        mjcf=len(source.text.encode()) + sum(path.stat().st_size for path in files),
        mjb=int(mujoco.mj_sizeModel(model)),
        browser=real_time_factor(root, source, key, run, seconds),
    )
    return replace(report, card=card)
