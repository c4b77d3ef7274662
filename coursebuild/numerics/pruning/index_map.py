"""Which coordinates of a model a pruned variant still has, and the transfer of states to it.

Entry points: `IndexMap`, `index_map`, `transfer`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from coursebuild.numerics.engine import STATE, full_state

Places: TypeAlias = NDArray[np.int64]
IndexMap: TypeAlias = Mapping[str, Places]
"""For each entry of the variant its place in the whole model, by the field with their number, such
as `nq`."""

_WIDTHS = {int(mujoco.mjtJoint.mjJNT_FREE): 7, int(mujoco.mjtJoint.mjJNT_BALL): 4}
"""The number of positions of joints that have several."""
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
"""Parts of a state, with the field of their length."""
KEY_SIZES = {"qpos": "nq", "qvel": "nv", "act": "na", "ctrl": "nu"}
"""Attributes of a keyframe, with the field of their length; mocap bodies are never removed."""


def index_map(model: Any, losses: Mapping[str, Collection[int]]) -> IndexMap:
    """The places in a model that are left without things of some kinds, given by number.

    Those are `body`, whose descendants go too, `geom`, `sensor` and `actuator`.
    """
    bodies = set(losses.get("body", ()))
    for number in range(1, model.nbody):  # parents come first
        if int(model.body_parentid[number]) in bodies:
            bodies.add(number)
    body = np.setdiff1d(np.arange(model.nbody), [*bodies])
    mocap = model.body_mocapid[body]
    joints = np.flatnonzero(np.isin(model.jnt_bodyid, body))
    ctrl = np.setdiff1d(np.arange(model.nu), [*losses.get("actuator", ())])
    sensors = np.setdiff1d(np.arange(model.nsensor), [*losses.get("sensor", ())])
    geoms = np.setdiff1d(np.arange(model.ngeom), [*losses.get("geom", ())])
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
    places = [
        place
        for start, count in zip(starts, counts, strict=True)
        for place in (range(start, start + count) if start >= 0 else ())
    ]
    return np.array(places, dtype=np.int64)


def fits(index: IndexMap, whole: Any, model: Any) -> bool:
    """Whether a variant has exactly what should be left of the whole model, in keyframes too."""
    if any(getattr(model, size) != len(places) for size, places in index.items()):
        return False
    return model.nkey != whole.nkey or all(
        np.array_equal(getattr(model, f"key_{name}"), getattr(whole, f"key_{name}")[:, index[size]])
        for name, size in KEY_SIZES.items()
    )


def transfer(model: Any, data: Any, index: IndexMap, variant: Any, variant_data: Any) -> None:
    """Bring a state of the whole model into the data of a variant.

    Raises:
        ValueError: a part of the state (of a plugin, of a delay) cannot be assigned.
    """
    is_same_size = all(getattr(model, size) == getattr(variant, size) for size in (*index, "neq"))
    if is_same_size and mujoco.mj_stateSize(model, STATE) == mujoco.mj_stateSize(variant, STATE):
        mujoco.mj_setState(variant, variant_data, full_state(model, data), STATE)
        return
    delays = mujoco.mj_stateSize(variant, int(mujoco.mjtState.mjSTATE_HISTORY))
    if variant.npluginstate or delays:
        raise ValueError("its plugins or delays have states that cannot be told apart")
    if variant.neq != model.neq:
        raise ValueError("it has other equalities")
    variant_data.time = data.time
    for name, size in _STATE.items():
        getattr(variant_data, name)[:] = getattr(data, name)[index[size]]
    variant_data.eq_active[:] = data.eq_active
    variant_data.userdata[:] = data.userdata
