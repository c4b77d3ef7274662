"""Bounds on where geoms can get, against MuJoCo itself in random states."""

from __future__ import annotations

import itertools
import math

import mujoco
import numpy as np
import pytest

from mjbench.pruning.reachability import find_separate, hull_distance, possible_pairs


def compile_model(body: str, *, option: str = "", rest: str = "", root: str = "") -> mujoco.MjModel:
    text = f"<mujoco>{root}<option>{option}</option><worldbody>{body}</worldbody>{rest}</mujoco>"
    return mujoco.MjModel.from_xml_string(text)


def tree(random: np.random.Generator, depth: int) -> str:
    """A random chain with branches; joints of every kind but free ones, off-centre."""

    def vector(scale: float) -> str:
        return " ".join(f"{x:.4f}" for x in random.normal(0, scale, 3))

    joints = ""
    for _ in range(int(random.integers(0, 3))):
        kind = random.choice(["hinge", "hinge", "ball", "slide"], p=[0.4, 0.4, 0.15, 0.05])
        joints += f'<joint type="{kind}" axis="{vector(1)}" pos="{vector(0.2)}"/>'
    joints = joints if joints.count("ball") == 0 or joints.count("<joint") == 1 else ""
    shape = random.choice(["box", "capsule", "sphere", "ellipsoid", "cylinder"])
    size = " ".join(f"{x:.3f}" for x in random.uniform(0.02, 0.2, 3))
    geom = f'<geom type="{shape}" size="{size}" pos="{vector(0.3)}" euler="{vector(50)}"/>'
    inner = ""
    if depth:
        inner = "".join(tree(random, depth - 1) for _ in range(int(random.integers(1, 3))))
    place = f'pos="{vector(0.5)}" euler="{vector(50)}"'
    return f"<body {place}>{joints}{geom}{inner}</body>"


