"""The static form of a lab: everything that MuJoCo draws, as the real trial records it."""

from __future__ import annotations

import json
import math
from collections import Counter
from typing import Any

import numpy as np
import pytest

from coursebuild.features.lab.picture.draw import Solid
from coursebuild.features.lab.picture.scenery import scene_solids
from coursebuild.features.lab.picture.static import draw_picture, lab_record
from coursebuild.features.lab.reply import unpack_arrays
from support.fixture_cases import fixture_text
from support.lab_values import Bench, make_lab
from support.model_files import read_png

pytestmark = pytest.mark.engine

FULL_MODEL = fixture_text("documents/full_model.xml")


def main_of(bench: Bench, **fields: Any) -> tuple[Any, dict[str, Any]]:
    lab = make_lab(**{"verify": {"seconds": 0.1}, **fields})
    reply = bench.trial(lab)
    # Scenes that only show shapes have them in each other.
    assert [failure for failure in reply["failures"] if failure["kind"] != "deep"] == []
    return lab, json.loads(json.dumps(reply["main"]))


def solids(main: dict[str, Any]) -> list[Solid]:
    return list(
        scene_solids(unpack_arrays(main["scene"]), unpack_arrays(main["pictures"][0]["frame"]))
    )


@pytest.fixture(scope="module")
def rich_scene(bench: Bench) -> tuple[Any, dict[str, Any]]:
    return main_of(bench, xml=FULL_MODEL, overlays=["frames", "com"], toggles=["frames"])


