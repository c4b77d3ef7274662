import itertools

import mpmath
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from mjcourse import spatial
from support import high_precision as hp

LARGEST = float(np.finfo(float).max)
QUATS = (
    (1.0, 0.0, 0.0, 0.0),
    (0.0, 0.0, 1.0, 0.0),
    (0.5, -0.5, 0.5, -0.5),
    (0.3, -0.7, 0.2, 0.1),
    (-0.9, 0.1, 0.2, -0.4),
    (1.0, 1e-9, -2e-9, 3e-10),
    (1e-9, 1.0, 1e-17, -1e-3),
    (1.0, 1e-160, 0.0, 1e-300),
    (1e-200, -1.0, 0.3, 0.9),
)


def test_normalize_to_two_ulp_at_any_length() -> None:
    ends = (
        (5e-324, 0, 0, 0),
        (5e-324, -5e-324, 5e-324, 5e-324),
        (1e-323, 5e-324, 0, -1.5e-323),
        (LARGEST, LARGEST, LARGEST, LARGEST),
        (LARGEST, 5e-324, 0, 1),
        (1e-308, 1e-320, -1e-310, 0),
    )
    errors = {}
    for quat, size in (*itertools.product(QUATS, hp.SIZES), *((end, 1.0) for end in ends)):
        scaled = np.array(quat) * size
        expected = hp.unit(hp.exact(scaled))
        errors[quat, size] = hp.entry_ulps(spatial.quat_normalize(scaled), expected)
    assert hp.errors_over(2, errors) == []


def test_mul_to_two_ulp_of_the_lengths() -> None:
    errors = {}
    for a, b in itertools.product(QUATS, QUATS):
        p, q = hp.exact(a), hp.exact(b)
        size = hp.length(p) * hp.length(q)
        errors[a, b] = hp.ulps_of(size, spatial.quat_mul(a, b), hp.mul(p, q))
    assert hp.errors_over(2, errors) == []


def test_conj_turns_the_vector_part_and_makes_no_negative_zero() -> None:
    assert spatial.quat_conj([1, 2, -3, 4]).tolist() == [1, -2, 3, -4]
    assert not np.signbit(spatial.quat_conj([1, 0, 0, 0])).any()


def test_rotate_to_six_ulp_at_any_length() -> None:
    vectors = ((1.0, 2.0, 3.0), (-1e-200, 1e-201, 0.0), (1e306, -1e306, 3e305), (0.0, 0.0, 7.0))
    errors = {}
    for quat, size, vector in itertools.product(QUATS, hp.SIZES, vectors):
        scaled = np.array(quat) * size
        expected = hp.rotate(hp.exact(scaled), hp.exact(vector))
        actual = spatial.quat_rotate(scaled, vector)
        errors[quat, size, vector] = hp.ulps_of(hp.length(hp.exact(vector)), actual, expected)
    assert hp.errors_over(6, errors) == []


def test_axis_angle_to_four_ulp() -> None:
    angles = (
        *hp.SMALL_ANGLES,
        *hp.THRESHOLDS,
        *hp.PLAIN_ANGLES,
        *hp.NEAR_PI,
        *(-1e-300, -2.0, 3 * hp.PI, 1e6, 0.0),
    )
    sines, cosines = {}, {}
    for axis, angle in itertools.product(hp.AXES, angles):
        direction, turn = hp.unit(hp.exact(axis)), mpmath.mpf(angle)
        expected = hp.exp([turn * entry for entry in direction])
        actual = spatial.axis_angle_to_quat(axis, angle)
        sines[axis, angle] = hp.entry_ulps(actual[1:], expected[1:])
        cosines[axis, angle] = hp.ulps_of(mpmath.mpf(1), actual[:1], expected[:1])
    assert hp.errors_over(4, sines) == []
    assert hp.errors_over(1, cosines) == []


def test_a_bad_quaternion_is_nan_and_the_others_are_not() -> None:
    for bad in (np.nan, np.inf, -np.inf):
        quats = np.array([[0.6, 0.8, 0, 0], [bad, 1, 0, 0], [0, 0, 1e300, 0]])
        for actual in (
            spatial.quat_normalize(quats),
            spatial.quat_rotate(quats, [1, 2, 3]),
            spatial.quat_to_mat(quats),
            spatial.quat_to_rotvec(quats),
            spatial.quat_sub(quats, [1, 0, 0, 0]),
            spatial.quat_slerp(quats, [1, 0, 0, 0], 0.5),
            spatial.quat_integrate(quats, [1, 2, 3], 0.1),
            spatial.angular_distance(quats, [1, 0, 0, 0]),
        ):
            assert np.isnan(actual[1]).all()
            assert np.isfinite(actual[[0, 2]]).all()


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
