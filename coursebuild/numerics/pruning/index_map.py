"""Which coordinates of a model are left in a changed one, and states brought from one to the other.

Entry points: `IndexMap`, `index_map`, `transfer`.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import mujoco
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from coursebuild.numerics.engine import STATE, full_state

Places: TypeAlias = NDArray[np.int64]

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


class IndexMap(Struct, frozen=True, eq=False):
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


def index_map(model: Any, gone: Gone) -> IndexMap:
    """What is left of a model."""
    bodies = set(gone.bodies)
    for number in range(1, model.nbody):  # parents come first
        if int(model.body_parentid[number]) in bodies:
            bodies.add(number)
    body = np.array([b for b in range(model.nbody) if b not in bodies], dtype=np.int64)
    mocap = model.body_mocapid[body]
    joints = np.flatnonzero(np.isin(model.jnt_bodyid, body))
    ctrl = [i for i in range(model.nu) if i not in gone.actuators]
    sensors = [i for i in range(model.nsensor) if i not in gone.sensors]
    geoms = np.flatnonzero(np.isin(model.geom_bodyid, body))
    sizes = [_POSITIONS.get(int(kind), 1) for kind in model.jnt_type[joints]]
    return IndexMap(
        qpos=_ranges(model.jnt_qposadr[joints], sizes),
        dof=np.flatnonzero(np.isin(model.dof_bodyid, body)),
        act=_ranges(model.actuator_actadr[ctrl], model.actuator_actnum[ctrl]),
        ctrl=np.array(ctrl, dtype=np.int64),
        body=body,
        mocap=mocap[mocap >= 0].astype(np.int64),
        geom=np.array([g for g in geoms.tolist() if g not in gone.geoms], dtype=np.int64),
        sensor=_ranges(model.sensor_adr[sensors], model.sensor_dim[sensors]),
        equal=not gone,
    )


_POSITIONS = {int(mujoco.mjtJoint.mjJNT_FREE): 7, int(mujoco.mjtJoint.mjJNT_BALL): 4}


def _ranges(starts: Any, counts: Any) -> Places:
    """Ranges of places one after the other; one that begins before 0 is empty."""
    found = [
        place
        for start, count in zip(starts, counts, strict=True)
        for place in (range(start, start + count) if start >= 0 else ())
    ]
    return np.array(found, dtype=np.int64)


def fits(index: IndexMap, whole: Any, model: Any) -> bool:
    """Whether a changed model has just what should be left of the whole one, in keyframes too."""
    left = {
        "nq": index.qpos,
        "nv": index.dof,
        "na": index.act,
        "nu": index.ctrl,
        "nbody": index.body,
        "nmocap": index.mocap,
        "ngeom": index.geom,
        "nsensordata": index.sensor,
    }
    if any(getattr(model, size) != len(places) for size, places in left.items()):
        return False
    keys = {
        "key_qpos": index.qpos,
        "key_qvel": index.dof,
        "key_act": index.act,
        "key_ctrl": index.ctrl,
    }
    return model.nkey != whole.nkey or all(
        np.array_equal(getattr(model, name), getattr(whole, name)[:, places])
        for name, places in keys.items()
    )


def transfer(model: Any, data: Any, index: IndexMap, other: Any, into: Any) -> None:
    """Bring a state of the whole model into data of the changed one, `other`.

    Raises:
        ValueError: a part of it (of a plugin, of a delay) cannot be told apart.
    """
    same = all(getattr(model, size) == getattr(other, size) for size in _SIZES)
    sizes = {mujoco.mj_stateSize(one, STATE) for one in (model, other)}
    if index.equal and same and len(sizes) == 1:
        mujoco.mj_setState(other, into, full_state(model, data), STATE)
        return
    delays = mujoco.mj_stateSize(other, int(mujoco.mjtState.mjSTATE_HISTORY))
    if other.npluginstate or delays:
        raise ValueError("its plugins or delays have states that cannot be told apart")
    if other.neq != model.neq:
        raise ValueError("it has other equalities")
    into.time = data.time
    into.qpos[:] = data.qpos[index.qpos]
    into.qvel[:] = data.qvel[index.dof]
    into.act[:] = data.act[index.act]
    into.ctrl[:] = data.ctrl[index.ctrl]
    into.qacc_warmstart[:] = data.qacc_warmstart[index.dof]
    into.qfrc_applied[:] = data.qfrc_applied[index.dof]
    into.xfrc_applied[:] = data.xfrc_applied[index.body]
    into.mocap_pos[:] = data.mocap_pos[index.mocap]
    into.mocap_quat[:] = data.mocap_quat[index.mocap]
    into.eq_active[:] = data.eq_active
    into.userdata[:] = data.userdata