def random_state(random: np.random.Generator, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Any angles, and slides far along."""
    for joint in range(model.njnt):
        at = model.jnt_qposadr[joint]
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE:
            data.qpos[at] = random.uniform(-3, 3)
        elif model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_BALL:
            turn = random.normal(size=4)
            data.qpos[at : at + 4] = turn / np.linalg.norm(turn)
        else:
            data.qpos[at] = random.uniform(-np.pi, np.pi)


@pytest.mark.long
def test_what_is_said_to_be_separate_never_touches() -> None:
    mismatches = []
    for seed in range(10):
        random = np.random.default_rng(seed)
        fixed = "".join(
            f'<geom size="0.1" pos="{x:.3f} {y:.3f} {z:.3f}"/>'
            for x, y, z in random.normal(0, 1.5, (4, 3))
        )
        plane = '<geom type="plane" size="1 1 1" pos="0 0 -4" euler="10 5 0"/>'
        model = compile_model(fixed + plane + tree(random, 2) + tree(random, 3))
        pairs = possible_pairs(model)
        apart = find_separate(model, pairs)
        assert apart < pairs or not pairs, seed
        flat = set(np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE).tolist())
        data = mujoco.MjData(model)
        for _ in range(40):
            random_state(random, model, data)
            mujoco.mj_forward(model, data)
            mismatches += [(seed, "touch", *pair) for pair in contact_pairs(data) & apart]
            for a, b in apart:
                if not {a, b} & flat and mujoco.mj_geomDistance(model, data, a, b, 10.0, None) <= 0:
                    mismatches.append((seed, "lie in each other", a, b))
    assert mismatches == []


def test_only_bounded_joints_keep_a_body_away() -> None:
    for joint, bounded in (
        ('<joint type="hinge" axis="0 1 0"/>', True),
        ('<joint type="ball"/>', True),
        ('<joint type="slide" axis="1 0 0" range="-1 1" limited="true"/>', False),
        ('<joint type="slide" axis="1 0 0"/>', False),
        ("<freejoint/>", False),
    ):
        model = compile_model(f'<geom size=".1" pos="6 0 0"/><body>{joint}<geom size=".1"/></body>')
        assert bool(find_separate(model, possible_pairs(model))) is bounded, joint
    mocap = '<body mocap="true" pos="50 0 0"><geom size=".1"/></body>'
    model = compile_model(f'{mocap}<body><joint/><geom size=".1" pos=".2 0 0"/></body>')
    assert len(possible_pairs(model)) == 1 and not find_separate(model, possible_pairs(model))


def test_margins_count() -> None:
    body = '<geom size=".1" pos="2 0 0" margin="{}"/><body><joint/><geom size=".1"/></body>'
    near_model, far_model = (compile_model(body.format(margin)) for margin in ("0", "1.9"))
    assert find_separate(near_model, possible_pairs(near_model))
    assert not find_separate(far_model, possible_pairs(far_model))
    for gap in ('gap="1.9" adhesion="1"', 'margin="1" gap="0.9"'):  # it pulls across its gap
        gap_model = compile_model(body.replace('margin="{}"', gap))
        assert not find_separate(gap_model, possible_pairs(gap_model)), gap
    near_model.opt.o_margin = 1.9  # in place of all margins, once a flag is set
    assert not find_separate(near_model, possible_pairs(near_model))
    pair = '<contact><pair geom1="a" geom2="b" margin="1.9"/></contact>'
    mjcf = """<geom name="a" size=".1" pos="2 0 0"/>
        <body><joint/><geom name="b" size=".1"/></body>"""
    paired_model = compile_model(mjcf, rest=pair)
    assert not find_separate(paired_model, possible_pairs(paired_model))


def test_possible_pairs_are_those_that_mujoco_looks_at() -> None:
    """With a huge margin everything that MuJoCo looks at is a contact."""
    for seed in range(6):
        for flag in ("", '<flag filterparent="disable"/>'):
            model = everything_touching(seed, flag)
            data = mujoco.MjData(model)
            mujoco.mj_forward(model, data)
            assert contact_pairs(data) == possible_pairs(model), (seed, flag)


def contact_pairs(data: mujoco.MjData) -> set[tuple[int, ...]]:
    return {tuple(sorted(pair)) for pair in data.contact.geom[: data.ncon].tolist()}


def everything_touching(seed: int, flag: str) -> mujoco.MjModel:
    random = np.random.default_rng(seed)
    count = 0

    def body(depth: int) -> str:
        nonlocal count
        count += 1
        number = count
        joint = random.choice(["", '<joint axis="0 1 0"/>', "<joint type='ball'/>"])
        mask = f'contype="{random.integers(0, 4)}" conaffinity="{random.integers(0, 4)}"'
        geoms = f'<geom name="g{number}" size=".1" {mask} margin="1000"/>'
        inner = "".join(body(depth - 1) for _ in range(2)) if depth else ""
        return f'<body name="b{number}" pos=".3 0 0">{joint}{geoms}{inner}</body>'

    trees = body(2) + body(1) + '<geom size=".1" margin="1000"/>'
    trees += '<body mocap="true"><geom size=".1" margin="1000"/></body>'
    trees += '<body><geom size=".1" margin="1000"/></body>'
    contact = """<contact><exclude body1="b1" body2="b5"/>
        <pair geom1="g2" geom2="g3" margin="1000"/></contact>"""
    size = '<size memory="50M"/>'
    return compile_model(trees, option=flag, rest=contact, root=size)


@pytest.mark.parametrize("bevel", [0.0, 0.1], ids=["cube", "without its corners"])
def test_a_shape_is_as_far_from_a_mesh_as_its_surface_at_the_worst_place(bevel: float) -> None:
    """A corner that is cut off leaves all corners of the mesh on the faces of a box."""
    corners = np.array([*itertools.product((-1.0, 1.0), repeat=3)])
    vertices = [c * [1 - bevel * (k == n) for k in range(3)] for c in corners for n in range(3)]
    text = " ".join(f"{x:g}" for x in np.unique(vertices, axis=0).ravel())

    def model_of(shape: str) -> mujoco.MjModel:
        asset = f'<asset><mesh name="m" vertex="{text}"/></asset>'
        body = f'<body euler="10 20 30" pos="1 2 3"><geom type="{shape}" mesh="m"/></body>'
        return compile_model(body, rest=asset)

    mesh, box, sphere = map(model_of, ("mesh", "box", "sphere"))
    half, radius = float(box.geom_size[0, 0]), float(sphere.geom_size[0, 0])
    off = {box: (3 * half - (3 - bevel)) / math.sqrt(3), sphere: radius - 1}
    off[sphere] = max(off[sphere], math.sqrt(2 + (1 - bevel) ** 2) - radius)
    off[box] = max(abs(off[box]), abs(half - 1))
    for shape, distance in off.items():
        assert hull_distance(mesh, shape, 0) == pytest.approx(distance, rel=0.01, abs=1e-6)
