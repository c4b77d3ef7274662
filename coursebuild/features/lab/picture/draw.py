"""Draws a picture of a scene without a graphics processor.

1. Every solid's triangles are projected (`raster.py`); each of the 2 × 2 samples of a pixel keeps
   the nearest surface, with its place, normal and texture coordinates there.
2. The samples are coloured by texture and light, and the first shiny plane or box
   shows what the camera's mirror image sees.
3. Transparent solids are mixed in, the farthest first, and the sky is put behind all.

The same input gives the same bytes: no clock, no threads, colours rounded at the end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from coursebuild.features.lab.picture import raster
from coursebuild.features.lab.picture.shapes import (
    LAMP,
    Array,
    Light,
    Material,
    Surface,
    dot,
    join_surfaces,
    shade,
    studio,
)

_SAMPLES = 2
_NEAR_SHARE = 0.01
"""Nearest distance that is drawn, as a part of the camera's distance from its target."""
_OPAQUE_ALPHA, _CLEAR_ALPHA = 0.999, 0.001
_FROM_BELOW = 0.5
"""Factor of the opacity of a plane seen from below, as in MuJoCo."""
_SAME_PLACE = 1e-5
"""A transparent face that is further than another by this part of its distance is drawn over it:
the box of inertia of a box has the same faces, and rounding would decide for each sample."""
_TOP = 0.5
_AT_ONCE = 1 << 16
_STEPS = 127
"""Shades from black to white: nobody can see more, and the file is a quarter smaller."""
_PLAIN = Material()

Samples: TypeAlias = tuple[NDArray[np.intp], ...]
"""Rows and columns."""
_SHARPER = 4.0
"""How much longer than wide a sample may be on a surface before the texture is blurred."""


class Solid(Struct, frozen=True):
    """A surface with its pose and its look."""

    surface: Surface
    position: Array
    """(3,), m, world."""
    rotation: Array
    """(3, 3); columns are the solid's axes in the world."""
    rgba: tuple[float, float, float, float]
    material: Material = _PLAIN
    texture: raster.TextureMapping | None = None
    plane: bool = False
    """Whether it is a plane, which is lit by its upper side."""
    mirror: float | None = None
    """Height of its upper face along its z axis, m, if that face can reflect."""
    open: bool = False
    """Whether both of its sides are visible."""
    body: bool = False
    """Whether it has an edge and a shadow."""
    front: bool = False
    """Whether nothing covers it."""

    def world_surface(self) -> Surface:
        """Return its surface in world coordinates."""
        vertices = raster.rotate(self.surface.vertices, self.rotation) + self.position
        return replace(self.surface, vertices=vertices, uv=None)

    @property
    def opaque(self) -> bool:
        """Whether nothing shows through it."""
        return self.rgba[3] >= _OPAQUE_ALPHA

    def seen_from(self, eye: raster.Eye) -> Solid:
        """Return it as an eye sees it: a plane is more transparent from below."""
        if not self.plane or self.rotation[:, 2] @ (eye.position - self.position) >= 0:
            return self
        red, green, blue, alpha = self.rgba
        return replace(self, rgba=(red, green, blue, alpha * _FROM_BELOW))

    def reflects(self, eye: raster.Eye) -> bool:
        """Whether an eye sees other things in it."""
        if self.mirror is None or self.material.reflectance <= 0 or not self.opaque:
            return False
        return bool(self.rotation[:, 2] @ (eye.position - self.position) > self.mirror)

    def mirrored(self, eye: raster.Eye) -> raster.Eye:
        """Return the eye behind this mirror that sees what another sees in it."""
        normal = self.rotation[:, 2]
        offset = float(normal @ self.position) + (self.mirror or 0.0)
        height = float(normal @ eye.position) - offset
        axes = raster.rotate(eye.axes, np.eye(3) - 2 * np.outer(normal, normal))
        position = eye.position - 2 * height * normal
        return replace(eye, position=position, axes=axes, mirror=(normal, offset))


class FreeCamera(Struct, frozen=True):
    """MuJoCo's free camera."""

    azimuth: float
    """Degrees, about z."""
    elevation: float
    """Degrees; negative looks down."""
    distance: float
    """m, to the target."""
    target: tuple[float, float, float]
    """m, world."""
    fovy: float = 45.0
    """Vertical field of view, degrees."""

    @property
    def forward(self) -> Array:
        """(3,), of length 1: the direction in which it looks."""
        a, e = np.radians(self.azimuth), np.radians(self.elevation)
        return np.array((np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)))

    def eye(self, width: int, height: int) -> raster.Eye:
        """Return the eye of this camera with a screen of so many samples."""
        azimuth = np.radians(self.azimuth)
        right = np.array((np.sin(azimuth), -np.cos(azimuth), 0.0))
        axes = np.stack((right, np.cross(right, self.forward), self.forward))
        focal = height / 2 / np.tan(np.radians(self.fovy) / 2)
        near = max(_NEAR_SHARE * self.distance, 1e-6)
        position = np.array(self.target) - self.distance * self.forward
        return raster.Eye((width, height), focal, near, position, axes)


