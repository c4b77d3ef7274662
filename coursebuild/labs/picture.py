"""A picture of a scene, drawn without a graphics processor.

Entry point: `draw(solids, camera, size, light)` → pixels.

1. Every solid's triangles are taken into the camera's frame (MuJoCo's free camera) and projected.
2. A depth buffer keeps the nearest surface of each sample, and what of it is there: place, normal,
   texture coordinates. There are 2 × 2 samples a pixel.
3. What is there is coloured by its texture and the light (`light.py`), and the first shiny plane or
   box shows what its mirror image of the camera sees.
4. What is seen through is mixed in afterwards, the farthest first, and the sky is put behind all.

The same input gives the same bytes: no clock, no threads, colours rounded at the end.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from coursebuild.labs.light import Light, Material, shaded, studio
from coursebuild.labs.raster import NORMAL, PLACE, WRAP, Eye, Layer, Placed, Raster, turned
from coursebuild.labs.shapes import Array, Surface
from coursebuild.labs.textures import Dress, Texture, sharpness, sky

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


class Solid(Struct, frozen=True):
    """A surface, where it stands and its looks."""

    surface: Surface
    position: Array
    """(3,), m, world."""
    rotation: Array
    """(3, 3); columns are the solid's axes in the world."""
    rgba: tuple[float, float, float, float]
    material: Material = _PLAIN
    dress: Dress | None = None
    plane: bool = False
    """Whether it has an upper side, by which it is lit."""
    mirror: float | None = None
    """Where its upper face is along its z axis, m, if that can reflect."""
    open: bool = False
    """Whether both of its sides are outside."""


class Camera(Struct, frozen=True):
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

    @property
    def eye(self) -> Array:
        """(3,), m, world."""
        found: Array = np.array(self.target) - self.distance * self.forward
        return found


def draw(
    solids: Sequence[Solid],
    camera: Camera,
    size: tuple[int, int],
    light: Light | None = None,
    background: Texture | None = None,
) -> NDArray[np.uint8]:
    """The picture: (height, width, 4) bytes, RGBA, clear where there is nothing.

    `size` is (width, height) in pixels; without a light it is that of a model without lights;
    `background` is the texture of a sky.
    """
    light = studio(camera.forward) if light is None else light
    right = np.array((np.sin(np.radians(camera.azimuth)), -np.cos(np.radians(camera.azimuth)), 0.0))
    axes = np.stack((right, np.cross(right, camera.forward), camera.forward))
    eye = Eye(camera.eye, axes)
    lens = (camera.fovy, _NEAR * camera.distance)
    canvas = _Canvas((size[0] * _SAMPLES, size[1] * _SAMPLES), eye, lens, light)
    shown = [_seen_from(solid, eye) for solid in solids if solid.rgba[3] > _CLEAR]
    mirror = next((s for s in shown if _reflects(s)), None)
    reflected = None
    if mirror is not None and (image := _image(mirror, eye)) is not None:
        reflected = _Canvas(size, image, lens, light)
        reflected.paint([solid for solid in shown if solid is not mirror], None, None)
    canvas.paint(shown, mirror, reflected)
    if background is not None:
        canvas.put_behind(background)
    mean = canvas.colour.reshape(size[1], _SAMPLES, size[0], _SAMPLES, 4).mean(axis=(1, 3))
    # Colours were weighted with how much they cover.
    mean[..., :3] /= np.where(mean[..., 3:] > 0, mean[..., 3:], 1.0)
    steps = np.rint(_STEPS * np.clip(mean, 0.0, 1.0))
    pixels: NDArray[np.uint8] = np.rint(255 / _STEPS * steps).astype(np.uint8)
    return pixels


def _reflects(solid: Solid) -> bool:
    shiny = solid.material.reflectance > 0 and solid.mirror is not None
    return shiny and solid.rgba[3] >= _OPAQUE


def _seen_from(solid: Solid, eye: Eye) -> Solid:
    """The solid as it shows itself to an eye."""
    if not solid.plane or not np.isfinite(solid.position).all():
        return solid
    if solid.rotation[:, 2] @ (eye.position - solid.position) >= 0:
        return solid
    red, green, blue, alpha = solid.rgba
    return replace(solid, rgba=(red, green, blue, alpha * _FROM_BELOW))


def _image(solid: Solid, eye: Eye) -> Eye | None:
    """The image of an eye in the upper face of a solid; `None` if it is behind it."""
    normal = solid.rotation[:, 2]
    offset = float(normal @ solid.position) + (solid.mirror or 0.0)
    height = float(normal @ eye.position) - offset
    if not height > 0:
        return None
    axes = turned(eye.axes, np.eye(3) - 2 * np.outer(normal, normal))
    return Eye(eye.position - 2 * height * normal, axes, (normal, offset))


