"""Which coordinates of a model are left in a changed one, and states brought from one to the other.

Entry points: `IndexMap`, `index_map`, `transfer`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import mujoco
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from coursebuild.numerics.engine import STATE, full_state

Places: TypeAlias = NDArray[np.int64]
IndexMap: TypeAlias = Mapping[str, Places]
"""For each entry of the changed model the place that it has in the whole one, by the field with
their number, such as `nq`."""

_WIDTHS = {int(mujoco.mjtJoint.mjJNT_FREE): 7, int(mujoco.mjtJoint.mjJNT_BALL): 4}
"""Positions of a joint that has several."""
_STATE = {
    "qpos": "nq",
    "qvel": "nv",
    "act": "na",
    "ctrl": "nu",
    "qacc_warmstart": "nv",
    "qfrc_applied": "nv",
    "xfrc_applied": "nbody",
    "mocap_pos": "nmocap",
    "mocap_quat": "nmocap",
}
"""Parts of a state, and what they are numbered by."""
_KEYS = {"key_qpos": "nq", "key_qvel": "nv", "key_act": "na", "key_ctrl": "nu"}


class Removal(Struct, frozen=True):
    """What a change takes out of a compiled model, by number."""

    bodies: frozenset[int] = frozenset()
    """With all that hangs on them."""
    geoms: frozenset[int] = frozenset()
    sensors: frozenset[int] = frozenset()
    actuators: frozenset[int] = frozenset()


def index_map(model: Any, gone: Removal) -> IndexMap:
    """What is left of a model."""
    bodies = set(gone.bodies)
    for number in range(1, model.nbody):  # parents come first
        if int(model.body_parentid[number]) in bodies:
            bodies.add(number)
    body = np.setdiff1d(np.arange(model.nbody), [*bodies])
    mocap = model.body_mocapid[body]
    joints = np.flatnonzero(np.isin(model.jnt_bodyid, body))
    ctrl = np.setdiff1d(np.arange(model.nu), [*gone.actuators])
    sensors = np.setdiff1d(np.arange(model.nsensor), [*gone.sensors])
    geoms = np.setdiff1d(np.arange(model.ngeom), [*gone.geoms])
    widths = [_WIDTHS.get(int(kind), 1) for kind in model.jnt_type[joints]]
    return {
        "nq": _ranges(model.jnt_qposadr[joints], widths),
        "nv": np.flatnonzero(np.isin(model.dof_bodyid, body)),
        "na": _ranges(model.actuator_actadr[ctrl], model.actuator_actnum[ctrl]),
        "nu": ctrl,
        "nbody": body,
        "nmocap": mocap[mocap >= 0].astype(np.int64),
        "ngeom": geoms[np.isin(model.geom_bodyid[geoms], body)],
        "nsensordata": _ranges(model.sensor_adr[sensors], model.sensor_dim[sensors]),
    }


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
    if any(getattr(model, size) != len(places) for size, places in index.items()):
        return False
    return model.nkey != whole.nkey or all(
        np.array_equal(getattr(model, name), getattr(whole, name)[:, index[size]])
        for name, size in _KEYS.items()
    )


def transfer(model: Any, data: Any, index: IndexMap, other: Any, into: Any) -> None:
    """Bring a state of the whole model into data of the changed one, `other`.

    Raises:
        ValueError: a part of it (of a plugin, of a delay) cannot be told apart.
    """
    same = all(getattr(model, size) == getattr(other, size) for size in (*index, "neq"))
    if same and mujoco.mj_stateSize(model, STATE) == mujoco.mj_stateSize(other, STATE):
        mujoco.mj_setState(other, into, full_state(model, data), STATE)
        return
    delays = mujoco.mj_stateSize(other, int(mujoco.mjtState.mjSTATE_HISTORY))
    if other.npluginstate or delays:
        raise ValueError("its plugins or delays have states that cannot be told apart")
    if other.neq != model.neq:
        raise ValueError("it has other equalities")
    into.time = data.time
    for name, size in _STATE.items():
        getattr(into, name)[:] = getattr(data, name)[index[size]]
    into.eq_active[:] = data.eq_active
    into.userdata[:] = data.userdata
