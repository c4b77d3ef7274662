"""Pictures without a graphics processor: where things are, what hides what, and the file."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from numpy.typing import NDArray

from coursebuild.features.lab.picture.draw import FreeCamera, Solid, draw
from coursebuild.features.lab.picture.light import Light, Material, PointLight, material_of
from coursebuild.features.lab.picture.shapes import Kind, flat_surface, surface
from coursebuild.features.lab.picture.static import png
from coursebuild.features.lab.picture.textures import TextureMapping, texture_of
from support.png_files import read_png

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


def test_nothing_is_clear() -> None:
    pixels = draw((), FRONT, SIZE)
    assert pixels.shape == (60, 80, 4)
    assert not pixels.any()


def test_the_size_on_the_screen_is_that_of_the_perspective() -> None:
    seen = covered(draw((solid(size=(0.5, 0.5, 0.5)),), FRONT, (200, 200)))
    # The nearest face is 1 m wide and 3.5 m away; the picture is 2·tan(22.5°) wide at 1 m.
    wide = 200 * (1 / 3.5) / (2 * math.tan(math.radians(22.5)))
    rows, columns = np.nonzero(seen)
    assert columns.max() - columns.min() + 1 == pytest.approx(wide, abs=1.5)
    assert rows.max() - rows.min() + 1 == pytest.approx(wide, abs=1.5)
    assert (columns.min() + columns.max()) / 2 == pytest.approx(99.5, abs=0.6)


@pytest.mark.parametrize(
    ("at", "x", "y"),
    [((1, 0, 0), 60, 30), ((-1, 0, 0), 20, 30), ((0, 0, 0.8), 40, 14), ((0, 0, -0.8), 40, 46)],
)
def test_right_is_right_and_up_is_up(at: tuple[float, float, float], x: int, y: int) -> None:
    pixels = draw((solid(at=at, size=(0.2, 0.2, 0.2)),), FRONT, SIZE)
    assert colour_at(pixels, x, y) == "red"
    assert colour_at(pixels, 79 - x if x != 40 else x, 59 - y if y != 30 else y) == "clear"


def test_cameras_of_mujoco() -> None:
    """MuJoCo's free camera: azimuth 0 looks along +x, elevation −90 down, with +x up then."""
    front = solid(at=(0, -1, 0), size=(0.1, 0.1, 0.1))
    pixels = draw((front,), FreeCamera(0, 0, 4, (0, 0, 0)), SIZE)
    columns = np.nonzero(covered(pixels))[1]
    assert columns.min() > 40, "looking along +x, −y is to the right"
    above = draw(
        (solid(at=(1, 0, 0), size=(0.1, 0.1, 0.1)),), FreeCamera(0, -90, 4, (0, 0, 0)), SIZE
    )
    assert np.nonzero(covered(above))[0].max() < 30, "from above +x is up"


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
def test_the_nearest_is_seen_whatever_comes_first(order: tuple[int, ...]) -> None:
    solids = (
        solid(at=(0, -1, 0), size=(0.2, 0.1, 0.2), rgba=GREEN),
        solid(at=(0, 0, 0), size=(0.6, 0.1, 0.6), rgba=RED),
        solid(at=(0, 1, 0), size=(1.5, 0.1, 1.0), rgba=BLUE),
    )
    pixels = draw(tuple(solids[i] for i in order), FRONT, SIZE)
    assert [colour_at(pixels, x, 30) for x in (40, 50, 57, 79)] == ["green", "red", "blue", "clear"]


def test_what_goes_through_each_other_is_cut_where_they_meet() -> None:
    turn = np.array(
        [(math.cos(0.6), -math.sin(0.6), 0), (math.sin(0.6), math.cos(0.6), 0), (0, 0, 1)]
    )
    flat = solid(size=(1, 0.001, 1), rgba=RED)
    slanted = solid(size=(1, 0.001, 1), rgba=BLUE, rotation=turn)
    pixels = draw((flat, slanted), FRONT, SIZE)
    assert (colour_at(pixels, 30, 30), colour_at(pixels, 50, 30)) == ("blue", "red")


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


