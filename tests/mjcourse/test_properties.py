import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from mjcourse import spatial

ENTRY = st.floats(-1e3, 1e3, allow_subnormal=False).map(lambda x: x if abs(x) > 1e-150 else 0.0)
VECTOR = npst.arrays(float, 3, elements=ENTRY)
SIX = npst.arrays(float, 6, elements=ENTRY)
QUAT = npst.arrays(float, 4, elements=ENTRY).filter(np.any)
MASS = st.floats(1e-3, 1e3)
MOMENTS = st.tuples(*[st.floats(1e-3, 1e3)] * 3).map(
    lambda parts: np.array([parts[1] + parts[2], parts[0] + parts[2], parts[0] + parts[1]])
)
TENSOR = st.builds(spatial.inertia_from_principal, MOMENTS, QUAT)

QUICK = settings(deadline=None, max_examples=60)


def size(*arrays: np.ndarray) -> float:
    return float(np.prod([np.linalg.norm(array) for array in arrays]))


def assert_near(actual: np.ndarray, expected: np.ndarray, scale: float, ulps: float = 16) -> None:
    np.testing.assert_allclose(actual, expected, rtol=0, atol=ulps * 2.0**-52 * scale + 1e-300)


@QUICK
@given(MASS, VECTOR, TENSOR, QUAT, VECTOR, SIX)
def test_inertia_stays_symmetric_positive_definite(
    mass: float,
    com: np.ndarray,
    tensor: np.ndarray,
    quat: np.ndarray,
    pos: np.ndarray,
    velocity: np.ndarray,
) -> None:
    rot = spatial.quat_to_mat(quat)
    inertia = spatial.spatial_inertia(mass, com, tensor)
    transformed = spatial.transform_spatial_inertia(inertia, rot, pos)
    for matrix in (inertia, transformed):
        assert (matrix == matrix.T).all()
    scale = np.abs(inertia).max() * (1 + size(pos)) ** 2
    assert np.linalg.eigvalsh(transformed).min() > -16 * 2.0**-52 * scale
    motion = spatial.motion_transform(rot, pos) @ velocity
    assert_near(
        motion @ transformed @ motion,
        velocity @ inertia @ velocity,
        scale * size(velocity) ** 2 * (1 + size(pos)) ** 2,
    )


@QUICK
@given(TENSOR, QUAT)
def test_principal_moments_do_not_depend_on_the_frame(tensor: np.ndarray, quat: np.ndarray) -> None:
    moments, axes = spatial.principal_axes(tensor)
    rotated_moments, _ = spatial.principal_axes(
        spatial.rotate_inertia(tensor, spatial.quat_to_mat(quat))
    )
    assert_near(rotated_moments, moments, moments[2])
    assert_near(axes * moments @ axes.T, tensor, moments[2])
    assert_near(
        spatial.inertia_from_principal(moments, spatial.mat_to_quat(axes)), tensor, moments[2], 32
    )


LEADING_SHAPES = npst.mutually_broadcastable_shapes(num_shapes=2, max_dims=2, max_side=3)


@QUICK
@given(LEADING_SHAPES, st.integers(0, 2**32 - 1))
def test_broadcasting_equals_a_loop(shapes: npst.BroadcastableShapes, seed: int) -> None:
    rng = np.random.default_rng(seed)
    quat_lead, vector_lead = shapes.input_shapes
    quat, second_quat = rng.normal(size=(*quat_lead, 4)), rng.normal(size=(*vector_lead, 4))
    vector, scalar = rng.normal(size=(*vector_lead, 3)) * 4, rng.uniform(0.1, 2, size=vector_lead)
    rot, pos = spatial.quat_to_mat(quat), rng.normal(size=(*vector_lead, 3))
    six, tensor = rng.normal(size=(*vector_lead, 6)), spatial.box_inertia(scalar, np.abs(vector))
    cases = (
        (spatial.quat_mul, (quat, second_quat), (1, 1)),
        (spatial.quat_rotate, (quat, vector), (1, 1)),
        (spatial.quat_sub, (quat, second_quat), (1, 1)),
        (spatial.angular_distance, (quat, second_quat), (1, 1)),
        (spatial.quat_slerp, (quat, quat[..., ::-1], scalar), (1, 1, 0)),
        (spatial.quat_integrate, (quat, vector, scalar), (1, 1, 0)),
        (spatial.axis_angle_to_quat, (quat[..., 1:], scalar), (1, 0)),
        (spatial.rotvec_to_quat, (vector,), (1,)),
        (spatial.quat_to_rotvec, (quat,), (1,)),
        (spatial.mat_to_quat, (rot,), (2,)),
        (spatial.quat_to_euler, (quat,), (1,)),
        (spatial.motion_transform, (rot, pos), (2, 1)),
        (spatial.force_transform, (rot, pos), (2, 1)),
        (spatial.cross_motion, (six, six[..., ::-1]), (1, 1)),
        (spatial.cross_force, (six, six[..., ::-1]), (1, 1)),
        (spatial.rotate_inertia, (tensor, rot), (2, 2)),
        (spatial.inertia_from_principal, (vector, quat), (1, 1)),
        (spatial.parallel_axis, (tensor, scalar, pos), (2, 0, 1)),
        (spatial.spatial_inertia, (scalar, pos, tensor), (0, 1, 2)),
        (spatial.is_physical_inertia, (tensor,), (2,)),
        (spatial.capsule_inertia, (scalar, scalar, scalar), (0, 0, 0)),
    )
    for call, arguments, cores in cases:
        actual = call(*arguments)
        lead = np.broadcast_shapes(
            *(a.shape[: a.ndim - core] for a, core in zip(arguments, cores, strict=True))
        )
        spread = [
            np.broadcast_to(a, (*lead, *a.shape[a.ndim - core :]))
            for a, core in zip(arguments, cores, strict=True)
        ]
        assert np.shape(actual)[: len(lead)] == lead
        for index in np.ndindex(lead):
            expected = call(*(a[index] for a in spread))
            np.testing.assert_allclose(
                actual[index], expected, rtol=0, atol=1e-15 * (1 + np.abs(expected).max())
            )
