"""The surroundings of a model in a picture: a floor with a grid and shadows, lines around bodies.

Entry points: `Floor.paint`, `draw_edges`. They match the live view (`studio.js` of the page).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from coursebuild.features.lab.picture.light import LAMP
from coursebuild.features.lab.picture.raster import Eye, GBuffer, nearest_depth, rotate
from coursebuild.features.lab.picture.shapes import Array, Surface, join_surfaces

_CELLS, _REACH, _LIFT = 10, 2.2, 0.0005
_GREY, _EDGE_GREY = 0.5, 0.42
_SHADOW, _POINTS, _WIDTH = 0.32, 10, 0.08
_GOLDEN = np.pi * (3 - np.sqrt(5))
"""Points at multiples of this angle lie evenly on a disc."""
_EDGE_SAMPLES = 2
_DEPTH_TOLERANCE = 1e-3


class Floor(Struct, frozen=True):
    """A level floor."""

    height: float
    """m."""
    distance: float
    """Distance of the camera from its target, m."""
    target: tuple[float, float, float]

    def paint(self, colour: Array, buffer: GBuffer, bodies: Sequence[Surface]) -> None:
        """Mix it into colours (rows, columns, RGB and alpha) where nothing covers it."""
        eye, height = buffer.eye, self.height + self._lift / 2
        width, rows = eye.size
        x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, rows / 2 - np.arange(rows) - 0.5)
        sight = np.column_stack((x.ravel(), y.ravel(), np.full(x.size, eye.focal)))
        rays = rotate(sight, eye.axes.T).reshape(rows, width, 3)
        with np.errstate(divide="ignore", invalid="ignore"):
            far = (height - eye.position[2]) / rays[..., 2]
            place = eye.position[:2] + far[..., None] * rays[..., :2]
        depth = far * eye.focal
        visible = (
            (far > 0)
            & (depth < buffer.depth * (1 + _DEPTH_TOLERANCE))
            & np.isfinite(place).all(axis=2)
        )
        place = np.where(visible[..., None], place, 0.0)
        offset = np.linalg.norm((place - self.target[:2]) / (_REACH * self.distance), axis=2)
        fade = np.clip(1 - offset, 0, None) ** 2
        cell = round_length(0.8 * self.distance / _CELLS)
        line = np.maximum(0.55 * _lines(place / cell), _lines(place / (5 * cell)))
        _mix(colour, _GREY, visible * fade * (0.06 + 0.5 * line))
        if bodies:
            _mix(colour, 0.0, 1 - (1 - _SHADOW) ** self._shade(eye, bodies, buffer.depth))

    @property
    def _lift(self) -> float:
        return _LIFT * self.distance

    def _shade(self, eye: Eye, bodies: Sequence[Surface], depth: Array) -> Array:
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
            shadow = nearest_depth(eye, vertices, joined_surface.faces)
            shade += shadow < depth * (1 + _DEPTH_TOLERANCE)
        return shade / _POINTS


def draw_edges(colour: Array, buffer: GBuffer, bodies: NDArray[np.bool_]) -> None:
    """Draw lines around bodies, on what is behind them; `bodies` says which solids are bodies."""
    edge = np.zeros(buffer.solid.shape, bool)
    body = np.where(buffer.solid >= 0, bodies[buffer.solid], False)
    reach = range(-_EDGE_SAMPLES, _EDGE_SAMPLES + 1)
    for dy, dx in ((dy, dx) for dy in reach for dx in reach if dx * dx + dy * dy <= 4):
        is_body = np.roll(body, (dy, dx), axis=(0, 1))
        differs = np.roll(buffer.solid, (dy, dx), axis=(0, 1)) != buffer.solid
        is_nearer = np.roll(buffer.depth, (dy, dx), axis=(0, 1)) < buffer.depth
        edge |= is_body & differs & is_nearer
    _mix(colour, _EDGE_GREY, edge.astype(float))


def round_length(length: float) -> float:
    """Round a length down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * next(n for n in (5, 2, 1) if n * power <= length))


def _lines(place: Array) -> Array:
    """Return how strong the lines of a grid of cell size 1 are at places (rows, columns, 2)."""
    width = sum(np.abs(np.gradient(place, axis=axis)) for axis in (0, 1))
    width = np.maximum(width, 1e-6)
    distance = np.abs((place - 0.5) % 1 - 0.5) / width
    line = np.clip(1 - distance, 0, 1) * np.clip(0.5 / width - 0.5, 0, 1)
    strength: Array = line.max(axis=2)
    return strength


def _mix(colour: Array, grey: float, alpha: Array) -> None:
    """Lay a grey over premultiplied colours."""
    cover = alpha[..., None]
    colour[:] = cover * np.array((grey, grey, grey, 1.0)) + (1 - cover) * colour