def draw(
    solids: Sequence[Solid],
    camera: FreeCamera,
    size: tuple[int, int],
    light: Light | None = None,
    background: raster.Texture | None = None,
    floor: Floor | None = None,
) -> NDArray[np.uint8]:
    """Draw a picture: (height, width, 4) bytes, RGBA, transparent where there is nothing.

    `size` is (width, height) in pixels; without `light` the light is that of a model without
    lights; `background` is the texture of a sky.
    """
    width, height = size
    light = studio(camera.forward) if light is None else light
    canvas = _Canvas(camera.eye(width * _SAMPLES, height * _SAMPLES), light)
    # A diverged simulation throws things out of the world.
    visible = (s for s in solids if s.rgba[3] > _CLEAR_ALPHA and np.isfinite(s.position).all())
    scene = [solid.seen_from(canvas.eye) for solid in visible]
    mirror = next((solid for solid in scene if solid.reflects(canvas.eye)), None)
    reflection = None
    if mirror is not None:
        reflection = _Canvas(mirror.mirrored(camera.eye(width, height)), light)
        reflection.paint([solid for solid in scene if solid is not mirror], None, None)
    canvas.paint(scene, mirror, reflection, floor, lines=True)
    if background is not None:
        canvas.put_behind(background)
    samples = canvas.colour.reshape(height, _SAMPLES, width, _SAMPLES, 4)
    mean = samples.sum(axis=1).sum(axis=2) / _SAMPLES**2
    # The colours are premultiplied with their coverage.
    mean[..., :3] /= np.where(mean[..., 3:] > 0, mean[..., 3:], 1.0)
    steps = np.rint(_STEPS * np.clip(mean, 0.0, 1.0))
    pixels: NDArray[np.uint8] = np.rint(255 / _STEPS * steps).astype(np.uint8)
    return pixels


