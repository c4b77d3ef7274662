"""A fair scenario for a model whose author declares none.

It begins in a keyframe (`home`, or else the first), or where the model comes to rest under no
command, or in its own state if it does not. Then smooth random commands follow, within their
ranges, from several seeds, or those of a controller: what hangs still or lies about would say
nothing. A model that would not move for all that gets random velocities. Where time is limited it
is so short that what all errors are measured against is known after a part of that time.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mjbench.declarations import DURATION, MOST_STEPS, DeclaredScenario, Place
from mjbench.loop import Loop, close_loop, step, time_left
from mjbench.problem import Array
from mjbench.scene import element_names
from mjbench.simulation import advance, without_sleep

SEEDS, QUICK_SEEDS = (1, 2, 3), (1, 2)
_RUNS, _QUICK_RUNS, _PART, _TRIAL = 460, 130, 0.25, 0.02
"""About how many steps a first run and the references make for each one of the scenario, the part
of the time that they may take, and that in which steps are counted."""
_SETTLING = 4.0
"""How long a model may take to come to rest, s."""
_HOLD = 16
"""Timesteps for which a command holds; the longer timesteps that are tried divide it."""
_SHARE, _FREE = 0.2, 0.3
"""How far commands go from where they begin: as a part of their range, or without a range."""
_WAVES, _SLOWEST, _FEWEST = 3, 1.0, 24
"""How many sine waves a command is made of, and the period of the first, s; each is shorter. With
fewer commands in it they would be no waves: where timesteps are long, it is longer."""
_PERIODS = 2
"""How long a scenario is, in periods of the first wave."""
_STILL = 1e-3
"""The speed, in m/s or rad/s, below which a model has come to rest."""


def fair_scenarios(
    model: Any, path: str, *, quick: bool, loop: Loop | None = None
) -> tuple[DeclaredScenario, ...]:
    """The scenarios of a model (`mjModel`) that nobody declared; none if nothing can move.

    `loop`: the controller that commands it.
    """
    if not model.nv:
        return ()
    keyframe, words, data = _begin(model)
    seeds = QUICK_SEEDS if quick else SEEDS
    qpos = () if keyframe is not None else tuple(data.qpos.tolist())
    is_idle = not model.nu or model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    if is_idle or loop is not None:
        if loop is not None:
            words += f", under the controller {Path(loop.path).name}"
        qvel = _velocities_at_rest(model, data, loop)
        words += ", with random velocities, since else nothing would move" if qvel else ""
        name = "start" if loop is None else "loop"
        return (DeclaredScenario(name, words, keyframe, qpos=qpos, qvel=qvel, table=Place(path)),)
    hold = _HOLD * float(model.opt.timestep)
    slowest = max(_SLOWEST, _FEWEST * hold)
    slowest = min(slowest, _most_steps(model, data, quick=quick) / _PERIODS * hold / _HOLD)
    count = max(1, math.ceil(_PERIODS * slowest / hold - 1e-9))
    scenarios = []
    for seed in seeds:
        phases = 2 * math.pi * hold / slowest * np.arange(count, dtype=float)
        rows = _commands(model, np.array(data.ctrl), seed, phases)
        scenarios.append(
            DeclaredScenario(
                name=f"seed-{seed}",
                title=f"{words}, then smooth random commands within their ranges, seed {seed}",
                keyframe=keyframe,
                qpos=qpos,
                controls=tuple(tuple(row) for row in rows.tolist()),
                hold=float(f"{hold:.12g}"),
                duration=float(f"{count * hold:.12g}"),
                table=Place(path),
            )
        )
    return tuple(scenarios)


def _most_steps(model: Any, data: Any, *, quick: bool) -> float:
    """How many timesteps a scenario may have, from how many are made in some of the time."""
    count, left = 0, time_left()
    if math.isinf(left):
        return MOST_STEPS
    while count < MOST_STEPS and time_left() > (1 - _TRIAL) * left:
        step(model, data, _HOLD)
        count += _HOLD
    most = count * _PART / _TRIAL / (_QUICK_RUNS if quick else _RUNS)
    return min(max(most, _FEWEST * _HOLD), MOST_STEPS)


def _begin(model: Any) -> tuple[int | None, str, Any]:
    """The keyframe to begin in, what that is called, and `mjData` of it."""
    data = mujoco.MjData(model)
    names = element_names(model, "key")
    if names:
        number = names.index("home") if "home" in names else 0
        mujoco.mj_resetDataKeyframe(model, data, number)
    data.ctrl[:] = _clip(model, data.ctrl)
    if names:
        return number, f"from the keyframe {names[number] or number}", data
    variant = without_sleep(model)
    variant.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    steps = min(round(_SETTLING / float(model.opt.timestep)), MOST_STEPS)
    for _ in range(0, steps, _HOLD):
        advance(variant, data, _HOLD)
        if not np.isfinite(data.qpos).all():
            break
    else:
        if np.abs(data.qvel).max(initial=0.0) < _STILL:
            data.qvel[:] = 0.0
            return None, "from where it comes to rest under no command", data
    mujoco.mj_resetData(model, data)
    data.ctrl[:] = _clip(model, data.ctrl)
    return None, "from the model's own state", data


def _clip(model: Any, commands: Array) -> Array:
    limited = model.actuator_ctrllimited != 0
    low, high = np.where(limited[:, None], model.actuator_ctrlrange, (-np.inf, np.inf)).T
    clipped: Array = np.clip(commands, low, high)
    return clipped


def _commands(model: Any, middle: Array, seed: int, angles: Array) -> Array:
    """Commands (n, nu): sine waves about where they begin, within their ranges.

    `angles`: those of the first wave, rad (n,).
    """
    random = np.random.default_rng(seed)
    limited = model.actuator_ctrllimited != 0
    spans = np.ptp(model.actuator_ctrlrange, axis=1)
    sizes = np.where(limited, _SHARE * spans, _FREE)
    rows = np.tile(middle, (len(angles), 1))
    for wave in range(1, _WAVES + 1):
        phases = random.uniform(0, 2 * math.pi, model.nu)
        parts = np.sin(wave * angles[:, None] + phases) - np.sin(phases)
        rows += sizes / _WAVES * random.uniform(0.5, 1.0, model.nu) * parts
    return np.array([_clip(model, row) for row in rows])


def _velocities_at_rest(model: Any, data: Any, loop: Loop | None) -> tuple[float, ...]:
    """Random velocities where nothing would move from a state, under a controller; else none."""
    steps = _HOLD
    if loop is not None:  # its first commands may act late
        close_loop(loop, model, data)
        steps = min(round(DURATION / float(model.opt.timestep)), MOST_STEPS)
    for _ in range(0, steps, _HOLD):
        if loop is not None:
            step(model, data, _HOLD)
        mujoco.mj_forward(model, data)
        if not max(np.abs(data.qvel).max(), np.abs(data.qacc).max()) < _STILL:
            return ()
    return tuple(np.random.default_rng(SEEDS[0]).uniform(-1, 1, int(model.nv)).tolist())
