"""Inertia tensors, spatial inertias and their composition.

Entry points: `parallel_axis`, `compose_inertia` (the body made of parts), `rotate_inertia`,
`inertia_from_principal`; `spatial_inertia`, `split_spatial_inertia` and `transform_spatial_inertia`
(6 × 6). `principal` has the principal axes, `solids` the tensors of simple shapes.

An inertia tensor is the symmetric 3 × 3 matrix ∫ ρ (|r|² 1 − r rᵀ) dV, in kg m², about a named
point and in the axes of a named frame. Masses are in kg, lengths in m.
"""

import numpy as np
from numpy.typing import ArrayLike

from mjcourse.spatial._arrays import (
    FloatArray,
    array,
    arrays,
    components,
    matrix,
    reject,
    symmetric,
)
from mjcourse.spatial.rotations import quat_to_mat, skew, unskew
from mjcourse.spatial.transforms import force_transform


def parallel_axis(inertia: ArrayLike, mass: ArrayLike, offset: ArrayLike) -> FloatArray:
    """The parallel-axis theorem: I + m (|d|² 1 − d dᵀ).

    Args:
        inertia: (..., 3, 3), kg m², about the centre of mass.
        mass: (...), kg.
        offset: (..., 3), m, from the centre of mass to the new point, or the other way: only its
            square counts.

    Returns:
        (..., 3, 3), kg m², about the new point, in the same axes; each entry to within 3 ulp of the
        larger of its two terms.

    Raises:
        ValueError: a bad shape, or leading shapes that do not broadcast.
    """
    inertia, mass, offset = arrays(
        ("inertia", inertia, (3, 3)), ("mass", mass, ()), ("offset", offset, (3,))
    )
    return inertia + _point_inertia(mass, offset)


