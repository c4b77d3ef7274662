"""Inertia tensors of uniform solids about their centres, in their own axes.

Entry points: `box_inertia`, `sphere_inertia`, `ellipsoid_inertia`, `cylinder_inertia`,
`capsule_inertia`.

Sizes are MuJoCo's geom sizes: half-lengths and radii, in m, the axis of a cylinder or capsule being
z. A size of zero is a solid without that extent, as a plate or a rod is; a negative one is a
ValueError.
"""

import numpy as np
from numpy.typing import ArrayLike

from mjcourse.spatial._arrays import FloatArray, arrays, components, reject


def box_inertia(mass: ArrayLike, half_sizes: ArrayLike) -> FloatArray:
    """The tensor of a box: m/3 (b² + c²) about x, and so on.

    Args:
        mass: (...), kg.
        half_sizes: (..., 3), m.

    Returns:
        (..., 3, 3), kg m², diagonal, to within 4 ulp.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a negative size.
    """
    return _three_axes(mass, "half_sizes", half_sizes, 3.0)


def ellipsoid_inertia(mass: ArrayLike, semi_axes: ArrayLike) -> FloatArray:
    """The tensor of an ellipsoid: m/5 (b² + c²) about x, and so on.

    Args:
        mass: (...), kg.
        semi_axes: (..., 3), m.

    Returns:
        (..., 3, 3), kg m², diagonal, to within 4 ulp.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a negative size.
    """
    return _three_axes(mass, "semi_axes", semi_axes, 5.0)


def sphere_inertia(mass: ArrayLike, radius: ArrayLike) -> FloatArray:
    """The tensor of a sphere: 2/5 m r².

    Args:
        mass: (...), kg.
        radius: (...), m.

    Returns:
        (..., 3, 3), kg m², diagonal, to within 3 ulp.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a negative radius.
    """
    m, (r,) = _read_sizes(mass, ("radius", radius))
    moment = 0.4 * m * r * r
    return _diagonal(moment, moment, moment)


def cylinder_inertia(mass: ArrayLike, radius: ArrayLike, half_length: ArrayLike) -> FloatArray:
    """The tensor of a cylinder about z: m r²/2 about its axis, m (r²/4 + h²/3) across.

    Args:
        mass: (...), kg.
        radius: (...), m.
        half_length: (...), m: h.

    Returns:
        (..., 3, 3), kg m², diagonal, to within 5 ulp.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a negative size.
    """
    m, (r, h) = _read_sizes(mass, ("radius", radius), ("half_length", half_length))
    transverse, axial = _cylinder(m, r, h)
    return _diagonal(transverse, transverse, axial)


def capsule_inertia(mass: ArrayLike, radius: ArrayLike, half_length: ArrayLike) -> FloatArray:
    """The tensor of a capsule about z: a cylinder between two half spheres, of one density.

    A half sphere of mass μ has its centre of mass 3r/8 beyond its flat face, which lies h from the
    capsule's centre: across the axis it adds μ (2r²/5 + h² + 3hr/4).

    Args:
        mass: (...), kg.
        radius: (...), m.
        half_length: (...), m: h, of the cylinder alone, as MuJoCo counts it.

    Returns:
        (..., 3, 3), kg m², diagonal, to within 8 ulp.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a negative size.
    """
    m, (r, h) = _read_sizes(mass, ("radius", radius), ("half_length", half_length))
    # Volumes over 2 π r². A capsule without any extent has no moments, whatever the shares.
    caps = r * (2.0 / 3.0)
    extent = h + caps
    extent = extent + (extent == 0)
    ends, middle = m * (caps / extent), m * (h / extent)
    transverse, axial = _cylinder(middle, r, h)
    end_axial = 0.4 * ends * r * r
    transverse = transverse + (end_axial + ends * h * h + 0.75 * ends * h * r)
    return _diagonal(transverse, transverse, axial + end_axial)


def _three_axes(mass: ArrayLike, name: str, value: ArrayLike, share: float) -> FloatArray:
    """Moments m/share (b² + c²) and so on."""
    m, sizes = arrays(("mass", mass, ()), (name, value, (3,)))
    reject((sizes < 0).any(axis=-1), name, "has a negative entry")
    x, y, z = components((m / share)[..., None] * sizes * sizes)
    return _diagonal(y + z, x + z, x + y)


def _cylinder(m: FloatArray, r: FloatArray, h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Moments across and along the axis."""
    return 0.25 * m * r * r + m / 3.0 * h * h, 0.5 * m * r * r


def _read_sizes(
    mass: ArrayLike, *sizes: tuple[str, ArrayLike]
) -> tuple[FloatArray, tuple[FloatArray, ...]]:
    """The mass and the sizes, each of shape (...)."""
    m, *values = arrays(("mass", mass, ()), *((name, value, ()) for name, value in sizes))
    for (name, _), value in zip(sizes, values, strict=True):
        reject(value < 0, name, "is negative")
    return m, tuple(values)


def _diagonal(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    entries = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
    return np.where(np.eye(3, dtype=bool), entries[..., None, :], 0.0)
