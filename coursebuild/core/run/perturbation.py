"""Run a script with slightly moved initial states: which printed digits hold?

`perturb` changes the process of such a run:

1. What the script has put into `qpos`, `qvel` and `act` since MuJoCo last computed anything from
   them is an initial state: all of it for new data and after the clock went back. Before MuJoCo
   next computes from it, each number x becomes x (1 ± SIZE). Quaternions keep their length.
2. The sign belongs to the place of the number and to the number of the run: equal states are moved
   equally, so that what a script compares (two timesteps, a difference quotient) stays comparable.
   Runs come in pairs with opposite signs; those of the second pair are half as far away.
3. Zeros stay zero: most often they say that something rests or moves in a plane, which holds
   exactly, on every machine. But a kinematic tree that begins with nothing but zeros would then not
   move at all: its coordinates become ±SIZE, and its bodies turn by as much.
4. A state that the script restores bit by bit is no initial state: it was moved already. Nor is a
   correction in the last places, such as of the length of a quaternion.
5. The final state is noted, with the sizes that it is compared by, since it may well end near zero:
   the largest positions and velocities since the simulation began (new data, or the clock went
   back). Coordinates that began at zero and were moved all the same count as of size 1. Velocities
   are compared by at least the velocity that would lead as far as the positions in the whole time:
   those of a body at rest are only the trembling that moving it has left.

The model, the time, controls and forces stay as they are.
"""

from __future__ import annotations

import contextlib
import weakref
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

from coursebuild.core.run import mujoco_tracing

SIZE = 1e-12
"""Relative; for a state of zeros absolute, in the unit of the coordinate (rad, m)."""
_CORRECTION = 1e-9
"""Changes below this part of the largest number of a field only correct a rounding."""
_COMPUTING_FUNCTIONS = tuple(
    """
    mj_step mj_step1 mj_forward mj_forwardSkip mj_inverse mj_inverseSkip mj_fwdPosition
    mj_fwdKinematics mj_kinematics mj_collision mj_energyPos mj_energyVel mjd_transitionFD
    mjd_inverseFD
    """.split()
)
"""Functions before which an initial state is complete."""
_INTEGRATING = ("mj_step2", "mj_Euler", "mj_implicit", "mj_RungeKutta")
"""Functions that go on with what was computed."""
_MOST_KNOWN = 500_000
_MOST_NUMBERS = 8192
"""The most numbers of all final states that are noted."""
_DIVERGENCE_SIZE = 1e10
"""Larger numbers are those of a simulation that is lost."""


def perturb(mujoco: ModuleType, numpy: ModuleType, run: int) -> None:
    """Move the initial states of this process from now on; the run's number counts from 1."""
    global _perturbation
    _perturbation = _Perturbation(mujoco, numpy, run)


def note_final_state(data: Any) -> None:
    """Note the final state of an `MjData`."""
    if _perturbation is not None:
        _perturbation.note_final_state(data)


_perturbation: _Perturbation | None = None