class _Canvas:
    """Colours of the samples."""

    def __init__(self, eye: raster.Eye, light: Light) -> None:
        self.eye, self.light = eye, light
        self.colour = np.zeros((eye.size[1], eye.size[0], 4))
        """RGB, premultiplied with the coverage, and the coverage."""

    def paint(
        self,
        solids: Sequence[Solid],
        mirror: Solid | None,
        reflection: _Canvas | None,
        floor: Floor | None = None,
        *,
        lines: bool = False,
    ) -> None:
        """Draw solids, with lines around them; `mirror` shows `reflection`."""
        buffer = raster.GBuffer(self.eye)
        opaque = [solid for solid in solids if solid.opaque and not solid.front]
        self._paint_opaque(buffer, opaque, mirror, reflection)
        if lines and opaque:
            draw_edges(self.colour, buffer, np.array([solid.body for solid in opaque], dtype=bool))
        if floor is not None:
            floor.paint(
                self.colour, buffer, [solid.world_surface() for solid in solids if solid.body]
            )
        for solid in sorted((s for s in solids if not s.opaque), key=self._depth, reverse=True):
            film = raster.GBuffer(self.eye)
            film.depth = buffer.depth * (1 + _SAME_PLACE)
            # Only the outside is drawn, as in the live view.
            front = not (solid.open or solid.plane)
            film.add(0, solid.surface, solid.position, solid.rotation, front=front)
            self._colour(film, np.flatnonzero(film.solid == 0), solid, None)
        foremost = [solid for solid in solids if solid.opaque and solid.front]
        if foremost:
            self._paint_opaque(raster.GBuffer(self.eye), foremost, None, None)

    def _paint_opaque(
        self,
        buffer: raster.GBuffer,
        solids: Sequence[Solid],
        mirror: Solid | None,
        reflection: _Canvas | None,
    ) -> None:
        for i, solid in enumerate(solids):
            buffer.add(i, solid.surface, solid.position, solid.rotation, front=False)
        # To look for each solid in the whole picture would take long with hundreds of them.
        order = np.argsort(buffer.solid, axis=None, kind="stable")
        ends = np.searchsorted(buffer.solid.ravel()[order], np.arange(len(solids) + 1))
        for i, solid in enumerate(solids):
            samples = order[ends[i] : ends[i + 1]]
            self._colour(buffer, samples, solid, reflection if solid is mirror else None)

    def put_behind(self, background: raster.Texture) -> None:
        width, height = self.eye.size
        for y, x in _batches(np.flatnonzero(self.colour[..., 3] < 1), width):
            sight = np.column_stack(
                (x + 0.5 - width / 2, height / 2 - y - 0.5, np.full(len(x), self.eye.focal))
            )
            clear_share = 1 - self.colour[y, x, 3:]
            self.colour[y, x, :3] += clear_share * raster.sky(
                background, raster.rotate(sight, self.eye.axes.T)
            )
            self.colour[y, x, 3] = 1

    def _depth(self, solid: Solid) -> float:
        return float(self.eye.axes[2] @ (solid.position - self.eye.position))

    def _colour(
        self,
        buffer: raster.GBuffer,
        samples: NDArray[np.int64],
        solid: Solid,
        reflection: _Canvas | None,
    ) -> None:
        """Mix a solid into the picture at the samples, counted row by row, that show it."""
        alpha = 1.0 if solid.opaque else solid.rgba[3]
        for y, x in _batches(samples, self.eye.size[0]):
            colour = self._shade(buffer, solid, reflection, (y, x))
            opaque_colour = np.column_stack((np.clip(colour, 0.0, 1.0), np.ones(len(y))))
            self.colour[y, x] = alpha * opaque_colour + (1 - alpha) * self.colour[y, x]

    def _shade(
        self,
        buffer: raster.GBuffer,
        solid: Solid,
        reflection: _Canvas | None,
        samples: Samples,
    ) -> Array:
        attributes = buffer.attributes[samples].astype(float)
        places, local_normals = attributes[:, raster.POSITION], attributes[:, raster.NORMAL]
        local_normals = local_normals / _lengths(local_normals)
        points = raster.rotate(places, solid.rotation) + solid.position
        normals = raster.rotate(local_normals, solid.rotation)
        view = self.eye.position - points
        toward_eye = view / _lengths(view)
        facing = dot(normals, toward_eye)
        if not solid.plane:
            normals[facing < 0] *= -1
        texel = np.ones((1, 3))
        if solid.texture is not None:
            longer = 1 / np.maximum(np.abs(facing), 1e-3)
            steps = buffer.depth[samples] / self.eye.focal * np.maximum(longer / _SHARPER, 1.0)
            texel = solid.texture.texels(places, local_normals, attributes[:, raster.UV], steps)
        base = np.array(solid.rgba[:3])
        colour = shade(self.light, solid.material, base, texel, (points, normals, toward_eye))
        if reflection is not None:
            y, x = samples
            image = reflection.colour[y // _SAMPLES, x // _SAMPLES, :3]
            colour += solid.material.reflectance * (local_normals[:, 2:] > _TOP) * image
        return colour


def _lengths(vectors: Array) -> Array:
    """Return the lengths (n, 1) of vectors (n, 3), at least 1e-12."""
    return np.sqrt(dot(vectors, vectors)).clip(1e-12)[:, None]


def _batches(samples: NDArray[np.int64], width: int) -> Iterator[Samples]:
    """Yield samples, counted row by row, not too many at once."""
    for start in range(0, len(samples), _AT_ONCE):
        yield np.divmod(samples[start : start + _AT_ONCE], width)


_CELLS, _REACH, _LIFT = 10, 2.2, 0.0005
_GREY, _EDGE_GREY = 0.5, 0.42
_SHADOW, _POINTS, _WIDTH = 0.32, 10, 0.08
_GOLDEN = np.pi * (3 - np.sqrt(5))
"""Points at multiples of this angle lie evenly on a disc."""
_EDGE_SAMPLES = 2
_DEPTH_TOLERANCE = 1e-3


class Floor(Struct, frozen=True):
    """A level floor, as the live view draws it (`studio.js` of the page); so are the edges."""

    height: float
    """m."""
    distance: float
    """Distance of the camera from its target, m."""
    target: tuple[float, float, float]

    def paint(self, colour: Array, buffer: raster.GBuffer, bodies: Sequence[Surface]) -> None:
        """Mix it into colours (rows, columns, RGB and alpha) where nothing covers it."""
        eye, height = buffer.eye, self.height + self._lift / 2
        (width, rows), (right, up, forward) = eye.size, eye.axes
        x, y = np.arange(width) + 0.5 - width / 2, (rows / 2 - np.arange(rows) - 0.5)[:, None]
        with np.errstate(divide="ignore"):
            far = (height - eye.position[2]) / (right[2] * x + up[2] * y + forward[2] * eye.focal)
        is_seen = (far > 0) & (far * eye.focal < buffer.depth * (1 + _DEPTH_TOLERANCE))
        row, column = np.nonzero(is_seen & (far < raster.FAR_AWAY))
        x, y, far = x[column], y[row, 0], far[row, column]
        # In each direction: the place, and how far it is to those of the next column and row.
        place, step = np.empty((2, len(far))), np.empty((2, len(far)))
        offset = np.zeros(len(far))
        for i in (0, 1):
            way = far * (right[i] * x + up[i] * y + forward[i] * eye.focal)
            place[i] = eye.position[i] + way
            step[i] = np.abs(far * (right[i] - way / (height - eye.position[2]) * right[2]))
            step[i] += np.abs(far * (up[i] - way / (height - eye.position[2]) * up[2]))
            offset += ((place[i] - self.target[i]) / (_REACH * self.distance)) ** 2
        fade = np.clip(1 - np.sqrt(offset), 0, None) ** 2
        cell = round_length(0.8 * self.distance / _CELLS)
        line = np.maximum(0.55 * _lines(place, step, cell), _lines(place, step, 5 * cell))
        _mix(colour, _GREY, (row, column), fade * (0.06 + 0.5 * line))
        if bodies:
            shade = self._shade(eye, bodies, buffer.depth)
            at = np.nonzero(shade)
            _mix(colour, 0.0, at, 1 - (1 - _SHADOW) ** shade[at])

    @property
    def _lift(self) -> float:
        return _LIFT * self.distance

    def _shade(self, eye: raster.Eye, bodies: Sequence[Surface], depth: Array) -> Array:
        """Return the part of the light that does not reach each sample."""
        joined_surface = join_surfaces(bodies)
        height = self.height + self._lift
        elevation = joined_surface.vertices[:, 2:] - height
        shade = np.zeros_like(depth)
        for i in range(_POINTS):
            angle, radius = _GOLDEN * i, _WIDTH * np.sqrt((i + 0.5) / _POINTS)
            slope = radius * np.array((np.cos(angle), np.sin(angle))) + LAMP[:2]
            flat = joined_surface.vertices[:, :2] - elevation * slope / LAMP[2]
            vertices = np.column_stack((flat, np.full(len(flat), height)))
            with np.errstate(over="ignore", invalid="ignore"):
                in_view = raster.rotate(vertices - eye.position, eye.axes)
            shadow = np.full_like(depth, np.inf)
            fragments = raster.fragments(eye, in_view, joined_surface.faces, front=False)
            for triangles, indices, shares, x, y in fragments:
                weights = shares / triangles[:, :, 2][indices]
                depths = 1.0 / (weights[:, 0] + weights[:, 1] + weights[:, 2])
                np.minimum.at(shadow, (y, x), depths)
            shade += shadow < depth * (1 + _DEPTH_TOLERANCE)
        return shade / _POINTS


def draw_edges(colour: Array, buffer: raster.GBuffer, bodies: NDArray[np.bool_]) -> None:
    """Draw lines around bodies, on what is behind them; `bodies` says which solids are bodies."""
    edge = np.zeros(buffer.solid.shape, bool)
    body = np.where(buffer.solid >= 0, bodies[buffer.solid], False)
    reach = range(-_EDGE_SAMPLES, _EDGE_SAMPLES + 1)
    for dy, dx in ((dy, dx) for dy in reach for dx in reach if dx * dx + dy * dy <= 4):
        is_body = np.roll(body, (dy, dx), axis=(0, 1))
        differs = np.roll(buffer.solid, (dy, dx), axis=(0, 1)) != buffer.solid
        is_nearer = np.roll(buffer.depth, (dy, dx), axis=(0, 1)) < buffer.depth
        edge |= is_body & differs & is_nearer
    at = np.nonzero(edge)
    _mix(colour, _EDGE_GREY, at, np.ones(len(at[0])))


def round_length(length: float) -> float:
    """Round a length down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * next(n for n in (5, 2, 1) if n * power <= length))


def _lines(places: Array, steps: Array, cell: float) -> Array:
    """Return how strong the lines of a grid are at places (2, n), with steps to the next."""
    strength = np.zeros(places.shape[1])
    for place, step in zip(places / cell, np.maximum(steps / cell, 1e-6), strict=True):
        distance = np.abs((place - 0.5) % 1 - 0.5) / step
        line = np.clip(1 - distance, 0, 1) * np.clip(0.5 / step - 0.5, 0, 1)
        strength = np.maximum(strength, line)
    return strength


def _mix(colour: Array, grey: float, at: Samples, alpha: Array) -> None:
    """Mix a grey into colours (rows, columns, RGB and alpha) at some rows and columns."""
    cover = alpha[:, None]
    colour[at] = cover * np.array((grey, grey, grey, 1.0)) + (1 - cover) * colour[at]
