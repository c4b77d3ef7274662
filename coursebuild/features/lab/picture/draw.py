"""A picture of a scene, drawn without a graphics processor.

Entry point: `draw(solids, camera, size, light)` → pixels.

1. Every solid's triangles are taken into the camera's frame (MuJoCo's free camera) and projected
   (`raster.py`). Of each sample the nearest surface is kept, and what of it is there: place,
   normal, texture coordinates. There are 2 × 2 samples a pixel.
2. What is there is coloured by its texture and the light (`light.py`), and the first shiny plane or
   box shows what its mirror image of the camera sees.
3. What is seen through is mixed in afterwards, the farthest first, and the sky is put behind all.

The same input gives the same bytes: no clock, no threads, colours rounded at the end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from coursebuild.features.lab.picture.light import Light, Material, shaded, studio
from coursebuild.features.lab.picture.raster import NORMAL, POSITION, UV, Eye, GBuffer, rotate
from coursebuild.features.lab.picture.shapes import Array, Surface
from coursebuild.features.lab.picture.studio import Floor, edges
from coursebuild.features.lab.picture.textures import Texture, TextureMapping, sharpness, sky

_SAMPLES = 2
_NEAR = 0.01
"""What is nearer to the camera than this part of its distance is not drawn."""
_OPAQUE, _CLEAR = 0.999, 0.001
_FROM_BELOW = 0.5
"""What is left of a plane that is seen from below, as in MuJoCo."""
_TOP = 0.5
_AT_ONCE = 1 << 16
"""Samples that are coloured together."""
_STEPS = 127
"""From black to white: no eye tells more apart, and the file is a quarter smaller."""
_PLAIN = Material()

Samples = tuple[NDArray[np.int64], NDArray[np.int64]]
"""Rows and columns."""


class Solid(Struct, frozen=True):
    """A surface, where it stands and its looks."""

    surface: Surface
    position: Array
    """(3,), m, world."""
    rotation: Array
    """(3, 3); columns are the solid's axes in the world."""
    rgba: tuple[float, float, float, float]
    material: Material = _PLAIN
    texture: TextureMapping | None = None
    plane: bool = False
    """Whether it has an upper side, by which it is lit."""
    mirror: float | None = None
    """Where its upper face is along its z axis, m, if that can reflect."""
    open: bool = False
    """Whether both of its sides are outside."""
    body: bool = False
    """Whether it is a thing with an edge and a shadow."""
    front: bool = False
    """Whether nothing covers it."""

    def placed(self) -> Surface:
        """Its surface in the world."""
        vertices = rotate(self.surface.vertices, self.rotation) + self.position
        return replace(self.surface, vertices=vertices, uv=None)

    @property
    def opaque(self) -> bool:
        """Whether nothing is seen through it."""
        return self.rgba[3] >= _OPAQUE


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
        """(3,), of length 1: where it looks."""
        a, e = np.radians(self.azimuth), np.radians(self.elevation)
        return np.array((np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)))

    def eye(self, width: int, height: int) -> Eye:
        """It with a screen of so many samples."""
        azimuth = np.radians(self.azimuth)
        right = np.array((np.sin(azimuth), -np.cos(azimuth), 0.0))
        axes = np.stack((right, np.cross(right, self.forward), self.forward))
        focal = height / 2 / np.tan(np.radians(self.fovy) / 2)
        near = max(_NEAR * self.distance, 1e-6)
        position = np.array(self.target) - self.distance * self.forward
        return Eye((width, height), focal, near, position, axes)


def draw(
    solids: Sequence[Solid],
    camera: FreeCamera,
    size: tuple[int, int],
    light: Light | None = None,
    background: Texture | None = None,
    floor: Floor | None = None,
) -> NDArray[np.uint8]:
    """The picture: (height, width, 4) bytes, RGBA, clear where there is nothing.

    `size` is (width, height) in pixels; without a light it is that of a model without lights;
    `background` is the texture of a sky.
    """
    width, height = size
    light = studio(camera.forward) if light is None else light
    canvas = _Canvas(camera.eye(width * _SAMPLES, height * _SAMPLES), light)
    # A simulation that blew up throws things out of the world.
    there = (s for s in solids if s.rgba[3] > _CLEAR and np.isfinite(s.position).all())
    shown = [_seen_from(solid, canvas.eye) for solid in there]
    mirror = next((solid for solid in shown if _reflects(solid, canvas.eye)), None)
    reflected = None
    if mirror is not None:
        reflected = _Canvas(_mirrored(mirror, camera.eye(width, height)), light)
        reflected.paint([solid for solid in shown if solid is not mirror], None, None)
    canvas.paint(shown, mirror, reflected, floor, lines=True)
    if background is not None:
        canvas.put_behind(background)
    mean = canvas.colour.reshape(height, _SAMPLES, width, _SAMPLES, 4).mean(axis=(1, 3))
    # Colours were weighted with how much they cover.
    mean[..., :3] /= np.where(mean[..., 3:] > 0, mean[..., 3:], 1.0)
    steps = np.rint(_STEPS * np.clip(mean, 0.0, 1.0))
    pixels: NDArray[np.uint8] = np.rint(255 / _STEPS * steps).astype(np.uint8)
    return pixels


def _seen_from(solid: Solid, eye: Eye) -> Solid:
    """The solid as it shows itself to an eye."""
    if not solid.plane or solid.rotation[:, 2] @ (eye.position - solid.position) >= 0:
        return solid
    red, green, blue, alpha = solid.rgba
    return replace(solid, rgba=(red, green, blue, alpha * _FROM_BELOW))


