"""Which geoms may touch, against what MuJoCo looks at; shapes beside a mesh."""

from __future__ import annotations

import itertools
import math

import mujoco
import numpy as np
import pytest

from mjbench.pruning.geom_pairs import hull_distance, possible_pairs


def compile_model(body: str, *, option: str = "", rest: str = "", root: str = "") -> mujoco.MjModel:
    text = f"<mujoco>{root}<option>{option}</option><worldbody>{body}</worldbody>{rest}</mujoco>"
    return mujoco.MjModel.from_xml_string(text)


def test_possible_pairs_are_those_that_mujoco_looks_at() -> None:
    """With a huge margin everything that MuJoCo looks at is a contact."""
    for seed in range(6):
        for flag in ("", '<flag filterparent="disable"/>'):
            model = everything_touching(seed, flag)
            data = mujoco.MjData(model)
            mujoco.mj_forward(model, data)
            pairs = {tuple(sorted(pair)) for pair in data.contact.geom[: data.ncon].tolist()}
            assert pairs == possible_pairs(model), (seed, flag)


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
