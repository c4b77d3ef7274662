"""The marks of points and the dashes of lines: what tells lines apart besides their colour.

Entry points: `mark`, `dash`, `colour`, `cross`.
"""

from __future__ import annotations

import math

_DASHES = ("", "7 3", "2 3", "10 3 2 3", "1 4", "5 2 1 2 1 2", "12 4")
_LIGHT = ("#0072b2", "#b34d00", "#00795a", "#a8467f", "#7a6a00", "#2b6f9e", "#1e1e1c")
"""Okabe and Ito's, darker on paper."""
_CORNERS = (0, 4, 4, 3, 3, 5, 6)
_TURNED = (0.0, 45.0, 0.0, -90.0, 90.0, -90.0, 0.0)


def colour(number: int) -> str:
    """The colour of a line; the page may have its own."""
    n = number % len(_LIGHT)
    return f"var(--trace-{n + 1}, {_LIGHT[n]})"


def dash(number: int) -> str:
    """The dashes of a line; empty where it is drawn through."""
    return _DASHES[number % len(_DASHES)]


def mark(number: int, x: float, y: float, size: float) -> str:
    """The path of a mark: circle, square, diamond, triangles up and down, pentagon, hexagon.

    All of about the same area; `size` is the radius of the circle.
    """
    n = number % len(_CORNERS)
    corners = _CORNERS[n]
    if not corners:
        r = f"{size:g} {size:g} 0 1 0"
        return f"M{x - size:.1f} {y:.1f}a{r} {2 * size:g} 0a{r} {-2 * size:g} 0Z"
    radius = size * math.sqrt(2 * math.pi / (corners * math.sin(2 * math.pi / corners)))
    places = []
    for k in range(corners):
        angle = math.radians(_TURNED[n] + 360 * k / corners)
        places.append(f"{x + radius * math.cos(angle):.1f} {y + radius * math.sin(angle):.1f}")
    return "M" + "L".join(places) + "Z"


def cross(x: float, y: float, size: float) -> str:
    """The path of a cross."""
    s = size
    return f"M{x - s:.1f} {y - s:.1f}l{2 * s:g} {2 * s:g}m0 {-2 * s:g}l{-2 * s:g} {2 * s:g}"
