"""How fast the browser's engine runs a model.

Entry point: `real_time_factor`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from coursebuild.core.files.errors import EffectError
from coursebuild.core.run.v8 import StoppedError
from coursebuild.core.text.source import Source
from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.features.lab.engines.native import NativeEngine, NativeError

_STEPS = 5000
"""Of a run, at most."""
_RUNS = 8
"""The first of them compile; the fastest counts."""
_LISTS = ("overlays", "controls", "readouts", "plots", "expect")
_NOTHING = ("camera", "forceScale", "stopAt", "trail", "seed")


def real_time_factor(
    root: Path, source: Source, key: int | None, run: tuple[float, float], seconds: float
) -> float | None:
    """Simulated time over the time that it takes; `None` where no run came to an end.

    `run` is the simulated time and the timestep, s; each of several runs may take `seconds`.
    """
    duration, timestep = run
    config: dict[str, Any] = {name: [] for name in _LISTS} | dict.fromkeys(_NOTHING)
    request = {
        "config": {**config, "id": "speed", "title": "", "key": key, "autoplay": False},
        "code": "({controls: [], readouts: [], plots: [], expect: []})",
        "seconds": min(duration, _STEPS * timestep),
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