def _reflects(solid: Solid, eye: Eye) -> bool:
    """Whether an eye sees a mirror image in the upper face of a solid."""
    if solid.mirror is None or solid.material.reflectance <= 0 or not solid.opaque:
        return False
    return bool(solid.rotation[:, 2] @ (eye.position - solid.position) > solid.mirror)


def _mirrored(solid: Solid, eye: Eye) -> Eye:
    """The image of an eye in the upper face of a solid."""
    normal = solid.rotation[:, 2]
    offset = float(normal @ solid.position) + (solid.mirror or 0.0)
    height = float(normal @ eye.position) - offset
    axes = rotate(eye.axes, np.eye(3) - 2 * np.outer(normal, normal))
    position = eye.position - 2 * height * normal
    return replace(eye, position=position, axes=axes, mirror=(normal, offset))


class _Canvas:
    """Colours of the samples."""

    def __init__(self, eye: Eye, light: Light) -> None:
        self.eye, self.light = eye, light
        self.colour = np.zeros((eye.size[1], eye.size[0], 4))
        """RGB times how much is covered, and how much is covered."""

    def paint(
        self,
        solids: Sequence[Solid],
        mirror: Solid | None,
        reflected: _Canvas | None,
        floor: Floor | None = None,
        *,
        lines: bool = False,
    ) -> None:
        """Draw solids, with lines around them; `mirror` shows what is in `reflected`."""
        buffer = GBuffer(self.eye)
        opaque = [solid for solid in solids if solid.opaque and not solid.front]
        self._paint_opaque(buffer, opaque, mirror, reflected)
        if lines and opaque:
            edges(self.colour, buffer, np.array([solid.body for solid in opaque], dtype=bool))
        if floor is not None:
            floor.paint(self.colour, buffer, [solid.placed() for solid in solids if solid.body])
        for solid in sorted((s for s in solids if not s.opaque), key=self._depth, reverse=True):
            film = GBuffer(self.eye)
            film.depth = buffer.depth.copy()
            # Only the outside is drawn, as in the live view.
            front = not (solid.open or solid.plane)
            film.add(0, solid.surface, solid.position, solid.rotation, front=front)
            self._colour(film, 0, solid, None)
        foremost = [solid for solid in solids if solid.opaque and solid.front]
        if foremost:
            self._paint_opaque(GBuffer(self.eye), foremost, None, None)

    def _paint_opaque(
        self,
        buffer: GBuffer,
        solids: Sequence[Solid],
        mirror: Solid | None,
        reflected: _Canvas | None,
    ) -> None:
        for i, solid in enumerate(solids):
            buffer.add(i, solid.surface, solid.position, solid.rotation, front=False)
        for i, solid in enumerate(solids):
            self._colour(buffer, i, solid, reflected if solid is mirror else None)

    def put_behind(self, background: Texture) -> None:
        """Fill what is not covered with a sky."""
        width, height = self.eye.size
        for y, x in _in_parts(self.colour[..., 3] < 1):
            sight = np.column_stack(
                (x + 0.5 - width / 2, height / 2 - y - 0.5, np.full(len(x), self.eye.focal))
            )
            free = 1 - self.colour[y, x, 3:]
            self.colour[y, x, :3] += free * sky(background, rotate(sight, self.eye.axes.T))
            self.colour[y, x, 3] = 1

    def _depth(self, solid: Solid) -> float:
        return float(self.eye.axes[2] @ (solid.position - self.eye.position))

    def _colour(self, buffer: GBuffer, i: int, solid: Solid, reflected: _Canvas | None) -> None:
        """Mix a solid of a buffer into the picture."""
        alpha = 1.0 if solid.opaque else solid.rgba[3]
        for y, x in _in_parts(buffer.solid == i):
            colour = self._shade(buffer, solid, reflected, (y, x))
            mixed = np.column_stack((np.clip(colour, 0.0, 1.0), np.ones(len(y))))
            self.colour[y, x] = alpha * mixed + (1 - alpha) * self.colour[y, x]

    def _shade(
        self, buffer: GBuffer, solid: Solid, reflected: _Canvas | None, samples: Samples
    ) -> Array:
        """The colours of a solid at samples that show it."""
        attributes = buffer.attributes[samples].astype(float)
        places, own = attributes[:, POSITION], attributes[:, NORMAL]
        own = own / np.linalg.norm(own, axis=1).clip(1e-12)[:, None]
        points = rotate(places, solid.rotation) + solid.position
        normals = rotate(own, solid.rotation)
        view = self.eye.position - points
        toward = view / np.linalg.norm(view, axis=1).clip(1e-12)[:, None]
        facing = (normals * toward).sum(axis=1)
        if not solid.plane:
            normals[facing < 0] *= -1
        texel = np.ones((1, 3))
        if solid.texture is not None:
            steps = buffer.depth[samples] / self.eye.focal * sharpness(facing)
            texel = solid.texture.texels(places, own, attributes[:, UV], steps)
        base = np.array(solid.rgba[:3])
        colour = shaded(self.light, solid.material, base, texel, (points, normals, toward))
        if reflected is not None:
            y, x = samples
            image = reflected.colour[y // _SAMPLES, x // _SAMPLES, :3]
            colour += solid.material.reflectance * (own[:, 2:] > _TOP) * image
        return colour


def _in_parts(mask: NDArray[np.bool_]) -> Iterator[Samples]:
    """The samples of a mask, not too many at once."""
    rows, columns = np.nonzero(mask)
    for start in range(0, len(rows), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        yield rows[part], columns[part]