def _placed(index: int, solid: Solid) -> Placed:
    # Of what is seen through, only the outside is drawn, as in the live view.
    front = solid.rgba[3] < _OPAQUE and not (solid.open or solid.plane)
    return Placed(index, solid.surface, solid.position, solid.rotation, front)


class _Canvas:
    """Colours of the samples."""

    def __init__(
        self, size: tuple[int, int], eye: Eye, lens: tuple[float, float], light: Light
    ) -> None:
        self.raster = Raster(size, eye, lens)
        self.colour = np.zeros((size[1], size[0], 4))
        """RGB times how much is covered, and how much is covered."""
        self.eye, self.light = eye, light

    def paint(
        self, solids: Sequence[Solid], mirror: Solid | None, reflected: _Canvas | None
    ) -> None:
        """Draw solids; `mirror` shows what is in `reflected`."""
        layer = Layer(np.full(self.colour.shape[:2], np.inf))
        opaque = [solid for solid in solids if solid.rgba[3] >= _OPAQUE]
        through = [solid for solid in solids if solid.rgba[3] < _OPAQUE]
        for i, solid in enumerate(opaque):
            self.raster.add(layer, _placed(i, solid))
        for i, solid in enumerate(opaque):
            self._colour(layer, i, solid, reflected if solid is mirror else None)
        for solid in sorted(through, key=lambda s: -self._depth_of(s)):
            film = Layer(layer.depth.copy())
            self.raster.add(film, _placed(0, solid))
            self._colour(film, 0, solid, None)

    def put_behind(self, background: Texture) -> None:
        """Fill what is not covered with a sky."""
        free = np.flatnonzero(self.colour[..., 3] < 1)
        for start in range(0, len(free), _AT_ONCE):
            y, x = np.divmod(free[start : start + _AT_ONCE], self.raster.width)
            self._fill(background, y, x)

    def _fill(self, background: Texture, y: NDArray[np.int64], x: NDArray[np.int64]) -> None:
        height, width, _ = self.colour.shape
        sight = np.column_stack(
            (x + 0.5 - width / 2, height / 2 - y - 0.5, np.full(len(x), self.raster.focal))
        )
        free = 1 - self.colour[y, x, 3:]
        self.colour[y, x, :3] += free * sky(background, turned(sight, self.eye.axes.T))
        self.colour[y, x, 3] = 1

    def _depth_of(self, solid: Solid) -> float:
        depth = float(self.eye.axes[2] @ (solid.position - self.eye.position))
        return depth if np.isfinite(depth) else 0.0

    def _colour(self, layer: Layer, index: int, solid: Solid, reflected: _Canvas | None) -> None:
        """Mix a solid of a layer into the picture."""
        samples = np.flatnonzero(layer.solid == index)
        for start in range(0, len(samples), _AT_ONCE):
            y, x = np.divmod(samples[start : start + _AT_ONCE], self.raster.width)
            self._shade(layer, solid, reflected, (y, x))

    def _shade(
        self,
        layer: Layer,
        solid: Solid,
        reflected: _Canvas | None,
        samples: tuple[NDArray[np.int64], NDArray[np.int64]],
    ) -> None:
        """Mix a solid into some samples (rows, columns) that show it."""
        y, x = samples
        kept = layer.kept[y, x].astype(float)
        points = turned(kept[:, PLACE], solid.rotation) + solid.position
        own = kept[:, NORMAL] / np.linalg.norm(kept[:, NORMAL], axis=1).clip(1e-12)[:, None]
        normals = turned(own, solid.rotation)
        view = self.eye.position - points
        toward = view / np.linalg.norm(view, axis=1).clip(1e-12)[:, None]
        facing = (normals * toward).sum(axis=1)
        if not solid.plane:
            normals[facing < 0] *= -1
        texel = np.ones((1, 3))
        if solid.dress is not None:
            steps = layer.depth[y, x] / self.raster.focal * sharpness(facing)
            texel = solid.dress.texels(kept[:, PLACE], own, kept[:, WRAP], steps)
        where = points, normals, toward
        colour = shaded(self.light, solid.material, np.array(solid.rgba[:3]), texel, where)
        if reflected is not None:
            shown = reflected.colour[y // _SAMPLES, x // _SAMPLES, :3]
            colour += solid.material.reflectance * (own[:, 2:] > _TOP) * shown
        # What a solid is seen through is its own transparency; a sample lies in it or not.
        alpha = min(solid.rgba[3], 1.0) if solid.rgba[3] < _OPAQUE else 1.0
        mixed = np.column_stack((np.clip(colour, 0.0, 1.0), np.ones(len(y))))
        self.colour[y, x] = alpha * mixed + (1 - alpha) * self.colour[y, x]