class _Perturbation:
    def __init__(self, mujoco: Any, numpy: Any, run: int) -> None:
        self._mujoco = mujoco
        self._numpy = numpy
        self._run = run
        self._extents: dict[int, _Extent] = {}
        self._known_hashes: set[int] = set()
        self._plans: dict[int, tuple[Any, _Plan]] = {}
        self._count = 0
        self._numbers = 0
        wrap = mujoco_tracing.wrap_functions
        wrap(mujoco, _COMPUTING_FUNCTIONS, self._before, self._after)
        wrap(mujoco, _INTEGRATING, None, self._after)
        mujoco_tracing.replace_rollout(mujoco, self._rollout)

    # --- before and after MuJoCo computes

    def _before(self, args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
        model, data = model_and_data(args, keywords)
        extent = self._extents.get(id(data))
        if extent is None or extent.of() is not data:
            extent = self._extents[id(data)] = _Extent(data, self._count)
            self._count += 1
        elif _states(data) == extent.states and data.time >= extent.time:
            return
        begins = not extent.states or data.time < extent.time
        plan = self._get_plan(model)
        qpos, qvel, act = data.qpos, data.qvel, data.act
        old_states = extent.states if extent.states else (None, None, None)
        masks = [
            self._find_new(i, array, old, begins)
            for i, (array, old) in enumerate(zip((qpos, qvel, act), old_states, strict=True))
        ]
        zeros = qpos == 0
        has_moved = plan.move(qpos, qvel, act, masks, begins)
        if begins:
            extent.begin(data.time)
        extent.cover(data)
        extent.from_zero = extent.from_zero or bool((qpos[zeros] != 0).any())
        if has_moved:
            mujoco_tracing.active_tracer().note("p")
        self._remember(extent, data)

    def _after(self, args: tuple[Any, ...], keywords: Mapping[str, Any], result: Any) -> None:
        data = model_and_data(args, keywords)[1]
        extent = self._extents.get(id(data))
        if extent is not None and extent.of() is data:
            extent.cover(data)
            self._remember(extent, data)

    def _remember(self, extent: _Extent, data: Any) -> None:
        extent.time = data.time
        extent.states = states = _states(data)
        if len(self._known_hashes) < _MOST_KNOWN:
            self._known_hashes.update(hash((i, state)) for i, state in enumerate(states))

    def _find_new(self, field: int, array: Any, before: bytes | None, begins: bool) -> Any:
        """A mask of the numbers of a field that belong to an initial state."""
        numpy = self._numpy
        if hash((field, array.tobytes())) in self._known_hashes:
            return numpy.zeros(len(array), bool)
        if begins or before is None:
            return numpy.ones(len(array), bool)
        old = numpy.frombuffer(before)
        if len(old) != len(array):
            return numpy.ones(len(array), bool)
        largest = max(float(numpy.abs(array).max(initial=0.0)), 1e-300)
        return ~(numpy.abs(array - old) <= _CORRECTION * largest)

    def _get_plan(self, model: Any) -> _Plan:
        entry = self._plans.get(id(model))
        if entry is not None and entry[0]() is model:
            return entry[1]
        plan = _Plan(self._mujoco, self._numpy, model, self._run)
        self._plans[id(model)] = weakref.ref(model), plan
        return plan

    # --- rollouts

    def _rollout(self, real: Callable[..., Any]) -> Callable[..., Any]:
        def rollout(*args: Any, **keywords: Any) -> Any:
            """As MuJoCo's, from states that were moved."""
            with contextlib.suppress(Exception):  # MuJoCo says what is wrong with its arguments
                models, initial = args[1], args[5]
                states = self._numpy.array(initial, dtype=float, copy=True)
                rows = states.reshape(-1, states.shape[-1])
                models = models if isinstance(models, list) else [models]
                for i, row in enumerate(rows):
                    model = models[min(i, len(models) - 1)]
                    nq, nv, na = int(model.nq), int(model.nv), int(model.na)
                    qpos, qvel = row[1 : 1 + nq], row[1 + nq : 1 + nq + nv]  # the time comes first
                    act = row[1 + nq + nv : 1 + nq + nv + na]
                    fields = (qpos, qvel, act)
                    masks = [self._find_new(k, array, None, True) for k, array in enumerate(fields)]
                    if self._get_plan(model).move(*fields, masks, True):
                        mujoco_tracing.active_tracer().note("p")
                args = (*args[:5], states, *args[6:])
            return real(*args, **keywords)

        return rollout

    # --- the end

    def note_final_state(self, data: Any) -> None:
        extent = self._extents.get(id(data))
        if extent is None or extent.of() is not data:
            return
        del self._extents[id(data)]
        numbers = [*data.qpos.tolist(), *data.qvel.tolist()]
        self._numbers += len(numbers)
        if self._numbers <= _MOST_NUMBERS:
            parts = [str(extent.number), str(len(data.qpos))]
            parts += [x.hex() for x in (*extent.sizes(), *numbers)]
            mujoco_tracing.active_tracer().note(f"s{' '.join(parts)}")


class _Extent:
    """The last state of an `MjData` that MuJoCo computed with, and how far it has come."""

    def __init__(self, data: Any, number: int) -> None:
        self.of: Any = weakref.ref(data)
        self.number = number
        """Its number in the order in which data were first computed with."""
        self.time = float("inf")
        self.states: tuple[bytes, ...] = ()
        self.begin(0.0)

    def begin(self, time: float) -> None:
        self.start_time = self.until = time
        self.largest = [0.0, 0.0]
        """The largest |qpos| and |qvel| since then."""
        self.from_zero = False
        """Whether coordinates that were zero have been moved."""

    def cover(self, data: Any) -> None:
        if data.time < self.until:  # MuJoCo has reset what diverged
            self.begin(data.time)
        self.until = data.time
        for i, array in enumerate((data.qpos, data.qvel)):
            if len(array):
                largest = float(max(array.max(), -array.min()))
                if self.largest[i] < largest < _DIVERGENCE_SIZE:
                    self.largest[i] = largest

    def sizes(self) -> tuple[float, float]:
        """The sizes that positions and velocities are compared by."""
        position, velocity = self.largest
        if self.from_zero:
            position = max(position, 1.0)
        time = self.until - self.start_time
        return position, max(velocity, position / time if time > 0 else 0.0)


class _Plan:
    """Which numbers of a model's states are moved, and in which direction."""

    def __init__(self, mujoco: Any, numpy: Any, model: Any, run: int) -> None:
        self._numpy = numpy
        is_free = model.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE)
        is_ball = model.jnt_type == int(mujoco.mjtJoint.mjJNT_BALL)
        self._tree_of_dof = numpy.array(model.dof_treeid)
        trees = self._tree_of_dof[model.jnt_dofadr]
        self._tree_of_qpos = numpy.repeat(trees, numpy.where(is_free, 7, 1 + 3 * is_ball))
        starts = (model.jnt_qposadr + 3 * is_free)[is_free | is_ball]
        self._quaternions = starts[:, None] + numpy.arange(4)
        """The places of each in qpos, a row each."""
        self._is_plain = numpy.ones(int(model.nq), bool)
        """Which numbers are no part of a quaternion."""
        self._is_plain[self._quaternions] = False
        self._signs = [
            _signs(numpy, field, int(size), run)
            for field, size in enumerate((model.nq, model.nv, model.na))
        ]

    def move(self, qpos: Any, qvel: Any, act: Any, masks: list[Any], begins: bool) -> bool:
        """Move the masked numbers in place; return whether any changed."""
        numpy = self._numpy
        before = [array.copy() for array in (qpos, qvel, act)]
        new_parts = (masks[0] & self._is_plain, *masks[1:])
        for array, signs, mask in zip((qpos, qvel, act), self._signs, new_parts, strict=True):
            array[mask] *= 1.0 + SIZE * signs[mask]
        old = before[0][self._quaternions]
        is_turned = masks[0][self._quaternions].any(axis=1) & ((old != 0).sum(axis=1) > 1)
        places, old = self._quaternions[is_turned], old[is_turned]
        new = old * (1.0 + SIZE * self._signs[0][places])
        lengths, norms = (numpy.linalg.norm(q, axis=1, keepdims=True) for q in (old, new))
        qpos[places] = new * (lengths / norms)
        if begins:
            self._move_resting(before, qpos, masks[0])
        return any(
            not numpy.array_equal(a, b, equal_nan=True)
            for a, b in zip(before, (qpos, qvel, act), strict=True)
        )

    def _move_resting(self, before: list[Any], qpos: Any, mask: Any) -> None:
        """Move coordinates of trees that begin with nothing but zeros, and turn their bodies."""
        numpy, signs = self._numpy, self._signs[0]
        q, v = before[0], before[1]
        is_turned = (q[self._quaternions] != 0).sum(axis=1) > 1
        moved_trees = (
            self._tree_of_qpos[self._is_plain & (q != 0)],
            self._tree_of_dof[v != 0],
            self._tree_of_qpos[self._quaternions[is_turned, 0]],
        )
        is_resting = mask & ~numpy.isin(self._tree_of_qpos, numpy.concatenate(moved_trees))
        plain = is_resting & self._is_plain
        qpos[plain] = SIZE * signs[plain]
        imaginary = self._quaternions[is_resting[self._quaternions].all(axis=1), 1:]
        qpos[imaginary] = 0.5 * SIZE * signs[imaginary]


