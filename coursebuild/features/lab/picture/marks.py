"""What a picture shows beside a model's things: springs as coils, the pins of hinges.

Entry points: `coil(a, b, radius)`, `pin(position, axis, distance)`. They are those of the live view
(`marks.js` of the page).
"""

from __future__ import annotations

import numpy as np

from coursebuild.features.lab.picture.draw import Solid
from coursebuild.features.lab.picture.shapes import Array, ropes, unit

_TURNS, _ROUND, _STRAIGHT, _WIRE = 9, 14, 0.08, 0.16
_STEEL, _IRON = (0.56, 0.58, 0.62, 1.0), (0.4, 0.41, 0.44, 1.0)
_PIN = 0.011


def coil(a: Array, b: Array, radius: float) -> Solid:
    """A spring between two points."""
    z = unit(b - a)
    x = unit(np.array((-z[1], z[0], 0.0)) if abs(z[2]) < 0.9 else np.array((0.0, -z[2], z[1])))
    t = np.linspace(0.0, 1.0, _TURNS * _ROUND + 1)[:, None]
    wide = radius * np.clip((np.minimum(t, 1 - t) - _STRAIGHT) / _STRAIGHT, 0.0, 1.0)
    angle = 2 * np.pi * _TURNS * t
    points = a + t * (b - a) + wide * (np.cos(angle) * x + np.sin(angle) * np.cross(z, x))
    steps = np.arange(len(points))
    ends = np.column_stack((steps[:-1], steps[1:]))
    return Solid(ropes(points, ends, _WIRE * radius), np.zeros(3), np.eye(3), _STEEL)


def pin(position: Array, axis: Array, distance: float) -> Solid:
    """The pin of a hinge, for a camera at a distance."""
    half = 2.2 * _PIN * distance * axis
    surface = ropes(
        np.stack((position - half, position + half)), np.array([[0, 1]]), _PIN * distance
    )
    return Solid(surface, np.zeros(3), np.eye(3), _IRON)
