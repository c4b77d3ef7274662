"""The child process that compiles MJCF for `mjcf`: a crash or a hang takes nothing else along.

Entry point: run as a file by `mjcf`, in a temporary folder, where MuJoCo may leave its log.

The protocol: JSON lines. First this process says that it is ready; then, for each `CompileRequest`
on standard input, it writes one `CompileReply`. A request that takes more processor time than its
limit ends this process by SIGPROF.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from typing import Any, TypedDict

_INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast", "discrete")
"""In the order of mjtIntegrator, by their names in MJCF."""


class CompileRequest(TypedDict):
    """What to compile."""

    path: str
    """Where the text stands, or would: includes and assets are relative to it."""
    text: str
    limit: float
    """Seconds."""


class CompileReply(TypedDict):
    """What became of it: a message, or facts."""

    error: str
    facts: dict[str, Any] | None
    """Those of `results.ModelFacts`."""


def main() -> None:
    """Serve until the input closes."""
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)  # MuJoCo prints its warnings
    import mujoco

    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    print("ready", file=replies, flush=True)
    for line in sys.stdin:
        request: CompileRequest = json.loads(line)
        signal.setitimer(signal.ITIMER_PROF, request["limit"])
        reply = _compile(mujoco, request)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        print(json.dumps(reply), file=replies, flush=True)


def _compile(mujoco: Any, request: CompileRequest) -> CompileReply:
    path = request["path"]
    try:
        model = mujoco.MjModel.from_xml_path(path, assets={path: request["text"].encode()})
    except (ValueError, RuntimeError, mujoco.FatalError, MemoryError) as error:
        return {"error": str(error) or type(error).__name__, "facts": None}
    return {"error": "", "facts": _facts(mujoco, model)}


def _facts(mujoco: Any, model: Any) -> dict[str, Any]:
    def names(addresses: Any) -> list[str]:
        blob: bytes = model.names
        return [blob[a : blob.index(b"\0", a)].decode("utf-8", "replace") for a in addresses]

    return {
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
    }


if __name__ == "__main__":
    main()
