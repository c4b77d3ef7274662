"""A controller in the loop: `control(model, data) -> ctrl`, at its own rate.

1. It is asked at the first step that begins at each whole number of its periods, or at every step
   where these are longer. What it says holds from the first step that begins `delay` later.
2. It sees a copy of the state, all of which is computed anew: what it writes there changes nothing.
3. Its file is run anew for each simulation, so that it may remember what it likes.
4. Noise depends on the number of the period alone, so that all timesteps have the same.
"""

from __future__ import annotations

import math
import sys
import time
import weakref
from collections import deque
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, redirect_stdout
from pathlib import Path
from types import CodeType
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray


class LoopError(Exception):
    """A controller cannot be used; the message says why, and names its file."""


def program_output() -> AbstractContextManager[Any]:
    """Let what a program of the user's prints go to where errors go: the output is the report's."""
    return redirect_stdout(sys.stderr)


class Loop(Struct, frozen=True, eq=False):
    """A controller, and how it is asked."""

    path: str
    code: CodeType
    """Defines `control(model, data)`, which gives the commands (nu,)."""
    period: float
    """s."""
    delay: float = 0.0
    """s, from a state to the first step under the commands that answer it."""
    noise: float = 0.0
    """The standard deviation of commands, relative to their range where they have one."""

    def timestep_below(self, timestep: float) -> float:
        """The longest timestep up to one (s) at which commands are on time.

        It divides the period, or is longer: then commands come at every step.
        """
        count = math.ceil(self.period / timestep * (1 - 1e-9))
        return timestep if timestep >= self.period else self.period / count


def read_loop(file: Path, period: float | None, delay: float, noise: float) -> Loop:
    """The controller in a file; without a `period` (s) the file's own `period` counts.

    A `LoopError` where there is none, or it defines no `control`.
    """
    try:
        code = compile(file.read_bytes(), str(file), "exec")
    except (SyntaxError, ValueError) as error:
        raise LoopError(f"{file} is no Python: {error}") from None
    loop = Loop(str(file), code, 1.0 if period is None else period, delay, noise)
    names = _names(loop)
    period = names.get("period") if period is None else period
    if not callable(names.get("control")):
        raise LoopError(f"{file} defines no `control(model, data)`")
    if not isinstance(period, int | float) or not 0 < period < math.inf:
        raise LoopError(
            f"how often is {file} asked? Define `period`, in s, there, or give --period"
        )
    if not (0 <= delay < math.inf and 0 <= noise < math.inf):
        raise LoopError("a delay and a noise are 0 or more")
    return replace(loop, period=float(period))


def _names(loop: Loop) -> dict[str, Any]:
    """What the file of a controller defines, run anew."""
    names: dict[str, Any] = {"__name__": "__mjbench__", "__file__": loop.path}
    try:
        with program_output():
            exec(loop.code, names)
    except (Exception, SystemExit) as error:
        raise LoopError(f"{loop.path} fails: {type(error).__name__}: {error}") from error
    return names


class _LoopRun:
    """A loop in one simulation."""

    def __init__(self, loop: Loop, model: Any) -> None:
        self._loop = loop
        self._control = _names(loop)["control"]
        self._copy = mujoco.MjData(model)
        self._next = 0
        self._late: deque[tuple[float, NDArray[np.float64]]] = deque()

    def command(self, model: Any, data: Any) -> None:
        """Give `data` the commands for the step that begins."""
        early = 1e-6 * float(model.opt.timestep)  # times are sums of timesteps
        time, loop = data.time + early, self._loop
        if time >= self._next * loop.period and np.isfinite(data.qpos).all():
            number = math.floor(time / loop.period)
            self._late.append((number * loop.period + loop.delay, self._ask(model, data, number)))
            self._next = number + 1
        while self._late and time >= self._late[0][0]:
            data.ctrl[:] = self._late.popleft()[1]

    def _ask(self, model: Any, data: Any, number: int) -> NDArray[np.float64]:
        loop, copy = self._loop, self._copy
        mujoco.mj_copyState(model, data, copy, int(mujoco.mjtState.mjSTATE_INTEGRATION))
        mujoco.mj_forward(model, copy)
        try:
            with program_output():
                answer = self._control(model, copy)
            commands = np.array([] if answer is None else answer, dtype=np.float64).ravel()
        except (Exception, SystemExit) as error:
            reason = f"{type(error).__name__}: {error}"
            raise LoopError(f"{loop.path} fails at {data.time:g} s: {reason}") from error
        if len(commands) != model.nu:
            message = f"the number of commands is {model.nu}, and {loop.path} "
            message += "returns none" if answer is None else f"gives {len(commands)}"
            raise LoopError(message)
        if loop.noise:
            limited = model.actuator_ctrllimited != 0
            spans = np.where(limited, np.ptp(model.actuator_ctrlrange, axis=1), 1.0)
            random = np.random.default_rng((1, number))
            commands += loop.noise * spans * random.standard_normal(int(model.nu))
        return commands


_runs: weakref.WeakKeyDictionary[Any, _LoopRun] = weakref.WeakKeyDictionary()


def close_loop(loop: Loop, model: Any, data: Any) -> None:
    """Let a controller command `data` from now on, wherever `step` advances it."""
    _runs[data] = _LoopRun(loop, model)


class TimeLimitError(Exception):
    """The time of what is measured is over."""


_deadlines = [math.inf]
"""When steps end to be made, the one that holds now last."""


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Give what is done here so many seconds at most, or what an outer limit leaves of them."""
    _deadlines.append(min(time.monotonic() + seconds, _deadlines[-1]))
    try:
        yield
    finally:
        _deadlines.pop()


def time_left() -> float:
    """What the limit leaves, s; infinite without one."""
    return _deadlines[-1] - time.monotonic()


def step(model: Any, data: Any, steps: int) -> None:
    """As `mj_step`, with the controller that commands `data`, if one does.

    A `TimeLimitError` where no time is left.
    """
    if time_left() <= 0:
        raise TimeLimitError
    run = _runs.get(data)
    if run is None:
        mujoco.mj_step(model, data, steps)
        return
    for _ in range(steps):
        run.command(model, data)
        mujoco.mj_step(model, data)
