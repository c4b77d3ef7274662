"""Spatial (6-D) vectors: change of frame and cross products.

Entry points: `motion_transform` and `force_transform`, `cross_motion` and `cross_force`,
`pose_compose` and `pose_inverse`.

Convention: rotation first, as in MuJoCo's documentation and in Featherstone, "Rigid Body Dynamics
Algorithms" (2008). A motion vector is (angular velocity, rad/s; linear velocity of the frame's
origin, m/s); a force vector is (torque about the frame's origin, N m; force, N). Their inner
product is power, in W, and is the same in every frame.

The pose (R, p) of a frame B in a frame A has B's axes in A as columns of R and B's origin in A as
p, in metres, as `data.xmat` and `data.xpos` are the pose of a body in the world: a point with
components x in B has R x + p in A.
"""

import numpy as np
from numpy.typing import ArrayLike

from mjcourse.spatial._arrays import FloatArray, arrays, cross
from mjcourse.spatial.rotations import skew


def pose_compose(
    rot1: ArrayLike, pos1: ArrayLike, rot2: ArrayLike, pos2: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """The pose of C in A, from the pose of B in A and that of C in B.

    MuJoCo's `mju_mulPose`, with matrices in place of quaternions.

    Args:
        rot1: (..., 3, 3), of B in A.
        pos1: (..., 3), m, of B in A.
        rot2: (..., 3, 3), of C in B.
        pos2: (..., 3), m, of C in B.

    Returns:
        (..., 3, 3) and (..., 3).

    Raises:
        ValueError: a bad shape, or leading shapes that do not broadcast.
    """
    rot1, pos1, rot2, pos2 = arrays(
        *(("rot1", rot1, (3, 3)), ("pos1", pos1, (3,))),
        *(("rot2", rot2, (3, 3)), ("pos2", pos2, (3,))),
    )
    return _spread(rot1 @ rot2, (rot1 @ pos2[..., None])[..., 0] + pos1)


def pose_inverse(rot: ArrayLike, pos: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """The pose of A in B, from the pose of B in A: (Rᵀ, −Rᵀ p).

    MuJoCo's `mju_negPose`, with a matrix in place of a quaternion.

    Args:
        rot: (..., 3, 3), a rotation.
        pos: (..., 3), m.

    Returns:
        (..., 3, 3) and (..., 3).

    Raises:
        ValueError: a bad shape, or leading shapes that do not broadcast.
    """
    rot, pos = arrays(("rot", rot, (3, 3)), ("pos", pos, (3,)))
    back = np.swapaxes(rot, -1, -2)
    return _spread(back, 0.0 - (back @ pos[..., None])[..., 0])


def motion_transform(rot: ArrayLike, pos: ArrayLike) -> FloatArray:
    """The matrix that takes motion vectors from B to A: [[R, 0], [[p]× R, R]].

    The adjoint of the pose; Featherstone's ᴬX_B with E = R and r = −Rᵀ p (2008, section 2.8). The
    inverse is the transform of `pose_inverse`, and the transpose of `force_transform`.

    Args:
        rot: (..., 3, 3), a rotation: of B in A.
        pos: (..., 3), m, of B's origin in A.

    Returns:
        (..., 6, 6).

    Raises:
        ValueError: a bad shape, or leading shapes that do not broadcast.
    """
    rotation, coupling, zero = _blocks(rot, pos)
    return np.block([[rotation, zero], [coupling, rotation]])


def force_transform(rot: ArrayLike, pos: ArrayLike) -> FloatArray:
    """The matrix that takes force vectors from B to A: [[R, [p]× R], [0, R]].

    The dual of `motion_transform`, its transposed inverse.

    Args:
        rot: (..., 3, 3), a rotation: of B in A.
        pos: (..., 3), m, of B's origin in A.

    Returns:
        (..., 6, 6).

    Raises:
        ValueError: a bad shape, or leading shapes that do not broadcast.
    """
    rotation, coupling, zero = _blocks(rot, pos)
    return np.block([[rotation, coupling], [zero, rotation]])


def cross_motion(velocity: ArrayLike, motion: ArrayLike) -> FloatArray:
    """The spatial cross product v × m: the rate of change of a motion vector that moves with v.

    Source: Featherstone 2008, section 2.9.

    Args:
        velocity: (..., 6), motion vector, rotation first.
        motion: (..., 6), motion vector, rotation first.

    Returns:
        (..., 6).

    Raises:
        ValueError: a bad shape, or leading shapes that do not broadcast.
    """
    v, m = arrays(("velocity", velocity, (6,)), ("motion", motion, (6,)))
    turn, move = v[..., :3], v[..., 3:]
    return np.concatenate(
        (cross(turn, m[..., :3]), cross(turn, m[..., 3:]) + cross(move, m[..., :3])), axis=-1
    )


def cross_force(velocity: ArrayLike, force: ArrayLike) -> FloatArray:
    """The dual cross product v ×* f: the rate of change of a force vector that moves with v.

    Source: Featherstone 2008, section 2.9.

    Args:
        velocity: (..., 6), motion vector, rotation first.
        force: (..., 6), force vector, torque first.

    Returns:
        (..., 6), so that (v × m) · f = −m · (v ×* f).

    Raises:
        ValueError: a bad shape, or leading shapes that do not broadcast.
    """
    v, f = arrays(("velocity", velocity, (6,)), ("force", force, (6,)))
    turn, move = v[..., :3], v[..., 3:]
    return np.concatenate(
        (cross(turn, f[..., :3]) + cross(move, f[..., 3:]), cross(turn, f[..., 3:])), axis=-1
    )


def _blocks(rot: ArrayLike, pos: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """R, [p]× R and a zero matrix, in their common shape."""
    rot, pos = arrays(("rot", rot, (3, 3)), ("pos", pos, (3,)))
    coupling = skew(pos) @ rot
    return np.broadcast_to(rot, coupling.shape), coupling, np.zeros_like(coupling)


def _spread(rot: FloatArray, pos: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A pose as fresh arrays with the same leading axes."""
    lead = np.broadcast_shapes(rot.shape[:-2], pos.shape[:-1])
    return np.array(np.broadcast_to(rot, (*lead, 3, 3))), np.array(np.broadcast_to(pos, (*lead, 3)))