class TestTransparency:
    def test_what_is_behind_shines_through(self) -> None:
        glass = solid(at=(0, -1, 0), size=(0.5, 0.001, 0.5), rgba=(0, 0, 1, 0.5))
        pixels = draw((glass, solid(rgba=RED)), FRONT, SIZE)
        r, _, b, a = (int(v) for v in pixels[30, 40])
        assert a == 255 and r > 40 and b > 60

    def test_alone_it_covers_partly(self) -> None:
        pixels = draw((solid(size=(0.5, 0.001, 0.5), rgba=(1, 0, 0, 0.5)),), FRONT, SIZE)
        # Of what is closed only the outside is seen.
        assert int(pixels[30, 40, 3]) == pytest.approx(255 * 0.5, abs=2)
        assert colour_at(pixels, 40, 30) == "red"

    def test_the_order_does_not_matter(self) -> None:
        sheets = [
            solid(at=(0, y, 0), size=(0.5, 0.001, 0.5), rgba=rgba)
            for y, rgba in ((-1, (1, 0, 0, 0.5)), (0, (0, 1, 0, 0.5)), (1, (0, 0, 1, 0.5)))
        ]
        assert np.array_equal(draw(sheets, FRONT, SIZE), draw(sheets[::-1], FRONT, SIZE))

    def test_behind_something_it_is_hidden(self) -> None:
        front = solid(at=(0, -1, 0), rgba=RED)
        glass = solid(at=(0, 2, 0), size=(0.2, 0.1, 0.2), rgba=(0, 0, 1, 0.5))
        assert np.array_equal(draw((front, glass), FRONT, SIZE), draw((front,), FRONT, SIZE))

    def test_the_invisible_is_not_drawn(self) -> None:
        assert not draw((solid(rgba=(1, 1, 1, 0)),), FRONT, SIZE).any()


def test_light_makes_round_things_round() -> None:
    pixels = draw((solid("sphere", size=(1, 0, 0), rgba=(1, 1, 1, 1)),), FRONT, SIZE)
    middle, edge = int(pixels[30, 40, 0]), int(pixels[46, 52, 0])
    assert middle > edge + 20
    assert len(np.unique(pixels[covered(pixels)][:, 0])) > 40


def test_colours_stay_in_range() -> None:
    pixels = draw((solid("sphere", size=(1,), rgba=(9.0, -3.0, 0.5, 1.0)),), FRONT, SIZE)
    assert (pixels[30, 40, 0], pixels[30, 40, 1]) == (255, 0)


def checkered(half: float, repeat: tuple[float, float], uniform: bool) -> TextureMapping:
    """A texture of 2 × 2 squares on a plane."""
    squares = np.kron([[255, 0], [0, 255]], np.ones((8, 8))).astype(np.uint8)
    given = {"type": 0, "width": 16, "height": 16, "channels": 1, "data": squares.ravel()}
    texture = texture_of(given)
    assert texture is not None
    return TextureMapping(texture, "plane", (half, half, 1.0), repeat, uniform)


@pytest.mark.parametrize(
    ("repeat", "uniform", "wide"),
    [((3, 3), False, 1.0), ((1, 1), True, 1.0), ((2, 2), True, 0.5), ((1, 1), False, 3.0)],
)
def test_a_pattern_has_its_width(repeat: tuple[float, float], uniform: bool, wide: float) -> None:
    """A uniform texture is there so often in two metres, another so often on the whole plane."""
    camera = FreeCamera(0, -90, 10, (0, 0, 0))
    floor = solid("plane", size=(3, 3, 1), rgba=(1, 1, 1, 1))
    texture = checkered(3, repeat, uniform)
    floor = replace(floor, texture=texture, plane=True, material=Material(specular=0.0))
    row = draw((floor,), camera, (200, 200))[110, :, 0].astype(int)
    bright = row[30:170] > (row[30:170].max() + row[30:170].min()) / 2
    changes = np.nonzero(np.diff(bright))[0]
    # A metre at 10 m, where 200 samples are 2·tan(22.5°)·10 m.
    metre = 200 / (20 * math.tan(math.radians(22.5)))
    assert np.abs(np.diff(changes) - wide * metre).max(initial=0) <= 1
    assert len(changes) == round(6 / wide) - 1


