"""The same numbers as MuJoCo's own routines and compiler, where these are defined."""

import itertools

import mujoco
import numpy as np
import pytest

from mjcourse import spatial

COUNT = 50


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(59)


def unit_quats(rng: np.random.Generator, count: int = COUNT) -> np.ndarray:
    return spatial.quat_normalize(rng.normal(size=(count, 4)))


def close(actual: np.ndarray, expected: np.ndarray, size: float = 1.0) -> None:
    """Equal to 8 ulp of a size."""
    np.testing.assert_allclose(actual, expected, rtol=0, atol=8 * 2.0**-52 * size)


def same_rotation(actual: np.ndarray, expected: np.ndarray) -> None:
    close(actual * np.sign(actual @ expected), expected)


def test_euler_sequences(rng: np.random.Generator) -> None:
    quat = np.zeros(4)
    for letters in itertools.product("xyz", repeat=3):
        if letters[0] == letters[1] or letters[1] == letters[2]:
            continue
        for seq in ("".join(letters), "".join(letters).upper()):
            for angles in rng.uniform(-4, 4, size=(5, 3)):
                mujoco.mju_euler2Quat(quat, angles, seq)
                close(spatial.euler_to_quat(angles, seq), quat)


def test_poses(rng: np.random.Generator) -> None:
    pos, quat = np.zeros(3), np.zeros(4)
    for q1, q2, p1, p2 in zip(
        unit_quats(rng), unit_quats(rng), *rng.normal(size=(2, COUNT, 3)), strict=True
    ):
        mujoco.mju_mulPose(pos, quat, p1, q1, p2, q2)
        rot, shift = spatial.pose_compose(spatial.quat_to_mat(q1), p1, spatial.quat_to_mat(q2), p2)
        close(shift, pos, 8)
        same_rotation(spatial.mat_to_quat(rot), quat)
        mujoco.mju_negPose(pos, quat, p1, q1)
        rot, shift = spatial.pose_inverse(spatial.quat_to_mat(q1), p1)
        close(shift, pos, 8)
        same_rotation(spatial.mat_to_quat(rot), quat)


def test_velocities_of_two_frames_of_one_body(rng: np.random.Generator) -> None:
    xml = """<mujoco><worldbody><body pos="1 2 3" euler="10 20 30"><freejoint/>
      <geom size="0.1"/><site name="a" pos="0.3 -0.1 0.2" euler="40 -50 60"/>
      <site name="b" pos="-0.4 0.2 0.5" euler="-70 10 20"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    data.qvel[:] = rng.normal(size=6)
    mujoco.mj_forward(model, data)
    velocities = np.zeros((2, 6))
    for site in range(2):
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, site, velocities[site], 1)
    poses = [(data.site_xmat[k].reshape(3, 3), data.site_xpos[k]) for k in range(2)]
    a_in_b = spatial.pose_compose(*spatial.pose_inverse(*poses[1]), *poses[0])
    np.testing.assert_allclose(
        spatial.motion_transform(*a_in_b) @ velocities[0], velocities[1], rtol=0, atol=1e-13
    )


GEOMS = {
    "box": ((0.3, 0.2, 0.1), lambda m, s: spatial.box_inertia(m, s)),
    "sphere": ((0.3,), lambda m, s: spatial.sphere_inertia(m, s[0])),
    "cylinder": ((0.3, 0.2), lambda m, s: spatial.cylinder_inertia(m, s[0], s[1])),
    "capsule": ((0.2, 0.3), lambda m, s: spatial.capsule_inertia(m, s[0], s[1])),
    "ellipsoid": ((0.3, 0.2, 0.1), lambda m, s: spatial.ellipsoid_inertia(m, s)),
}


def numbers(values: np.ndarray) -> str:
    return " ".join(map(repr, map(float, values)))


def compile_geoms(*geoms: str) -> mujoco.MjModel:
    body = f"<body><freejoint/>{''.join(geoms)}</body>"
    return mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")


def geom(kind: str, mass: float, size: np.ndarray, pos: np.ndarray, quat: np.ndarray) -> str:
    return (
        f'<geom type="{kind}" mass="{mass!r}" size="{numbers(size)}" pos="{numbers(pos)}" '
        f'quat="{numbers(quat)}"/>'
    )


def test_inertia_of_a_composed_body(rng: np.random.Generator) -> None:
    for _ in range(20):
        kinds = rng.choice(list(GEOMS), size=4)
        masses, centres, quats = (
            rng.uniform(0.1, 3, size=4),
            rng.normal(size=(4, 3)),
            unit_quats(rng, 4),
        )
        model = compile_geoms(
            *(
                geom(kind, float(mass), np.array(GEOMS[kind][0]), centre, quat)
                for kind, mass, centre, quat in zip(kinds, masses, centres, quats, strict=True)
            )
        )
        tensors = [
            spatial.rotate_inertia(GEOMS[kind][1](mass, GEOMS[kind][0]), spatial.quat_to_mat(quat))
            for kind, mass, quat in zip(kinds, masses, quats, strict=True)
        ]
        mass, com, inertia = spatial.compose_inertia(masses, centres, tensors)
        close(mass, model.body_mass[1], 12)
        close(com, model.body_ipos[1], 4)
        theirs = spatial.inertia_from_principal(model.body_inertia[1], model.body_iquat[1])
        np.testing.assert_allclose(inertia, theirs, rtol=0, atol=1e-9)
        moments, _ = spatial.principal_axes(inertia)
        np.testing.assert_allclose(moments, np.sort(model.body_inertia[1]), rtol=1e-12)
        assert spatial.is_physical_inertia(inertia)
