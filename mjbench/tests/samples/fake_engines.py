"""Engines that work, refuse, fail, crash and hang, as a module of engines."""

from __future__ import annotations

import os
import time
from typing import Any

import mujoco
import numpy as np

from mjbench.engines.engine_trial import Engine, Variant
from mjbench.problem import Array

SINGLE = Variant("cpu", "", 32)


class Single:
    """MuJoCo, whose state is rounded to 32 bits after each step."""

    def __init__(self, model: Any, data: Any, velocities: Array, _: Variant) -> None:
        self.model, self.data, self.velocities = model, data, velocities
        self.qpos = data.qpos.copy()

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            mujoco.mj_step(self.model, self.data)
            self.data.qpos[:] = self.data.qpos.astype(np.float32)

    def command(self, control: tuple[float, ...]) -> None:
        self.data.ctrl[:] = control

    def reset(self) -> None:
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:], self.data.qvel[:] = self.qpos, self.velocities[0]

    def state(self) -> tuple[Array, Array]:
        return self.data.qpos.copy(), self.data.qvel.copy()


class Wild(Single):
    def state(self) -> tuple[Array, Array]:
        return self.data.qpos * np.nan, self.data.qvel


class Alone(Single):
    """Its process dies where there is more than one world."""

    def __init__(self, model: Any, data: Any, velocities: Array, variant: Variant) -> None:
        if len(velocities) > 1:
            os._exit(3)
        super().__init__(model, data, velocities, variant)


def picky(*_: object) -> Any:
    raise NotImplementedError("hinges are not\n  implemented")


def broken(*_: object) -> Any:
    raise ValueError("what " * 1000)


def crash(*_: object) -> Any:
    os._exit(7)


def hang(*_: object) -> Any:
    while True:
        time.sleep(1)


def engine(start: Any, title: str, module: str = "mujoco") -> Engine:
    return Engine(title, module, ("mujoco",), lambda _: [SINGLE], start)


def no_variants(_: int) -> list[Variant]:
    raise ImportError("no driver")


ENGINES = {
    "single": engine(Single, "Single"),
    "wild": engine(Wild, "Wild"),
    "alone": engine(Alone, "Alone"),
    "picky": engine(picky, "Picky"),
    "broken": engine(broken, "Broken"),
    "crash": engine(crash, "Crash"),
    "hang": engine(hang, "Hang"),
    "driverless": Engine("Driverless", "mujoco", ("mujoco",), no_variants, Single),
    "absent": engine(Single, "Absent", "an_engine_that_nobody_has"),
}