def test_a_pattern_far_away_is_its_mean_colour() -> None:
    """And not a noise of squares that happen to be hit."""
    floor = solid("plane", size=(300, 300, 1), rgba=(1, 1, 1, 1))
    floor = replace(floor, texture=checkered(300, (600, 600), uniform=False), plane=True)
    pixels = draw((floor,), FreeCamera(90, -60, 300, (0, 0, 0)), SIZE)[..., 0]
    assert np.ptp(pixels[20:40].astype(int)) < 25


LAMP = Light(np.zeros(3), (PointLight(np.ones(3), np.array((0.0, 0.0, -1.0))),), 1.0)
"""From above, and nothing else."""
DULL = Material(specular=0.0)


def brightness(
    made: Solid, light: Light, camera: FreeCamera = FRONT, at: tuple[int, int] = (30, 40)
) -> int:
    return int(draw((made,), camera, SIZE, light)[at][0])


class TestLight:
    WHITE = (1.0, 1.0, 1.0, 1.0)

    def floor(self, material: Material = DULL, **fields: object) -> Solid:
        made = solid("plane", size=(3, 3, 1), rgba=(0.5, 0.5, 0.5, 1.0))
        return replace(made, plane=True, material=material, **fields)  # type: ignore[arg-type]

    def test_a_lamp_lights_by_its_angle(self) -> None:
        down = FreeCamera(0, -90, 4, (0, 0, 0))
        for angle in (0.0, 0.6, 1.2):
            towards = np.array((math.sin(angle), 0.0, -math.cos(angle)))
            light = Light(np.zeros(3), (PointLight(np.ones(3), towards),), 1.0)
            found = brightness(self.floor(), light, down)
            assert found == pytest.approx(127.5 * math.cos(angle), abs=2)

    def test_a_cone_ends(self) -> None:
        down = FreeCamera(0, -90, 4, (0, 0, 0))
        narrow = PointLight(
            np.ones(3), np.array((0.0, 0.0, -1.0)), np.array((0.0, 0.0, 1.0)), (0.9, 0.9)
        )
        light = Light(np.zeros(3), (narrow,), 1.0)
        row = draw((self.floor(),), down, SIZE, light)[30, :, 0]
        reach = np.flatnonzero(row)
        # At 1 m below the lamp the cone is tan(acos 0.9) wide; the picture is 60 pixels high.
        wide = 2 * math.tan(math.acos(0.9)) * 60 / (8 * math.tan(math.radians(22.5)))
        assert reach.max() - reach.min() + 1 == pytest.approx(wide, abs=2)

    def test_from_below_a_plane_is_lit_as_above_and_half_there(self) -> None:
        """As MuJoCo's renderer draws it."""
        up = FreeCamera(0, 90, 4, (0, 0, 0))
        pixels = draw((self.floor(),), up, SIZE, LAMP)
        assert pixels[30, 40].tolist() == pytest.approx([128, 128, 128, 128], abs=2)

    def test_a_surface_that_sends_out_light_is_seen_in_the_dark(self) -> None:
        dark = Light(np.zeros(3), (), 1.0)
        assert brightness(solid(rgba=self.WHITE), dark) == 0
        glowing = replace(solid(rgba=self.WHITE), material=Material(emission=0.5))
        assert brightness(glowing, dark) == pytest.approx(128, abs=2)

    def test_a_rough_surface_has_a_wide_dim_highlight(self) -> None:
        ahead = Light(np.zeros(3), (PointLight(np.ones(3), np.array((0.0, 1.0, 0.0))),), 1.0)
        found = []
        for roughness in (0.3, 0.8):
            scene = {"materials": [plain(roughness=roughness)]}
            ball = replace(
                solid("sphere", size=(1.0,), rgba=(0.0, 0.0, 0.0, 1.0)),
                material=material_of(scene, 0),
            )
            found.append(draw((ball,), FRONT, SIZE, ahead)[30, 40:58, 0].astype(int))
        assert found[0][0] > 3 * found[1][0] > 0
        assert found[0][6] < found[1][6], "off the middle it is the other way round"

    def test_a_metal_colours_its_highlight(self) -> None:
        ahead = Light(np.zeros(3), (PointLight(np.ones(3), np.array((0.0, 1.0, 0.0))),), 1.0)
        shown = {}
        for metallic in (0.0, 1.0):
            scene = {"materials": [plain(metallic=metallic, roughness=0.4)]}
            ball = solid("sphere", size=(1.0,), rgba=(0.6, 0.3, 0.0, 1.0))
            ball = replace(ball, material=material_of(scene, 0))
            shown[metallic] = draw((ball,), FRONT, SIZE, ahead)[30, 40].astype(int)
        assert shown[0.0][2] > 10 and shown[1.0][2] == 0, "white on paint, none of blue on gold"
        assert shown[1.0][0] > shown[0.0][0]