def test_all_geoms_have_their_shape_and_place(rich_scene: tuple[Any, dict[str, Any]]) -> None:
    drawn_solids = solids(rich_scene[1])
    scene = rich_scene[1]["scene"]
    visible = [g for g in scene["geoms"] if g["group"] <= 2]
    assert Counter(g["type"] for g in visible) == Counter([0, 1, 2, 3, 4, 5, 6, 7, 7, 2, 2])
    plane, hills, ball, capsule, ellipsoid, cylinder, box, first, second = drawn_solids[:9]
    assert plane.plane and plane.mirror == 0 and box.mirror == pytest.approx(0.3)
    assert plane.texture is not None and (plane.texture.repeat, plane.texture.uniform) == (
        (4, 4),
        True,
    )
    assert plane.texture.texture.levels[0].shape == (1, 8, 8, 3)
    assert np.ptp(plane.texture.texture.levels[0], axis=(0, 1, 2)).tolist() == [1, 1, 0]
    assert hills.position == pytest.approx((0, 6, 0))
    reach = [np.ptp(s.surface.vertices, axis=0) for s in (hills, ball, capsule, cylinder, box)]
    assert reach[0] == pytest.approx((4, 2, 0.6)), "with what is below 0"
    assert reach[1] == pytest.approx((0.2, 0.2, 0.2), rel=0.01)
    assert reach[2] == pytest.approx((0.2, 0.2, 0.8), rel=0.01)
    assert reach[3] == pytest.approx((0.2, 0.2, 0.6), rel=0.01)
    assert reach[4] == pytest.approx((0.2, 0.4, 0.6))
    assert ball.rgba == (1, 0, 0, 1) and ellipsoid.rgba == (0, 0, 1, 0.5)
    assert [ball.position[0], box.position[0]] == pytest.approx([0, 4], abs=1e-5)
    for mesh, size in ((first, 1.0), (second, 2.0)):
        corners = mesh.surface.vertices[mesh.surface.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        volume = np.einsum("ij,ij->", corners[:, 0], normals) / 6
        assert volume == pytest.approx(size**3 / 6, rel=1e-5), "outward, and the right mesh"
        world = mesh.surface.vertices @ mesh.rotation.T + mesh.position
        assert np.ptp(world, axis=0) == pytest.approx((size, size, size), abs=1e-5)


def test_what_the_visualizer_adds_is_there(rich_scene: tuple[Any, dict[str, Any]]) -> None:
    drawn_solids = solids(rich_scene[1])
    green = [s for s in drawn_solids if s.rgba[:3] == (0, 1, 0)]
    assert green, "the tendon"
    ends = [s.surface.vertices @ s.rotation.T + s.position for s in green]
    points = np.concatenate(ends)
    assert points.min(axis=0) == pytest.approx((0, 3, 2), abs=0.05)
    assert points.max(axis=0) == pytest.approx((1, 3, 2.2), abs=0.05)
    frames = [
        s
        for s in drawn_solids
        if s.rgba[:3] != (0, 1, 0) and s.position[1] == pytest.approx(3, abs=0.2)
    ]
    assert len(frames) > 4, "frames and centres of mass of the bodies a and b"
    hidden = [s for s in drawn_solids if s.position[0] == pytest.approx(9)]
    assert all(np.ptp(s.surface.vertices) < 1.5 for s in hidden), "marks of it, and not its box"


def test_broken_rows_of_a_frame_are_left_out(rich_scene: tuple[Any, dict[str, Any]]) -> None:
    scene = unpack_arrays(rich_scene[1]["scene"])
    frame = unpack_arrays(rich_scene[1]["pictures"][0]["frame"]).copy()
    whole = len(list(scene_solids(scene, frame)))
    start = scene["layout"]["geoms"]
    for i, value in ((2, math.nan), (3, math.inf), (4, -math.inf)):
        frame[start + 19 * i + i] = value
    assert len(list(scene_solids(scene, frame))) == whole - 3


def test_a_flex_and_a_skin_are_drawn(bench: Bench) -> None:
    xml = """<mujoco><worldbody>
      <flexcomp name="cloth" type="grid" count="4 4 1" spacing=".1 .1 .1" radius=".01" dim="2"
        pos="0 0 1" mass="1" rgba="0 0.5 1 1"><edge equality="true"/></flexcomp>
      </worldbody></mujoco>"""
    _, main = main_of(bench, xml=xml)
    cloth = [s for s in solids(main) if s.rgba[2] == 1.0 and len(s.surface.faces) >= 18]
    assert len(cloth) == 1
    assert np.ptp(cloth[0].surface.vertices, axis=0)[:2] == pytest.approx((0.3, 0.3), abs=1e-6)


def test_an_endless_plane_is_around_what_the_camera_looks_at(bench: Bench) -> None:
    xml = """<mujoco><worldbody><geom type="plane" size="0 0 1" pos="0 0 -1"/>
      <geom size="0.2"/></worldbody></mujoco>"""
    camera = {"azimuth": 90, "elevation": -20, "target": [50, 7, 0], "distance": 3}
    _, main = main_of(bench, xml=xml, camera=camera)
    floor = solids(main)[0]
    assert floor.surface.vertices.mean(axis=0) == pytest.approx((50, 7, 0))
    assert floor.position == pytest.approx((0, 0, -1)), "so that its squares stay where they are"


def test_the_floor_with_a_grid_replaces_a_grey_one(bench: Bench) -> None:
    ball = '<body pos="0 0 .3"><freejoint/><geom size=".1"/></body>'
    planes = {
        "": 0,
        'rgba=".8 .8 .8 1"': 0,
        'rgba=".8 .2 .2 1"': 1,
        'rgba=".5 .5 .5 .5"': 1,
        'euler="0 10 0"': 1,
        'pos="0 0 -1"': 1,
    }
    for extra, plane_count in planes.items():
        second = '<geom type="plane" size="1 1 .1"/>' if "pos" in extra else ""
        xml = f'<mujoco><worldbody><geom type="plane" size="1 1 .1" {extra}/>{second}{ball}'
        _, main = main_of(bench, xml=xml + "</worldbody></mujoco>")
        assert sum(solid.plane for solid in solids(main)) == plane_count, extra
    xml = f'<mujoco><worldbody><light/><geom type="plane" size="1 1 .1"/>{ball}'
    _, main = main_of(bench, xml=xml + "</worldbody></mujoco>")
    assert sum(solid.plane for solid in solids(main)) == 1, "the author has lit it"


def test_an_orthographic_camera(bench: Bench) -> None:
    xml = """<mujoco><visual><global orthographic="true" fovy="2"/></visual><worldbody>
      <body><geom type="box" size="0.5 0.5 0.5"/></body></worldbody></mujoco>"""
    lab, main = main_of(
        bench, xml=xml, camera={"azimuth": 90, "elevation": 0, "target": [0, 0, 0]}, height=480
    )
    pixels = read_png(draw_picture(lab, main))
    rows = np.nonzero(pixels[..., 3].any(axis=1))[0]
    # A box of 1 m in a view that is 2 m high.
    assert rows.max() - rows.min() + 1 == pytest.approx(pixels.shape[0] / 2, abs=2)


def test_readouts_and_plots_belong_to_the_run(bench: Bench) -> None:
    lab, main = main_of(
        bench,
        height=240,
        verify={"seconds": 0.5},
        readouts=[
            {"label": "t", "expr": "data.time", "digits": 2},
            {"label": "word", "expr": "data.time > 0.4 ? '<late>' : 'early'"},
        ],
        plots=[
            {"ylabel": "t", "traces": [{"label": "a", "expr": "data.time"}]},
            {"ylabel": "u", "traces": [{"label": "b", "expr": "0"}, {"label": "c", "expr": "1"}]},
        ],
    )
    form = lab_record(lab, main, ",")
    assert form.size == (640, 320)
    assert (form.time, form.end) == (0, pytest.approx(0.5))
    assert form.readouts == (("t", "0,50"), ("word", "<late>"))
    assert [svg.count("lab-trace ") for svg in form.plots] == [1, 2]


VALUES = [
    (1.0, 3, "1,000"),
    (-1.5, 1, "−1,5"),
    (-0.0004, 3, "0,000"),
    (-0.5, 0, "0"),
    (0.0005, 3, "0,001"),
    (1e9, 0, "1,00·10⁹"),
    (-2.5e300, 3, "−2,500·10³⁰⁰"),
    (999999999.0, 1, "999999999,0"),
    (None, 3, "–"),
    ("-1.5", 3, "-1.5"),
]


def test_record_has_values_as_text_and_a_picture_whose_size_follows_the_lab() -> None:
    eye = {"azimuth": 0, "elevation": 0, "distance": 1, "target": (0, 0, 0), "fovy": 90}
    main: Any = {
        "plots": {"times": [], "plots": []},
        "pictures": [{"time": 0, "readouts": [value for value, _, _ in VALUES]}],
        "scene": {"camera": {**eye, "orthographic": False}},
        "arrows": None,
    }
    readouts = [{"label": "r", "expr": "1", "digits": digits} for _, digits, _ in VALUES]
    heights = (80, 260, 480, 2000, 300)
    records = [lab_record(make_lab(height=h, readouts=readouts), main, ",") for h in heights]
    assert records[0].readouts == tuple(("r", text) for _, _, text in VALUES)
    sizes = [(640, 160), (640, 347), (640, 480), (640, 480), (640, 400)]
    assert [record.size for record in records] == sizes
    assert records[-1].scale == (0.5, pytest.approx(100)), "2 m are 400 pixels high"
