"""The child process that runs native MuJoCo for labs: it saves models, repeats runs, runs scripts.

`native` runs this file in a temporary folder, where MuJoCo may leave its log. The protocol is JSON
lines: this process says that it is ready, then answers each request with one line. A request that
takes more processor time than its limit ends this process by SIGPROF.
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import re
import signal
import sys
import types
import zlib
from typing import Any

import mujoco
import numpy as np

_NO_MEMORY = "ould not allocate memory"
"""Part of what MuJoCo says."""


def main() -> None:
    """Serve until the input closes."""
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)  # MuJoCo prints its warnings
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    tasks = {"describe": _describe, "save": _save, "parity": _parity, "script": _script}
    print("ready", file=replies, flush=True)
    for line in sys.stdin:
        request = json.loads(line)
        signal.setitimer(signal.ITIMER_PROF, request["limit"])
        try:
            reply = {"error": "", **tasks[request["task"]](request)}
        except (ValueError, RuntimeError, mujoco.FatalError, MemoryError) as error:
            reply = {"error": str(error) or type(error).__name__}
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        print(json.dumps(reply), file=replies, flush=True)


def _describe(_: Any) -> dict[str, Any]:
    """List the numbers of a model and its data, and what they are, and the functions that compute.

    Scripts of labs call no others. What reads and writes files, loads libraries, or changes what is
    common to all models takes a text, or nothing.
    """
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    owners = {
        "model": model,
        "data": mujoco.MjData(model),
        "model.opt": model.opt,
        "model.stat": model.stat,
    }
    fields: dict[str, str] = {}
    for owner, values in owners.items():
        for name in dir(values):
            value = None if name.startswith("_") else getattr(values, name)
            if isinstance(value, np.ndarray):
                kind = "rows" if value.ndim > 1 else "array"
                fields[f"{owner}.{name}"] = "single" if value.dtype == np.float32 else kind
            elif isinstance(value, int | float):
                fields[f"{owner}.{name}"] = "number"
    names = filter(re.compile(r"(mj|mju|mjd)_\w+").fullmatch, dir(mujoco))
    return {"fields": fields, "functions": [name for name in names if _computes(name)]}


def _computes(name: str) -> bool:
    if name in ("mj_name2id", "mju_euler2Quat"):  # a name, the order of axes
        return True
    signature = getattr(mujoco, name).__doc__ or ""
    parameters = signature.partition("(")[2].partition(") -> ")[0]
    is_computing = bool(parameters) and re.search(r"\b(?:str|args)\b", parameters) is None
    return is_computing and name != "mju_threadpool"


def _save(request: Any) -> dict[str, Any]:
    model = _compile(request["path"], {request["path"]: request["text"].encode()})
    buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return {"mjb": base64.b64encode(buffer.tobytes()).decode()}


def _compile(path: str, assets: dict[str, bytes]) -> Any:
    """Compile a model; where there is no room for what it reserves, it reserves less."""
    try:
        return mujoco.MjModel.from_xml_path(path, assets=assets)
    except ValueError as error:
        if _NO_MEMORY not in str(error):
            raise
    spec = mujoco.MjSpec.from_file(path, include=assets, assets=assets)
    for power in range(29, 20, -1):
        spec.memory = 1 << power
        with contextlib.suppress(ValueError):
            return spec.compile()
    spec.memory = 1 << 20  # as much as any model reserves
    return spec.compile()


def _array(packed: Any) -> Any:
    kinds = {"f64": "<f8", "f32": "<f4", "i32": "<i4", "u32": "<u4", "u8": "u1"}
    return np.frombuffer(base64.b64decode(packed["data"]), kinds[packed["type"]])


def _parity(request: Any) -> dict[str, Any]:
    """Repeat a run natively.

    The checksum of each step shows the first that differs; the states recorded at every `stride`-th
    step, up to the horizon, show by how much.
    """
    run = request["run"]
    file = {"model.mjb": base64.b64decode(request["mjb"])}
    model = mujoco.MjModel.from_binary_path("model.mjb", file)
    no_reset = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    flags = model.opt.disableflags
    model.opt.disableflags = flags & ~no_reset if run["autoreset"] else flags | no_reset
    data = mujoco.MjData(model)
    signature = run["signature"]
    mujoco.mj_setState(model, data, _array(run["start"]), signature)
    sums = _array(run["checksums"])
    states = _array(run["states"]).reshape(-1, max(run["width"], 1))
    writes = {name: _array(packed) for name, packed in run["writes"].items()}
    # The writes of each step, which are in the order of steps.
    ends = np.searchsorted(writes["steps"], range(run["steps"]), side="right").tolist()
    written_state = np.zeros(mujoco.mj_stateSize(model, signature))
    first, relative = None, 0.0
    horizon = max(request["horizon"], run["stride"])
    for step in range(run["steps"]):
        part = slice(ends[step - 1] if step else 0, ends[step])
        if part.start < part.stop:
            mujoco.mj_getState(model, data, written_state, signature)
            written_state[writes["indices"][part]] = writes["values"][part]
            mujoco.mj_setState(model, data, written_state, signature)
        mujoco.mj_step(model, data)
        if first is None and _checksum(data) != sums[step]:
            first = step + 1
        if first is None or (step + 1) % run["stride"] or step >= horizon:
            continue
        state = np.concatenate((data.qpos, data.qvel, data.act))
        recorded_state = states[(step + 1) // run["stride"] - 1]
        difference = _relative_difference(state, recorded_state)
        relative = max(relative, difference)
    return {
        "first": first,
        "relative": relative,
        "timestep": float(model.opt.timestep),
        "exact": _is_exact(model),
    }


def _checksum(data: Any) -> int:
    return zlib.crc32(b"".join(part.tobytes() for part in (data.qpos, data.qvel, data.act)))


def _is_exact(model: Any) -> bool:
    """Whether a step surely calls no function of the C library but the square root.

    Turning joints take sines and cosines, wrapped tendons their inverses, muscles and motors powers
    and exponentials; everything else is arithmetic, which gives the same bits on every machine.
    """
    plain = (int(mujoco.mjtDyn.mjDYN_NONE), int(mujoco.mjtDyn.mjDYN_INTEGRATOR))
    return bool(
        (model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE)).all()
        and model.ntendon == 0
        and model.nflex == 0
        and all(kind in plain for kind in model.actuator_dyntype)
        and (model.actuator_gaintype <= int(mujoco.mjtGain.mjGAIN_AFFINE)).all()
        and (model.actuator_biastype <= int(mujoco.mjtBias.mjBIAS_AFFINE)).all()
    )


def _relative_difference(native: Any, browser: Any) -> float:
    """Return the largest difference over the largest number, or over 1 if that is larger."""
    if not (np.isfinite(native).all() and np.isfinite(browser).all()):
        is_equal = np.array_equal(native, browser, equal_nan=True)
        return 0.0 if is_equal else 1e300  # JSON has no infinity
    if native.size == 0:
        return 0.0
    largest = max(float(np.abs(native).max()), 1.0)
    return float(np.abs(native / largest - browser / largest).max())


def _script(request: Any) -> dict[str, Any]:
    try:
        path = request["path"]
        observations = _observe(_load(path, request["text"]), request["near"])
        for text, button in [
            *((request["text"], name) for name in request["buttons"]),
            *((text, None) for text in request["variants"]),
        ]:
            # Take a few steps, after a button if one is given
            module = _load(path, text)
            state = module.load()
            module.start(*state)
            if button is not None:
                getattr(module, button)(*state)
            for _ in range(10):
                module.step(*state)
            module.report(*state)
    except (Exception, SystemExit) as error:  # any exception is the script's
        return {"failure": f"{type(error).__name__}: {error}"}
    return {"failure": "", **observations}


def _load(path: str, text: str) -> Any:
    module = types.ModuleType("lab_script")
    module.__file__ = path
    exec(compile(text, path, "exec"), module.__dict__)
    return module


def _observe(module: Any, recorded_step: int) -> dict[str, Any]:
    observations: dict[str, Any] = {"steps": 0, "state": []}
    step, simulate = module.step, module.simulate

    def count_step(model: Any, data: Any, *rest: Any) -> None:
        step(model, data, *rest)
        observations["steps"] += 1
        if observations["steps"] == recorded_step:
            observations["state"] = [*data.qpos.tolist(), *data.qvel.tolist(), *data.act.tolist()]

    def record_simulation(model: Any, data: Any, *rest: Any) -> None:
        observations["start"] = _readouts(module, model, data, *rest)
        simulate(model, data, *rest)
        observations["end"] = _readouts(module, model, data, *rest)
        observations["last"] = _checksum(data)

    module.step, module.simulate = count_step, record_simulation
    module.main()
    return observations


def _readouts(module: Any, *state: Any) -> list[list[Any]]:
    readouts = module.readouts(*state)
    return [[label, v if isinstance(v, str) else float(v)] for label, v, _ in readouts]


if __name__ == "__main__":
    main()