def plain(**fields: float) -> dict[str, float]:
    """A material as a trial records it."""
    unset = {"emission": 0.0, "specular": 0.5, "shininess": 0.5, "reflectance": 0.0}
    return {**unset, "metallic": -1.0, "roughness": -1.0, **fields}


class TestMirror:
    """Looking along +y and down at a dark floor, a red ball over it."""

    CAMERA = FreeCamera(90, -30, 5, (0, 0, 0))
    BALL = solid("sphere", at=(0, 0, 1), size=(0.4,), rgba=RED)

    def floor(self, reflectance: float, alpha: float = 1.0, **fields: object) -> Solid:
        made = solid("plane", size=(4, 4, 1), rgba=(0, 0, 0, alpha))
        given = {"plane": True, "mirror": 0.0, **fields}
        material = Material(specular=0.0, reflectance=reflectance)
        return replace(made, material=material, **given)  # type: ignore[arg-type]

    def reds(self, *solids: Solid, camera: FreeCamera = CAMERA) -> NDArray[np.int64]:
        """Red in each row, in the middle column."""
        return draw(solids, camera, (80, 60))[:, 40, 0].astype(int)

    def test_a_floor_shows_what_is_above_it_where_its_image_is(self) -> None:
        image = replace(self.BALL, position=np.array((0.0, 0.0, -1.0)))
        shown = self.reds(self.floor(0.5), self.BALL)
        there = np.flatnonzero(self.reds(image))
        ball = np.flatnonzero(self.reds(self.BALL))
        lit = np.flatnonzero(shown)
        assert set(lit) == set(there) | set(ball)
        weak = [row for row in there if row not in ball]
        assert shown[weak].max() == pytest.approx(0.5 * self.reds(self.BALL).max(), rel=0.35)

    def test_what_is_below_is_not_mirrored(self) -> None:
        under = replace(self.BALL, position=np.array((0.0, 0.0, -1.0)))
        assert not self.reds(self.floor(0.5), under).any()

    def test_without_reflectance_or_seen_through_it_does_not_reflect(self) -> None:
        ball = set(np.flatnonzero(self.reds(self.BALL)))
        for floor in (self.floor(0.0), self.floor(0.5, 0.9), self.floor(0.5, mirror=None)):
            assert set(np.flatnonzero(self.reds(floor, self.BALL))) == ball

    def test_only_the_first_reflects(self) -> None:
        other = replace(self.floor(0.5), position=np.array((0.0, 0.0, 0.001)))
        ball = set(np.flatnonzero(self.reds(self.BALL)))
        assert set(np.flatnonzero(self.reds(self.floor(0.5), other, self.BALL))) == ball

    def test_of_a_box_only_the_upper_face(self) -> None:
        box = solid("box", at=(0, 0, -0.5), size=(1.5, 1.5, 0.5), rgba=(0, 0, 0, 1))
        shiny = replace(box, material=Material(specular=0.0, reflectance=0.5), mirror=0.5)
        above = self.reds(shiny, self.BALL)
        assert above.astype(bool).sum() > self.reds(self.BALL).astype(bool).sum() + 5
        aside = replace(self.BALL, position=np.array((0.0, -2.0, -0.6)))
        assert set(np.flatnonzero(self.reds(shiny, aside))) == set(np.flatnonzero(self.reds(aside)))


