"""MuJoCo itself: one world in one thread, and many worlds in threads (`mujoco.rollout`)."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from mujoco import rollout

from mjbench.engines.engine_trial import Engine, Variant
from mjbench.problem import Array
from mjbench.simulation import STATE, full_state, runnable

_PHYSICS = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)


class _OneWorld:
    """A world that `mj_step` simulates."""

    def __init__(self, model: Any, data: Any, velocities: Array, _: Variant) -> None:
        self._model, self._data = runnable(model), data
        data.qvel[:] = velocities[0]
        self._beginning = full_state(model, data)

    def advance(self, steps: int) -> None:
        mujoco.mj_step(self._model, self._data, steps)

    def command(self, control: tuple[float, ...]) -> None:
        self._data.ctrl[:] = control

    def reset(self) -> None:
        mujoco.mj_setState(self._model, self._data, self._beginning, STATE)

    def state(self) -> tuple[Array, Array]:
        return self._data.qpos.copy(), self._data.qvel.copy()


class _ThreadedWorlds:
    """Worlds that `mujoco.rollout` simulates, each from where it was."""

    def __init__(self, model: Any, data: Any, velocities: Array, variant: Variant) -> None:
        self._model = runnable(model)
        self._pool = rollout.Rollout(nthread=variant.threads)
        self._datas = [mujoco.MjData(model) for _ in range(max(1, variant.threads))]
        states = []
        for velocity in velocities:
            data.qvel[:] = velocity
            state = np.empty(mujoco.mj_stateSize(model, _PHYSICS))
            mujoco.mj_getState(model, data, state, _PHYSICS)
            states.append(state)
        self._beginning = self._states = np.array(states)
        self._first_control = data.ctrl.copy()
        self._control = np.tile(data.ctrl, (len(velocities), 1))
        self._scratch = mujoco.MjData(model)

    def advance(self, steps: int) -> None:
        control = np.repeat(self._control[:, None], steps, axis=1) if self._model.nu else None
        states, _ = self._pool.rollout(self._model, self._datas, self._states, control, nstep=steps)
        self._states = states[:, -1].copy()

    def command(self, control: tuple[float, ...]) -> None:
        self._control[:] = control

    def reset(self) -> None:
        self._states = self._beginning
        self._control[:] = self._first_control

    def state(self) -> tuple[Array, Array]:
        mujoco.mj_setState(self._model, self._scratch, self._states[0], _PHYSICS)
        return self._scratch.qpos.copy(), self._scratch.qvel.copy()


ENGINES = {
    "mujoco": Engine(
        title="MuJoCo, one world",
        module="mujoco",
        packages=("mujoco",),
        variants=lambda _: [Variant("cpu", "", 64, 1)],
        start=_OneWorld,
        batched=False,
    ),
    "threads": Engine(
        title="MuJoCo, rollout",
        module="mujoco",
        packages=("mujoco",),
        variants=lambda processors: [Variant("cpu", "", 64, processors)],
        start=_ThreadedWorlds,
    ),
}
