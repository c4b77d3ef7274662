"""Which coordinates of a model are left in a changed one, and states brought from one to the other.

Entry points: `Mapping`, `mapping_without`, `transfer`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import mujoco
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

Places: TypeAlias = NDArray[np.int64]

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_SIZES = ("nq", "nv", "na", "nu", "nbody", "nmocap", "ngeom", "nsensordata", "nuserdata", "neq")


class Gone(Struct, frozen=True):
    """What a change takes out of a compiled model, by number."""

    bodies: frozenset[int] = frozenset()
    """With all that hangs on them."""
    geoms: frozenset[int] = frozenset()
    sensors: frozenset[int] = frozenset()
    actuators: frozenset[int] = frozenset()

    def __bool__(self) -> bool:
        return bool(self.bodies or self.geoms or self.sensors or self.actuators)


class Mapping(Struct, frozen=True, eq=False):
    """For each entry of the changed model, the place that it has in the whole one."""

    qpos: Places
    dof: Places
    act: Places
    ctrl: Places
    body: Places
    mocap: Places
    geom: Places
    sensor: Places
    """Of `sensordata`."""
    equal: bool
    """Whether nothing of these is gone."""


def mapping_without(model: Any, gone: Gone) -> Mapping:
    """What is left of a model."""
    bodies = _with_descendants(model, gone.bodies)
    body = _left(model.nbody, bodies)
    joints = [j for j in range(model.njnt) if int(model.jnt_bodyid[j]) not in bodies]
    qpos: list[int] = []
    for j in joints:
        start = int(model.jnt_qposadr[j])
        qpos += range(start, start + _positions(int(model.jnt_type[j])))
    dof = [d for d in range(model.nv) if int(model.dof_bodyid[d]) not in bodies]
    ctrl = _left(model.nu, gone.actuators)
    act: list[int] = []
    for i in ctrl:
        start, count = int(model.actuator_actadr[i]), int(model.actuator_actnum[i])
        act += range(start, start + count) if start >= 0 else ()
    sensor: list[int] = []
    for i in _left(model.nsensor, gone.sensors):
        start = int(model.sensor_adr[i])
        sensor += range(start, start + int(model.sensor_dim[i]))
    geom = [
        g
        for g in range(model.ngeom)
        if g not in gone.geoms and int(model.geom_bodyid[g]) not in bodies
    ]
    mocap = [int(model.body_mocapid[b]) for b in body if int(model.body_mocapid[b]) >= 0]
    return Mapping(
        qpos=_places(qpos),
        dof=_places(dof),
        act=_places(act),
        ctrl=_places(ctrl),
        body=_places(body),
        mocap=_places(mocap),
        geom=_places(geom),
        sensor=_places(sensor),
        equal=not gone,
    )


def _places(numbers: Sequence[int]) -> Places:
    return np.array(numbers, dtype=np.int64)


def fits(mapping: Mapping, whole: Any, model: Any) -> bool:
    """Whether a changed model has just what should be left of the whole one, in keyframes too."""
    sizes = (model.nq, model.nv, model.na, model.nu, model.nbody, model.nmocap, model.ngeom)
    left = (mapping.qpos, mapping.dof, mapping.act, mapping.ctrl, mapping.body, mapping.mocap)
    wanted = tuple(len(one) for one in (*left, mapping.geom))
    if sizes != wanted or model.nsensordata != len(mapping.sensor):
        return False
    if model.nkey != whole.nkey:
        return True
    return (
        np.array_equal(model.key_qpos, whole.key_qpos[:, mapping.qpos])
        and np.array_equal(model.key_qvel, whole.key_qvel[:, mapping.dof])
        and np.array_equal(model.key_act, whole.key_act[:, mapping.act])
        and np.array_equal(model.key_ctrl, whole.key_ctrl[:, mapping.ctrl])
    )


def transfer(model: Any, data: Any, mapping: Mapping, other: Any, into: Any) -> None:
    """Bring a state of the whole model into data of the changed one, `other`.

    Raises:
        ValueError: a part of it (of a plugin, of a delay) cannot be told apart.
    """
    same = all(getattr(model, size) == getattr(other, size) for size in _SIZES)
    size = mujoco.mj_stateSize(model, _STATE)
    if mapping.equal and same and mujoco.mj_stateSize(other, _STATE) == size:
        state = np.empty(size)
        mujoco.mj_getState(model, data, state, _STATE)
        mujoco.mj_setState(other, into, state, _STATE)
        return
    if other.npluginstate or _history(other):
        raise ValueError("its plugins or delays have states that cannot be told apart")
    if other.neq != model.neq:
        raise ValueError("it has other equalities")
    into.time = data.time
    into.qpos[:] = data.qpos[mapping.qpos]
    into.qvel[:] = data.qvel[mapping.dof]
    into.act[:] = data.act[mapping.act]
    into.ctrl[:] = data.ctrl[mapping.ctrl]
    into.qacc_warmstart[:] = data.qacc_warmstart[mapping.dof]
    into.qfrc_applied[:] = data.qfrc_applied[mapping.dof]
    into.xfrc_applied[:] = data.xfrc_applied[mapping.body]
    into.mocap_pos[:] = data.mocap_pos[mapping.mocap]
    into.mocap_quat[:] = data.mocap_quat[mapping.mocap]
    into.eq_active[:] = data.eq_active
    into.userdata[:] = data.userdata


def _history(model: Any) -> int:
    return int(mujoco.mj_stateSize(model, int(mujoco.mjtState.mjSTATE_HISTORY)))


def _left(count: int, gone: frozenset[int]) -> list[int]:
    return [i for i in range(count) if i not in gone]


def _with_descendants(model: Any, bodies: frozenset[int]) -> frozenset[int]:
    found = set(bodies)
    for body in range(1, model.nbody):  # parents come first
        if int(model.body_parentid[body]) in found:
            found.add(body)
    return frozenset(found)


def _positions(kind: int) -> int:
    return {0: 7, 1: 4}.get(kind, 1)
