"""The child process that compiles MJCF for `mjcf`: a crash or a hang takes nothing else along.

It is run as a file in a temporary folder, where MuJoCo may leave its log. The protocol is JSON
lines, after `ready`. A request is the path where the model stands, or would (includes and assets
are relative to it), texts by their paths, which hide files that are there, and seconds of processor
time, after which SIGPROF ends this process. The reply is a message, empty where it compiles, the
facts of `results.ModelFacts`, and the seconds taken.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from typing import Any

_INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast", "discrete")
"""In the order of mjtIntegrator, by their names in MJCF."""
_FREE, _BALL, _SLIDE, _HINGE = range(4)
"""As in mjtJoint."""


def main() -> None:
    """Serve until the input closes."""
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # MuJoCo prints its warnings
    import mujoco

    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    print("ready", file=replies, flush=True)
    for line in sys.stdin:
        path, texts, seconds = json.loads(line)
        start = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, seconds)
        reply = _compile(mujoco, path, texts)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        print(json.dumps((*reply, time.process_time() - start)), file=replies, flush=True)


def _compile(mujoco: Any, path: str, texts: dict[str, str]) -> tuple[str, dict[str, Any] | None]:
    assets = {name: text.encode() for name, text in texts.items()}
    errors = (ValueError, RuntimeError, mujoco.FatalError, MemoryError)
    try:
        try:
            model = mujoco.MjModel.from_xml_path(path, assets=assets)
        except errors as error:
            if "allocate memory" not in str(error) or not hasattr(mujoco, "MjSpec"):
                raise
            # What a model reserves (`memory` of its `size`) it does not use to be compiled.
            spec = mujoco.MjSpec.from_file(path, include=assets, assets=assets)
            spec.memory = -1
            model = spec.compile()
    except errors as error:
        return str(error) or type(error).__name__, None

    def names(addresses: Any) -> list[str]:
        blob: bytes = model.names
        return [blob[a : blob.index(b"\0", a)].decode("utf-8", "replace") for a in addresses]

    joints = set(model.jnt_type.tolist())
    return "", {
        "bodies": model.nbody - 1,
        "geoms": model.ngeom,
        "joints": model.njnt,
        "nq": model.nq,
        "nv": model.nv,
        "nu": model.nu,
        "timestep": float(model.opt.timestep),
        "integrator": dict(enumerate(_INTEGRATORS)).get(model.opt.integrator, "unknown"),
        "total_mass": float(model.body_mass.sum()),
        "keyframes": names(model.name_keyadr),
        "sites": names(model.name_siteadr),
        "sensors": names(model.name_sensoradr),
        "body_names": names(model.name_bodyadr[1:]),
        "sizes": ({"rad": 1.0} if joints & {_FREE, _BALL, _HINGE} else {})
        | ({"m": float(model.stat.extent)} if joints & {_FREE, _SLIDE} else {}),
    }


if __name__ == "__main__":
    main()
