"""Pictures of labs: what is drawn, and surfaces of geoms that degenerate."""

from __future__ import annotations

import math
import tracemalloc
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from numpy.typing import NDArray

from coursebuild.features.lab.picture.draw import Floor, FreeCamera, Solid, draw
from coursebuild.features.lab.picture.png import moving_png, png
from coursebuild.features.lab.picture.raster import TextureMapping, texture_of
from coursebuild.features.lab.picture.shapes import (
    Kind,
    flat_surface,
    grid_faces,
    ropes,
    sharpen,
    smooth_surface,
    surface,
)
from support.model_files import read_moving_png, read_png

FRONT = FreeCamera(azimuth=90, elevation=0, distance=4, target=(0, 0, 0))
"""Looks along +y: x is to the right, z is up."""
SIZE = (80, 60)
RED, GREEN, BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)
Pixels = NDArray[np.uint8]


def solid(
    kind: Kind = "box",
    at: tuple[float, float, float] = (0, 0, 0),
    size: tuple[float, ...] = (0.5, 0.5, 0.5),
    rgba: tuple[float, float, float, float] = RED,
    rotation: NDArray[np.float64] | None = None,
) -> Solid:
    shape = surface(kind, size)
    assert shape is not None
    turn = np.eye(3) if rotation is None else rotation
    return Solid(shape, np.array(at, dtype=float), turn, rgba)


def covered(pixels: Pixels) -> NDArray[np.bool_]:
    return pixels[..., 3] > 127


def colour_at(pixels: Pixels, x: int, y: int) -> str:
    r, g, b, a = (int(v) for v in pixels[y, x])
    if a == 0:
        return "clear"
    return "red" if r > max(g, b) else "green" if g > b else "blue" if b else "black"


def test_the_nearest_is_seen_whatever_comes_first() -> None:
    solids = (
        solid(at=(0, -1, 0), size=(0.2, 0.1, 0.2), rgba=GREEN),
        solid(at=(0, 0, 0), size=(0.6, 0.1, 0.6), rgba=RED),
        solid(at=(0, 1, 0), size=(1.5, 0.1, 1.0), rgba=BLUE),
    )
    for order in ((0, 1, 2), (2, 1, 0), (1, 0, 2)):
        pixels = draw(tuple(solids[i] for i in order), FRONT, SIZE)
        colours = [colour_at(pixels, x, 30) for x in (40, 50, 57, 79)]
        assert colours == ["green", "red", "blue", "clear"]


def test_a_plane_that_goes_on_behind_the_camera() -> None:
    camera = FreeCamera(90, -10, 4, (0, 0, 0.5))
    pixels = draw((solid("plane", size=(0, 0, 1)),), camera, SIZE)
    assert covered(pixels)[-1].all(), "it reaches the lower edge"
    assert not covered(pixels)[0].any()
    assert covered(pixels).mean() > 0.5


def test_what_is_behind_the_camera_is_not_drawn() -> None:
    assert not draw((solid(at=(0, -9, 0)),), FRONT, SIZE).any()
    assert not draw((solid(at=(0, -4.5, 0), size=(0.1, 0.1, 0.1)),), FRONT, SIZE).any()


def test_the_camera_within_a_thing_sees_its_inside() -> None:
    assert covered(draw((solid(size=(10, 10, 10)),), FRONT, SIZE)).all()


def test_transparent_things_are_mixed_in_any_order_and_hidden_by_others() -> None:
    sheets = [
        solid(at=(0, y, 0), size=(0.5, 0.001, 0.5), rgba=rgba)
        for y, rgba in ((-1, (1, 0, 0, 0.5)), (0, (0, 1, 0, 0.5)), (1, (0, 0, 1, 0.5)))
    ]
    assert np.array_equal(draw(sheets, FRONT, SIZE), draw(sheets[::-1], FRONT, SIZE))
    front = solid(at=(0, -1, 0), rgba=RED)
    glass = solid(at=(0, 2, 0), size=(0.2, 0.1, 0.2), rgba=(0, 0, 1, 0.5))
    assert np.array_equal(draw((front, glass), FRONT, SIZE), draw((front,), FRONT, SIZE))
    assert not draw((solid(rgba=(1, 1, 1, 0)),), FRONT, SIZE).any()


