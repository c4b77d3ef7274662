"""Run a script with shorter steps, or look at its motion at other instants: what is converged?"""

from __future__ import annotations

import contextlib
import copy
import threading
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import ModuleType
from typing import Any

from coursebuild.core.run import mujoco_tracing
from coursebuild.core.run.perturbation import model_and_data


def change_steps(mujoco: ModuleType, numpy: ModuleType, run: int) -> None:
    """Change the steps of this process from now on.

    The run's number: −1 makes each step as two, −2 as four; −3 to −5 shift them by thirds.
    """
    if run >= -2:
        DividedSteps(mujoco, numpy, 2**-run)
    else:
        ShiftedSteps(mujoco, (-run - 2) / 3)


_INTEGRATORS = ("mj_Euler", "mj_implicit", "mj_RungeKutta")
"""Integrators; a script has computed the accelerations itself before it calls one."""


class DividedSteps:
    """Makes each step of this process from now on as so many, with that part of the timestep.

    1. All parts have the commands and forces that the script has set for the whole. Then the
       clock is set to what it would have been, so that a script that counts steps, or looks at the
       clock, makes as many calls as before.
    2. The model's timestep is divided only during the step: the script reads and sets its own.
    3. Rollouts are made with each row of controls repeated, and give the state after all parts.

    What a script integrates itself, without a function of MuJoCo's that makes a step, stays whole.
    """

    def __init__(self, mujoco: Any, numpy: Any, parts: int) -> None:
        self._mujoco = mujoco
        self._numpy = numpy
        self._parts = parts
        self._step, self._forward = mujoco.mj_step, mujoco.mj_forward
        self._lock = threading.RLock()  # threads may share a model
        self._replace("mj_step", self._whole)
        self._replace("mj_step1", lambda real, model, data: real(model, data))
        self._replace("mj_step2", self._second)
        for name in _INTEGRATORS:
            self._replace(name, self._integrate)
        mujoco_tracing.replace_rollout(self._mujoco, self._rollout)

    def _replace(self, name: str, divided: Callable[..., None]) -> None:
        real = getattr(self._mujoco, name)

        def function(m: Any, d: Any, *args: Any, **keywords: Any) -> None:
            if not isinstance(m, self._mujoco.MjModel) or not isinstance(d, self._mujoco.MjData):
                real(m, d, *args, **keywords)  # it says what is wrong
                return
            with self._part_of([m]):
                divided(real, m, d, *args, **keywords)

        new = mujoco_tracing.wrap_function(function, like=real)
        mujoco_tracing.replace_function(self._mujoco, name, new)

    def _whole(self, real: Callable[..., None], model: Any, data: Any, nstep: int = 1) -> None:
        with self._clock(model, data, nstep):
            real(model, data, self._parts * nstep)

    def _second(self, real: Callable[..., None], model: Any, data: Any) -> None:
        with self._clock(model, data, 1):
            real(model, data)
            self._step(model, data, self._parts - 1)

    def _integrate(self, real: Callable[..., None], model: Any, data: Any, *stages: int) -> None:
        with self._clock(model, data, 1):
            real(model, data, *stages)
            for _ in range(1, self._parts):
                self._forward(model, data)
                real(model, data, *stages)

    @contextlib.contextmanager
    def _part_of(self, models: Sequence[Any]) -> Iterator[None]:
        with self._lock:
            whole = [float(model.opt.timestep) for model in models]
            for model, timestep in zip(models, whole, strict=True):
                model.opt.timestep = timestep / self._parts
            try:
                yield
            finally:
                for model, timestep in zip(models, whole, strict=True):
                    model.opt.timestep = timestep

    @contextlib.contextmanager
    def _clock(self, model: Any, data: Any, steps: int) -> Iterator[None]:
        """Set the clock to where whole steps lead, unless MuJoCo resets it."""
        timestep, time = self._parts * float(model.opt.timestep), float(data.time)
        yield
        for _ in range(steps):
            time += timestep
        if abs(data.time - time) < timestep / (2 * self._parts):
            data.time = time
        mujoco_tracing.active_tracer().note("p")

    def _rollout(self, real: Callable[..., None]) -> Callable[..., None]:
        numpy, parts = self._numpy, self._parts

        def repeat_rows(array: Any) -> Any:
            return array if array is None else numpy.repeat(array, parts, axis=1)

        def rollout(of: Any, models: Any, data: Any, nstep: int, spec: int, *rest: Any) -> None:
            """As MuJoCo's, in shorter steps."""
            begin, warm, control, *outputs = rest[:5]
            all_outputs = [repeat_rows(output) for output in outputs]
            arrays = (begin, warm, repeat_rows(control), *all_outputs)
            with self._part_of(list({id(model): model for model in models}.values())):
                real(of, models, data, parts * nstep, spec, *arrays, *rest[5:])
            for output, states in zip(outputs, all_outputs, strict=True):
                if output is not None and states is not None:
                    output[:] = states[:, parts - 1 :: parts]
            mujoco_tracing.active_tracer().note("p")

        return rollout


class ShiftedSteps:
    """Lets each simulation of this process be ahead of its clock by a part of a timestep.

    Before the first step of new data, or after the clock went back, a step of that part is made of
    which the script sees nothing but the state. So the script looks at the same motion at other
    instants, and a time that it finds by looking at every step differs by a timestep or not at all.
    """

    def __init__(self, mujoco: Any, part: float) -> None:
        self._part = part
        self._step = mujoco.mj_step
        self._last_times: dict[int, tuple[Any, float]] = {}
        mujoco_tracing.wrap_functions(mujoco, ("mj_step", "mj_step1"), self._before, self._after)

    def _before(self, args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
        model, data = model_and_data(args, keywords)
        owner, last_time = self._last_times.get(id(data), (None, 0.0))
        if owner is not None and owner() is data and data.time >= last_time:
            return
        model, time = copy.copy(model), data.time  # threads may share the model
        model.opt.timestep *= self._part
        self._step(model, data)
        data.time = time
        mujoco_tracing.active_tracer().note("p")

    def _after(self, args: tuple[Any, ...], keywords: Mapping[str, Any], result: Any) -> None:
        data = model_and_data(args, keywords)[1]
        self._last_times[id(data)] = weakref.ref(data), data.time