def _signs(numpy: Any, field: int, size: int, run: int) -> Any:
    """The directions of a field's numbers, by the number of the run.

    The second run of a pair has the opposite signs of the first; each further pair moves half as
    far, with every second number in the other direction.
    """
    pair, second = divmod(run - 1, 2)
    places = numpy.arange(size, dtype=numpy.uint64)
    bits = (places * 0x9E3779B1 + field * 0x85EBCA77 + 0x27D4EB2F) & 0xFFFFFFFF
    bits = ((bits ^ (bits >> 15)) * 0x2C1B3C6D) & 0xFFFFFFFF
    bits = ((bits ^ (bits >> 12)) * 0x297A2D39) & 0xFFFFFFFF
    is_odd = ((bits >> 16) + pair * places) & 1
    return numpy.where(is_odd, 1.0, -1.0) * ((-1.0 if second else 1.0) * 0.5**pair)


def _states(data: Any) -> tuple[bytes, ...]:
    return data.qpos.tobytes(), data.qvel.tobytes(), data.act.tobytes()


def model_and_data(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> tuple[Any, Any]:
    """The `MjModel` and the `MjData` in the arguments of one of MuJoCo's functions."""
    return args[0] if args else keywords["m"], args[1] if len(args) > 1 else keywords["d"]
