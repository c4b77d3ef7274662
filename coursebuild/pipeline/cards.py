"""What a model is made of and how fast the browser's engine runs it, for its report.

Entry point: `with_card(root, scene, report)`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from msgspec.structs import replace

from coursebuild.effects.errors import EffectError
from coursebuild.effects.lab_engine import LabEngine
from coursebuild.effects.mjcf import parts
from coursebuild.effects.native import NativeEngine, NativeError
from coursebuild.effects.v8 import StoppedError
from coursebuild.numerics.reports.bench import SceneCard, SceneReport
from coursebuild.pipeline.scenes import Scene

if TYPE_CHECKING:
    from coursebuild.numerics.problem import Scenario

_STEPS = 5000
"""Of a run in the browser's engine, at most."""
_RUNS = 8
"""The first of them compile; the fastest counts."""
_SECONDS = 20.0
"""Processor time that a run may take."""
_CODE = "({controls: [], readouts: [], plots: [], expect: []})"


def with_card(
    root: Path, scene: Scene, report: SceneReport, seconds: float = _SECONDS
) -> SceneReport:
    """The report with the model's card; a run in the browser's engine may take so many `seconds`.

    Raises:
        EffectError: an engine cannot be loaded.
    """
    import mujoco

    from coursebuild.numerics.contacts import touched_pairs
    from coursebuild.numerics.engine import silent
    from coursebuild.numerics.pruning.reachability import possible_pairs
    from coursebuild.numerics.scene import scenes

    source = scene.model.source
    with silent():  # what it warns of, it would write into the working directory
        model = mujoco.MjModel.from_xml_path(
            str(root / source.path), assets={str(root / source.path): source.text.encode()}
        )
        found = scenes(model, scene.declared)
        touched = touched_pairs(model, found)
    files = (root / path for path in parts(root, source.path, source.text))
    card = SceneCard(
        bodies=int(model.nbody) - 1,
        geoms=int(model.ngeom),
        freedom=int(model.nv),
        possible=len(possible_pairs(model)),
        touched=len(touched),
        mjcf=len(source.text.encode()) + sum(path.stat().st_size for path in files),
        mjb=int(mujoco.mj_sizeModel(model)),
        browser=_browser(root, scene, found[0].scenario, seconds),
    )
    return replace(report, card=card)


def _browser(root: Path, scene: Scene, scenario: Scenario, seconds: float) -> float | None:
    """Simulated time over the time it takes in WebAssembly; `None` where no run came to an end."""
    source, timestep = scene.model.source, scene.facts.timestep
    data = {"id": "speed", "title": "", "key": None if scenario.keyframe < 0 else scenario.keyframe}
    nothing = dict.fromkeys(("camera", "forceScale", "stopAt", "trail", "seed"))
    lists: dict[str, list[object]] = {
        name: [] for name in ("overlays", "controls", "readouts", "plots", "expect")
    }
    request = {
        "config": {**data, **nothing, **lists, "autoplay": False},
        "code": _CODE,
        "seconds": min(scenario.duration, _STEPS * timestep),
        "parity": False,
    }
    best = 0
    try:
        with NativeEngine(root) as native:
            mjb = native.save(source.path, source.text)
        with LabEngine() as engine:
            for _ in range(_RUNS):
                reply = engine.trial(request, mjb, seconds)
                if reply["main"] is None:
                    break
                best = max(best, reply.get("stepsPerSecond") or 0)
    except (NativeError, EffectError, StoppedError):
        return None
    return best * timestep if best else None
