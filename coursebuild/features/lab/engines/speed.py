"""How fast the browser's engine runs a model.

Entry point: `real_time_factor`.
"""

from __future__ import annotations

from pathlib import Path

from coursebuild.core.files.errors import EffectError
from coursebuild.core.text.source import Source
from coursebuild.features.lab.compile import compile_lab
from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.features.lab.engines.native import NativeEngine, NativeError
from coursebuild.features.lab.model import SIMLAB, Lab
from coursebuild.features.lab.schema import SimLab

_STEPS = 5000
"""The most steps of a run."""
_RUNS = 8
"""The fastest counts: in the first ones V8 compiles."""


def real_time_factor(
    root: Path, source: Source, key: int | None, run: tuple[float, float], seconds: float
) -> float | None:
    """Measure simulated time over the time that it takes; `None` if no run came to its end.

    `run` is the simulated time and the timestep, s; each of several runs may take `seconds`.
    """
    duration, timestep = run
    place = source.span(0, 0)
    module = compile_lab(Lab(place, SIMLAB, place, "", SimLab(key=key)), "speed")
    request = {
        "config": module.config,
        "code": module.literal,
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
    except (NativeError, EffectError):
        return None
    return best * timestep if best else None