def test_a_transparent_face_in_the_place_of_another_is_drawn_over_it() -> None:
    """The box of inertia of a box has its faces, with other rounding."""
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    size = (0.7, 0.5, 0.3)
    inertia = solid(at=(1e-9, 1e-9, 0), size=size, rgba=(0, 0, 1, 0.6), rotation=turn)
    pixels = draw((solid(size=size, rotation=turn), inertia), FRONT, SIZE)
    inside = pixels[25:35, 30:50].reshape(-1, 4)
    assert np.all(inside[:, 2] > inside[:, 0])


def test_colours_stay_in_range() -> None:
    pixels = draw((solid("sphere", size=(1,), rgba=(9.0, -3.0, 0.5, 1.0)),), FRONT, SIZE)
    assert (pixels[30, 40, 0], pixels[30, 40, 1]) == (255, 0)


def test_a_pattern_far_away_is_its_mean_colour() -> None:
    """It is not a noise of squares that samples happen to hit."""
    squares = np.kron([[255, 0], [0, 255]], np.ones((8, 8))).astype(np.uint8)
    record = {"type": 0, "width": 16, "height": 16, "channels": 1, "data": squares.ravel()}
    texture = texture_of(record)
    assert texture is not None
    mapping = TextureMapping(texture, "plane", (300, 300, 1.0), (600, 600), uniform=False)
    floor = solid("plane", size=(300, 300, 1), rgba=(1, 1, 1, 1))
    floor = replace(floor, texture=mapping, plane=True)
    pixels = draw((floor,), FreeCamera(90, -60, 300, (0, 0, 0)), SIZE)[..., 0]
    assert np.ptp(pixels[20:40].astype(int)) < 25


def test_many_small_triangles_look_as_few_large_ones() -> None:
    """The same square as two triangles and as eight thousand."""
    steps = np.linspace(-0.8, 0.8, 65)
    grid = np.stack(np.meshgrid(steps, [0.0], steps, indexing="ij"), axis=-1).reshape(65, 65, 3)
    corners = np.array([(-0.8, 0, -0.8), (0.8, 0, -0.8), (0.8, 0, 0.8), (-0.8, 0, 0.8)])
    coarse = np.array([(0, 1, 2), (0, 2, 3)])
    camera = replace(FRONT, azimuth=70, elevation=-15)
    pictures = [
        draw((Solid(flat_surface(v, f), np.zeros(3), np.eye(3), RED),), camera, (120, 90))
        for v, f in ((grid.reshape(-1, 3), grid_faces(65, 65)), (corners, coarse))
    ]
    assert np.array_equal(covered(pictures[0]), covered(pictures[1]))
    colours = [p[covered(p)].astype(int) for p in pictures]
    assert np.abs(colours[0] - colours[1]).max() <= 12  # brightness is worked out at corners


@pytest.mark.long
def test_the_shadows_of_hundreds_of_bodies_take_little_memory() -> None:
    """A ball has 868 triangles; with all that is known of their corners 400 took 1 GB."""
    places = [(x / 5, y / 5, 0.0) for x in range(-6, 6) for y in range(-6, 6)]
    balls = [replace(solid("sphere", at, (0.05,) * 3), body=True) for at in places]
    tracemalloc.start()
    try:
        draw(balls, FRONT, SIZE, floor=Floor(-0.1, 4.0, (0.0, 0.0, 0.0)))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 100 << 20