def test_a_sky_is_behind_everything() -> None:
    """+z above: MuJoCo's faces are right, left, up, down, front, back of one who looks along +y."""
    colours = [(255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 0), (0, 255, 255), (255, 0, 255)]
    data = np.repeat(np.array(colours, np.uint8), 16, axis=0).ravel()
    given = {"type": 2, "width": 4, "height": 24, "channels": 3, "data": data}
    texture = texture_of(given)
    seen = {}
    for name, azimuth, elevation in (("up", 0, 90), ("down", 0, -90), ("x", 0, 0), ("y", 90, 0)):
        camera = FreeCamera(azimuth, elevation, 4, (0, 0, 0))
        pixels = draw((solid(size=(0.1, 0.1, 0.1)),), camera, SIZE, background=texture)
        assert (pixels[..., 3] == 255).all()
        seen[name] = tuple(int(v) for v in pixels[30, 15, :3])
    assert seen["up"] == (0, 0, 255) and seen["down"] == (255, 255, 0)
    assert seen["x"] != seen["y"]


def test_the_same_each_time() -> None:
    solids = [
        solid(
            "sphere", at=(0.3 * i, 0.1 * i, 0), size=(0.3, 0.4, 0.5), rgba=(0.1 * i, 0.5, 0.5, 1.0)
        )
        for i in range(5)
    ] + [solid("capsule", at=(0, 0, 0.5), size=(0.2, 0.6), rgba=(1, 0, 0, 0.4))]
    assert png(draw(solids, FRONT, SIZE)) == png(draw(solids, FRONT, SIZE))


def test_many_small_triangles_look_as_few_large_ones() -> None:
    """The same square as two triangles and as eight thousand."""
    steps = np.linspace(-0.8, 0.8, 65)
    grid = np.stack(np.meshgrid(steps, [0.0], steps, indexing="ij"), axis=-1).reshape(65, 65, 3)
    index = np.arange(65 * 65).reshape(65, 65)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    fine = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    corners = np.array([(-0.8, 0, -0.8), (0.8, 0, -0.8), (0.8, 0, 0.8), (-0.8, 0, 0.8)])
    coarse = np.array([(0, 1, 2), (0, 2, 3)])
    camera = replace(FRONT, azimuth=70, elevation=-15)
    pictures = [
        draw((Solid(flat_surface(v, f), np.zeros(3), np.eye(3), RED),), camera, (120, 90))
        for v, f in ((grid.reshape(-1, 3), fine), (corners, coarse))
    ]
    assert np.array_equal(covered(pictures[0]), covered(pictures[1]))
    both = [p[covered(p)].astype(int) for p in pictures]
    assert np.abs(both[0] - both[1]).max() <= 12  # brightness is worked out at corners


class TestBlownUp:
    @pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300, 1e15])
    @pytest.mark.parametrize("rgba", [RED, (1.0, 0.0, 0.0, 0.5)])
    def test_what_is_nowhere_is_left_out(
        self, value: float, rgba: tuple[float, float, float, float]
    ) -> None:
        gone = solid(at=(value, 0, 0), rgba=rgba)
        here = solid("sphere", size=(0.3,), rgba=GREEN)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert np.array_equal(draw((gone, here), FRONT, SIZE), draw((here,), FRONT, SIZE))

    def test_rotations_and_sizes_that_are_no_numbers(self) -> None:
        broken = [
            solid(rotation=np.full((3, 3), math.nan)),
            solid(size=(math.nan, 1, 1)),
            solid(size=(0.0, 0.0, 0.0)),
        ]
        assert not draw(broken, FRONT, SIZE).any()

    def test_a_camera_at_its_target(self) -> None:
        assert draw((solid(),), replace(FRONT, distance=0.0), SIZE).shape == (60, 80, 4)


@settings(max_examples=25, deadline=None)
@given(
    st.floats(-720, 720),
    st.floats(-90, 90),
    st.floats(0.01, 100),
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


@pytest.mark.parametrize("size", [(1, 1), (7, 3), (64, 48)])
@pytest.mark.parametrize("opaque", [True, False])
def test_a_file_is_read_back_as_it_was(size: tuple[int, int], opaque: bool) -> None:
    random = np.random.default_rng(0)
    pixels = random.integers(0, 256, (size[1], size[0], 4), dtype=np.uint8)
    if opaque:
        pixels[..., 3] = 255
    else:
        pixels[0, 0, 3] = 7
    assert np.array_equal(read_png(png(pixels)), pixels)


def test_an_even_picture_takes_little_room() -> None:
    y, x = np.mgrid[:64, :64]
    grey = (100 + 2 * x - y) % 256
    data = png(np.dstack([grey, grey, grey, np.full_like(grey, 255)]).astype(np.uint8))
    assert len(data) < 500
