"""Measuring one scenario of a scene: the compiled model, the clock, and what goes wrong.

Entry points: `scenarios_of(root, scene)`, `measured(loaded, …)`.

1. The clock is the processor time of this thread: it stands still while others run.
2. MuJoCo's warnings are not printed: it would also write them into the working directory, which is
   the author's.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
from msgspec import Struct

from coursebuild.diagnostics import Diagnostic, diagnose
from coursebuild.numerics.bench import measure_scenario
from coursebuild.numerics.engine import silent
from coursebuild.numerics.reports.bench import ScenarioReport
from coursebuild.numerics.scene import Scene as PhysicsScene
from coursebuild.numerics.scene import SceneError, scenes
from coursebuild.pipeline.scenes import Scene


class Loaded(Struct, frozen=True):
    """A scene, compiled in this process."""

    scene: Scene
    model: Any
    """An `mjModel`."""
    scenarios: tuple[PhysicsScene, ...]


def scenarios_of(root: Path, scene: Scene, *, quick: bool) -> Loaded | Diagnostic:
    """Compile a scene, and work out its scenarios; or why they cannot be."""
    source = scene.model.source
    path = str(root / source.path)
    try:
        with silent():
            model = mujoco.MjModel.from_xml_path(path, assets={path: source.text.encode()})
            found = scenes(model, scene.declared, quick=quick)
    except SceneError as error:
        return _told(scene, error)
    except mujoco.FatalError as error:
        return _refused(scene, error)
    return Loaded(scene, model, found)


def measured(
    loaded: Loaded, number: int, *, quick: bool, timed: bool, tell: Callable[[str], None]
) -> ScenarioReport | Diagnostic:
    """Measure a scenario, by its number; or why it cannot be."""
    try:
        with silent():
            return measure_scenario(
                loaded.model,
                loaded.scenarios[number],
                quick=quick,
                clock=time.thread_time_ns if timed else None,
                tell=tell,
            )
    except SceneError as error:
        return _told(loaded.scene, error)
    except mujoco.FatalError as error:
        return _refused(loaded.scene, error)


def _told(scene: Scene, error: SceneError) -> Diagnostic:
    place = error.span
    if place is None:
        place = scene.model.source.span(0, 0) if scene.declared is None else _beside(scene)
    return diagnose("scenario-model", place, error.message, help=error.help)


def _refused(scene: Scene, error: Exception) -> Diagnostic:
    """Such as a model that asks for less memory than it needs."""
    said = f"the model `{scene.name}` cannot be measured: {' '.join(str(error).split())}"
    return diagnose("model-error", scene.model.source.span(0, 0), said)


def _beside(scene: Scene) -> Any:
    assert scene.declared is not None
    return scene.declared.source.span(0, 0)