@pytest.mark.parametrize("rgba", [RED, (1.0, 0.0, 0.0, 0.5)])
def test_what_is_nowhere_is_left_out(rgba: tuple[float, float, float, float]) -> None:
    visible = solid("sphere", size=(0.3,), rgba=GREEN)
    nowhere = (math.nan, math.inf, -math.inf, 1e300, 1e15)
    lost_solids = [
        *(solid(at=(value, 0, 0), rgba=rgba) for value in nowhere),
        solid(rotation=np.full((3, 3), math.nan), rgba=rgba),
        solid(size=(math.nan, 1, 1), rgba=rgba),
        solid(size=(0.0, 0.0, 0.0), rgba=rgba),
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.array_equal(
            draw((*lost_solids, visible), FRONT, SIZE), draw((visible,), FRONT, SIZE)
        )


@settings(max_examples=25, deadline=None)
@given(
    st.floats(-720, 720),
    st.floats(-90, 90),
    st.floats(0, 100),
    st.tuples(*[st.floats(-5, 5)] * 3),
    st.floats(1, 170),
)
def test_any_camera(
    azimuth: float,
    elevation: float,
    distance: float,
    target: tuple[float, float, float],
    fovy: float,
) -> None:
    camera = FreeCamera(azimuth, elevation, distance, target, fovy)
    solids = (
        solid("plane", size=(0, 0, 1)),
        solid("sphere", size=(0.5,), rgba=GREEN),
        solid("capsule", at=(1, 1, 1), size=(0.2, 0.5), rgba=(0, 0, 1, 0.5)),
    )
    pixels = draw(solids, camera, (24, 18))
    assert pixels.dtype == np.uint8 and pixels.shape == (18, 24, 4)
    assert np.array_equal(draw(solids, camera, (24, 18)), pixels), "the same each time"


def test_a_file_is_read_back_as_it_was() -> None:
    random = np.random.default_rng(0)
    for width, height in ((1, 1), (7, 3), (64, 48)):
        pixels = random.integers(0, 255, (height, width, 4), dtype=np.uint8)
        assert np.array_equal(read_png(png(pixels)), pixels)
        pixels[..., 3] = 255
        assert np.array_equal(read_png(png(pixels)), pixels)


def test_a_moving_file_is_read_back_as_it_was() -> None:
    random = np.random.default_rng(1)
    frames = [random.integers(0, 255, (12, 20, 4), dtype=np.uint8)]
    for part in ((3, 5, 7, 9), (0, 12, 0, 20), (4, 4, 4, 4), (11, 12, 19, 20)):
        frame = frames[-1].copy()
        top, bottom, left, right = part
        frame[top:bottom, left:right] = random.integers(0, 255, frame[top:bottom, left:right].shape)
        frames.append(frame)
    for opaque in (False, True):
        if opaque:
            frames = [
                np.dstack((frame[..., :3], np.full((12, 20), 255, np.uint8))) for frame in frames
            ]
        read, durations, rounds = read_moving_png(moving_png(frames, rate=25, rounds=3))
        assert (len(read), durations, rounds) == (len(frames), {40}, 3)
        assert all(map(np.array_equal, read, frames)), opaque


def test_normals_of_an_ellipsoid_are_those_of_its_equation() -> None:
    axes = np.array((0.5, 0.2, 1.0))
    shape = surface("ellipsoid", (0.5, 0.2, 1.0))
    assert shape is not None
    gradient = shape.vertices / axes**2
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    assert np.allclose(shape.normals, gradient, atol=1e-9)


def test_a_triangle_without_area_has_no_normal_and_no_error() -> None:
    shape = flat_surface(np.zeros((3, 3)), np.array([(0, 1, 2)]))
    assert np.array_equal(shape.normals, np.zeros((3, 3)))


def test_a_rope_whose_ends_meet_is_a_ball() -> None:
    rope = ropes(np.zeros((2, 3)), np.array([(0, 1)]), 0.2)
    assert np.isfinite(rope.vertices).all()
    assert np.linalg.norm(rope.vertices, axis=1).max() == pytest.approx(0.2)


def test_a_smooth_surface_has_the_mean_normal_of_its_faces() -> None:
    ridge = np.array([(0.0, -1, 0), (0, 1, 0), (-1, 0, -1), (1, 0, -1)])
    shape = smooth_surface(ridge, np.array([(0, 1, 2), (1, 0, 3)]))
    assert shape.normals[0] == pytest.approx((0, 0, 1))
    assert shape.normals[3] == pytest.approx((math.sqrt(0.5), 0, math.sqrt(0.5)))


def test_an_edge_is_sharp_where_the_face_is_turned_far() -> None:
    up = np.tile((0.0, 0.0, 1.0), (1, 3, 1))
    for angle, sharp in ((0.3, False), (0.6, False), (0.7, True), (1.5, True)):
        corners = np.array([[(0.0, 0, 0), (1, 0, 0), (0, math.cos(angle), math.sin(angle))]])
        expected = (0, -math.sin(angle), math.cos(angle)) if sharp else (0, 0, 1)
        assert sharpen(corners, up)[0, 1] == pytest.approx(expected), angle
    assert np.array_equal(sharpen(np.zeros((1, 3, 3)), up), up), "no face, no normal of it"