def compose_inertia(
    mass: ArrayLike, com: ArrayLike, inertia: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mass, centre of mass and inertia tensor of a body, from those of its parts.

    A hole is a part of negative mass and negative inertia. Everything is computed from the heaviest
    part's centre, so that a body far from the origin of its frame loses no digits.

    Args:
        mass: (..., n), kg, of the n ≥ 1 parts; their sum must be positive.
        com: (..., n, 3), m, the parts' centres of mass in the body's frame.
        inertia: (..., n, 3, 3), kg m², each about the part's own centre, in the axes of the body's
            frame.

    Returns:
        Mass (...), kg; centre of mass (..., 3), m; inertia (..., 3, 3), kg m², about that centre,
        in the axes of the body's frame. With masses of one sign, the relative error is about n ulp
        of the largest entry.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, no part, or a total mass that
            is not positive.
    """
    mass, com, inertia = arrays(
        ("mass", mass, ()), ("com", com, (3,)), ("inertia", inertia, (3, 3))
    )
    for name, value, core, shape in (
        ("mass", mass, 0, "(..., n)"),
        ("com", com, 1, "(..., n, 3)"),
        ("inertia", inertia, 2, "(..., n, 3, 3)"),
    ):
        if value.ndim == core:
            raise ValueError(f"{name} must have shape {shape}, got {value.shape}")
    lead = np.broadcast_shapes(mass.shape, com.shape[:-1], inertia.shape[:-2])
    if lead[-1] == 0:
        raise ValueError("a body needs at least one part, got none")
    mass, com = np.broadcast_to(mass, lead), np.broadcast_to(com, (*lead, 3))
    total = mass.sum(axis=-1)
    reject(np.asarray(total <= 0), "total mass", "is not positive")
    heaviest = np.argmax(np.abs(mass), axis=-1)[..., None, None]
    origin = np.take_along_axis(com, heaviest, axis=-2)
    from_origin = com - origin
    centre = (mass[..., None] * from_origin).sum(axis=-2) / total[..., None]
    from_centre = from_origin - centre[..., None, :]
    tensor = (inertia + _point_inertia(mass, from_centre)).sum(axis=-3)
    return total, origin[..., 0, :] + centre, tensor


def rotate_inertia(inertia: ArrayLike, rot: ArrayLike) -> FloatArray:
    """The tensor in the axes of another frame: R I Rᵀ, exactly symmetric.

    Args:
        inertia: (..., 3, 3), kg m², in the axes of B.
        rot: (..., 3, 3), a rotation: of B in A.

    Returns:
        (..., 3, 3), kg m², in the axes of A, about the same point, to within 8 ulp of the largest
        moment.

    Raises:
        ValueError: a bad shape, or leading shapes that do not broadcast.
    """
    inertia, rot = arrays(("inertia", inertia, (3, 3)), ("rot", rot, (3, 3)))
    return symmetric(rot @ inertia @ np.swapaxes(rot, -1, -2))


def inertia_from_principal(moments: ArrayLike, quat: ArrayLike) -> FloatArray:
    """The tensor of principal moments and axes: R diag(moments) Rᵀ.

    From MuJoCo's `body_inertia` and `body_iquat` it makes the tensor in the body's axes.

    Args:
        moments: (..., 3), kg m².
        quat: (..., 4), the orientation of the principal axes in the frame whose axes are wanted, of
            any length but zero.

    Returns:
        (..., 3, 3), kg m², exactly symmetric, to within 8 ulp of the largest moment.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a zero quaternion.
    """
    moments, quat = arrays(("moments", moments, (3,)), ("quat", quat, (4,)))
    axes = quat_to_mat(quat)
    return symmetric((axes * moments[..., None, :]) @ np.swapaxes(axes, -1, -2))


def spatial_inertia(mass: ArrayLike, com: ArrayLike, inertia: ArrayLike) -> FloatArray:
    """The 6 × 6 inertia about a frame's origin, rotation first.

    [[I + m [c]× [c]×ᵀ, m [c]×], [m [c]×ᵀ, m 1]]: it takes a motion vector of the body to its
    momentum, and spatial inertias in one frame add when bodies are joined. Source: Featherstone
    2008, equation 2.63.

    Args:
        mass: (...), kg.
        com: (..., 3), m, the centre of mass c in the frame.
        inertia: (..., 3, 3), kg m², about the centre of mass, in the axes of the frame.

    Returns:
        (..., 6, 6): blocks in kg m², kg m and kg.

    Raises:
        ValueError: a bad shape, or leading shapes that do not broadcast.
    """
    mass, com, inertia = arrays(
        ("mass", mass, ()), ("com", com, (3,)), ("inertia", inertia, (3, 3))
    )
    lead = np.broadcast_shapes(mass.shape, com.shape[:-1], inertia.shape[:-2])
    first = np.broadcast_to(skew(mass[..., None] * com), (*lead, 3, 3))
    angular = np.broadcast_to(inertia + _point_inertia(mass, com), (*lead, 3, 3))
    linear = np.broadcast_to(mass[..., None, None] * np.eye(3), (*lead, 3, 3))
    return np.block([[angular, first], [np.swapaxes(first, -1, -2), linear]])


def split_spatial_inertia(
    spatial: ArrayLike,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mass, centre of mass and inertia tensor of a 6 × 6 inertia: `spatial_inertia` undone.

    Args:
        spatial: (..., 6, 6), rotation first.

    Returns:
        Mass (...), kg; centre of mass (..., 3), m; inertia (..., 3, 3), kg m², about the centre of
        mass. The inertia's error is a few ulp of m |c|² as well: far from the origin, the 6 × 6
        matrix no longer holds its digits.

    Raises:
        ValueError: a shape that is not (..., 6, 6), or a mass that is not positive.
    """
    whole = array("spatial", spatial, (6, 6))
    mass = np.trace(whole[..., 3:, 3:], axis1=-2, axis2=-1) / 3.0
    reject(np.asarray(mass <= 0), "mass", "is not positive")
    com = unskew(whole[..., :3, 3:]) / mass[..., None]
    return mass, com, symmetric(whole[..., :3, :3] - _point_inertia(mass, com))


def transform_spatial_inertia(spatial: ArrayLike, rot: ArrayLike, pos: ArrayLike) -> FloatArray:
    """The 6 × 6 inertia in another frame: F M Fᵀ with F the force transform, exactly symmetric.

    Args:
        spatial: (..., 6, 6), in B, rotation first.
        rot: (..., 3, 3), a rotation: of B in A.
        pos: (..., 3), m, of B's origin in A.

    Returns:
        (..., 6, 6), in A.

    Raises:
        ValueError: a bad shape, or leading shapes that do not broadcast.
    """
    pose = force_transform(rot, pos)
    whole, dual = arrays(("spatial", spatial, (6, 6)), ("pose", pose, (6, 6)))
    return symmetric(dual @ whole @ np.swapaxes(dual, -1, -2))


def _point_inertia(mass: FloatArray, offset: FloatArray) -> FloatArray:
    """The tensor m (|d|² 1 − d dᵀ), its diagonal without the cancellation of |d|² − d_k²."""
    x, y, z = components(offset)
    mx, my, mz = mass * x, mass * y, mass * z
    xx, yy, zz = mx * x, my * y, mz * z
    xy, xz, yz = 0.0 - mx * y, 0.0 - mx * z, 0.0 - my * z
    return matrix(((yy + zz, xy, xz), (xy, xx + zz, yz), (xz, yz, xx + yy)))
