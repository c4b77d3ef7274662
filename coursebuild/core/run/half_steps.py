"""Run a script with each step of its simulations made as two of half the timestep.

Entry point: `install`, in the process of such a run.

1. Both halves have the commands and forces that the script has set for the whole. Then the clock is
   set to what it would have been, so that a script that counts steps, or looks at the clock, makes
   as many calls as before.
2. The model's timestep is halved only during the step: the script reads and sets its own.
3. Rollouts are made with each row of controls twice, and give every second state.

What a script integrates itself, without one of MuJoCo's functions that make a step, is not halved.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Sequence
from types import ModuleType
from typing import Any

from coursebuild.core.run import mujoco_tracing

_INTEGRATORS = ("mj_Euler", "mj_implicit", "mj_RungeKutta")
"""Integrators; a script has computed the accelerations itself before it calls one."""


def install(mujoco: ModuleType, numpy: ModuleType) -> None:
    """Halve the steps of this process from now on."""
    _HalfSteps(mujoco, numpy)


class _HalfSteps:
    """Replaces MuJoCo's functions when it is made."""

    def __init__(self, mujoco: Any, numpy: Any) -> None:
        self._mujoco = mujoco
        self._numpy = numpy
        self._step, self._forward = mujoco.mj_step, mujoco.mj_forward
        self._lock = threading.RLock()  # threads may share a model
        self._replace("mj_step", self._whole)
        self._replace("mj_step1", lambda real, model, data: real(model, data))
        self._replace("mj_step2", self._second)
        for name in _INTEGRATORS:
            self._replace(name, self._integrate)
        mujoco_tracing.replace_rollout(self._mujoco, self._rollout)

    def _replace(self, name: str, halved: Callable[..., None]) -> None:
        """Replace a function that makes a step by one that makes two half steps."""
        real = getattr(self._mujoco, name)

        def function(m: Any, d: Any, *args: Any, **keywords: Any) -> None:
            if not isinstance(m, self._mujoco.MjModel) or not isinstance(d, self._mujoco.MjData):
                real(m, d, *args, **keywords)  # it says what is wrong
                return
            with self._half([m]):
                halved(real, m, d, *args, **keywords)

        new = mujoco_tracing.wrap_function(function, like=real)
        mujoco_tracing.replace_function(self._mujoco, name, new)

    def _whole(self, real: Callable[..., None], model: Any, data: Any, nstep: int = 1) -> None:
        with self._clock(model, data, nstep):
            real(model, data, 2 * nstep)

    def _second(self, real: Callable[..., None], model: Any, data: Any) -> None:
        with self._clock(model, data, 1):
            real(model, data)
            self._step(model, data)

    def _integrate(self, real: Callable[..., None], model: Any, data: Any, *stages: int) -> None:
        with self._clock(model, data, 1):
            real(model, data, *stages)
            self._forward(model, data)
            real(model, data, *stages)

    @contextlib.contextmanager
    def _half(self, models: Sequence[Any]) -> Iterator[None]:
        with self._lock:
            whole = [float(model.opt.timestep) for model in models]
            for model, timestep in zip(models, whole, strict=True):
                model.opt.timestep = timestep / 2
            try:
                yield
            finally:
                for model, timestep in zip(models, whole, strict=True):
                    model.opt.timestep = timestep

    @contextlib.contextmanager
    def _clock(self, model: Any, data: Any, steps: int) -> Iterator[None]:
        """Set the clock to where whole steps lead, unless MuJoCo resets it."""
        timestep, time = 2 * float(model.opt.timestep), float(data.time)
        yield
        for _ in range(steps):
            time += timestep
        if abs(data.time - time) < timestep / 4:
            data.time = time
        mujoco_tracing.note("p")

    def _rollout(self, real: Callable[..., None]) -> Callable[..., None]:
        numpy = self._numpy

        def double_rows(array: Any) -> Any:
            return array if array is None else numpy.repeat(array, 2, axis=1)

        def rollout(of: Any, models: Any, data: Any, nstep: int, spec: int, *rest: Any) -> None:
            """As MuJoCo's, in half steps."""
            begin, warm, control, *outputs = rest[:5]
            half_outputs = [double_rows(output) for output in outputs]
            controls = double_rows(control)
            with self._half(list({id(model): model for model in models}.values())):
                real(
                    of,
                    models,
                    data,
                    2 * nstep,
                    spec,
                    begin,
                    warm,
                    controls,
                    *half_outputs,
                    *rest[5:],
                )
            for output, halves in zip(outputs, half_outputs, strict=True):
                if output is not None and halves is not None:
                    output[:] = halves[:, 1::2]
            mujoco_tracing.note("p")

        return rollout
