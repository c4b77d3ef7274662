"""Rotations, spatial vectors and inertias in MuJoCo's conventions, accurate to a few ulp.

Entry points: every name below. By topic: `quaternions` (order w, x, y, z), `rotvecs`, `rotations`
(matrices), `euler`, `transforms` (6-D, rotation first), `inertia`, `principal`, `solids`.

Conventions of all routines:

- Shapes are written `(..., n)`. Leading axes are free and broadcast; a bad shape is a ValueError
  that says what was expected and what came. Anything that NumPy reads as real numbers is taken, and
  doubles are returned, never a view of an argument.
- Units are SI and radians.
- An ulp of 1 is 2^-52. "To within n ulp" of a quantity is n · 2^-52 of its size; the errors are
  measured against arithmetic of fifty digits by the tests. NumPy's own sine, cosine and arctangent
  are within an ulp or so of right, and that is counted.
- Lengths are computed without overflow or underflow, so that every non-zero quaternion and axis
  counts, denormal or huge.
- NaN in an entry gives NaN for that entry, without a warning, and leaves the other entries of a
  batch alone.
"""

from mjcourse.spatial.euler import euler_to_quat, quat_to_euler
from mjcourse.spatial.inertia import (
    compose_inertia,
    inertia_from_principal,
    parallel_axis,
    rotate_inertia,
    spatial_inertia,
    split_spatial_inertia,
    transform_spatial_inertia,
)
from mjcourse.spatial.principal import is_physical_inertia, principal_axes
from mjcourse.spatial.quaternions import (
    axis_angle_to_quat,
    quat_conj,
    quat_mul,
    quat_normalize,
    quat_rotate,
)
from mjcourse.spatial.rotations import (
    exp_so3,
    log_so3,
    mat_to_quat,
    quat_to_mat,
    skew,
    unskew,
)
from mjcourse.spatial.rotvecs import (
    angular_distance,
    quat_integrate,
    quat_slerp,
    quat_sub,
    quat_to_rotvec,
    rotvec_to_quat,
)
from mjcourse.spatial.solids import (
    box_inertia,
    capsule_inertia,
    cylinder_inertia,
    ellipsoid_inertia,
    sphere_inertia,
)
from mjcourse.spatial.transforms import (
    cross_force,
    cross_motion,
    force_transform,
    motion_transform,
    pose_compose,
    pose_inverse,
)

__all__ = [
    "angular_distance",
    "axis_angle_to_quat",
    "box_inertia",
    "capsule_inertia",
    "compose_inertia",
    "cross_force",
    "cross_motion",
    "cylinder_inertia",
    "ellipsoid_inertia",
    "euler_to_quat",
    "exp_so3",
    "force_transform",
    "inertia_from_principal",
    "is_physical_inertia",
    "log_so3",
    "mat_to_quat",
    "motion_transform",
    "parallel_axis",
    "pose_compose",
    "pose_inverse",
    "principal_axes",
    "quat_conj",
    "quat_integrate",
    "quat_mul",
    "quat_normalize",
    "quat_rotate",
    "quat_slerp",
    "quat_sub",
    "quat_to_euler",
    "quat_to_mat",
    "quat_to_rotvec",
    "rotate_inertia",
    "rotvec_to_quat",
    "skew",
    "spatial_inertia",
    "sphere_inertia",
    "split_spatial_inertia",
    "transform_spatial_inertia",
    "unskew",
]
