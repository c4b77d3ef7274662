"""What of MuJoCo lab code can use and have translated: names of the bindings and their types.

Entry points: `engine_field(path)`, an array or a number of the model or the data; `CALLS`.

In JavaScript every array is flat, in Python one of several numbers a row has two dimensions. A test
holds what is found here against the bindings of JavaScript.
"""

from __future__ import annotations

import functools
from typing import Any, Literal, TypeAlias

from msgspec import Struct

Element: TypeAlias = Literal["f64", "f32", "int"]
Scalar: TypeAlias = Literal["float", "int", "size"]
"""A `size` counts something of the model or the data, and is only read."""
_ELEMENTS: dict[str, Element] = {"f8": "f64", "f4": "f32", "i4": "int", "b1": "int"}


class ArrayField(Struct, frozen=True):
    """An array of the model or the data: what it holds, and whether NumPy sees rows."""

    element: Element
    rows: bool


def engine_field(path: tuple[str, ...]) -> ArrayField | Scalar | None:
    """What `("model", "opt", "gravity")` is; `None` for anything but numbers."""
    return _engine_fields().get(path)


@functools.cache
def _engine_fields() -> dict[tuple[str, ...], ArrayField | Scalar]:
    import mujoco  # only where a lab is translated anew

    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    owners: dict[tuple[str, ...], Any] = {
        ("model",): model,
        ("data",): mujoco.MjData(model),
        ("model", "opt"): model.opt,
        ("model", "stat"): model.stat,
    }
    return {
        (*owner, name): kind
        for owner, values in owners.items()
        for name in dir(values)
        if not name.startswith("_")
        if (kind := _kind(getattr(values, name), name, counted=len(owner) == 1)) is not None
    }


def _kind(value: Any, name: str, *, counted: bool) -> ArrayField | Scalar | None:
    """`counted`: whole numbers beside it are sizes."""
    if isinstance(value, float):
        return "float"
    if isinstance(value, int):
        return "int" if not counted else "size" if name.startswith("n") else None
    dtype = getattr(value, "dtype", None)
    element = None if dtype is None else _ELEMENTS.get(dtype.str[1:])
    return None if element is None else ArrayField(element, value.ndim > 1)


_STAGES = """
    mj_resetData mj_forward mj_inverse mj_step mj_step1 mj_step2 mj_fwdPosition mj_fwdVelocity
    mj_fwdActuation mj_fwdAcceleration mj_fwdConstraint mj_sensorPos mj_sensorVel mj_sensorAcc
    mj_energyPos mj_energyVel mj_kinematics mj_comPos mj_camlight mj_tendon mj_transmission mj_crb
    mj_collision mj_makeConstraint mj_projectConstraint mj_referenceConstraint mj_comVel mj_passive
    mj_subtreeVel mj_rnePostConstraint mj_setConst
"""
Argument: TypeAlias = Literal["model", "data", "int", "size", "str", "number"]
CALLS: dict[str, tuple[Argument, ...]] = {
    **dict.fromkeys(_STAGES.split(), ("model", "data")),
    "mj_resetDataKeyframe": ("model", "data", "size"),
    "mj_name2id": ("model", "int", "str"),
    "mj_getTotalmass": ("model",),
    "mj_setTotalmass": ("model", "number"),
}
"""Functions and what they take."""
RESULTS = {"mj_name2id": "int", "mj_getTotalmass": "float"}
"""What those give that give something."""
