"""Bodies and curves in space, drawn on paper, for the figures of several lessons.

Entry points: `View`, the camera; `draw_curve`, `draw_box` and `draw_arrow`.
"""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


class View:
    """A camera far away, by the direction in which it stands: from x towards y, and upwards."""

    def __init__(self, azimuth: float, elevation: float) -> None:
        """Make its frame C from two angles in degrees."""
        a, e = np.radians((azimuth, elevation))
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        towards_us = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
        self.r_wc = np.column_stack((right, np.cross(towards_us, right), towards_us))

    def components(self, points: ArrayLike) -> Array:
        """Points of the world in C: to the right, upwards, and towards us."""
        return np.asarray(points) @ self.r_wc  # the transpose of r_cw times each point


def set_stage(ax: Axes, reach: float) -> None:
    """Prepare axes for a drawing in space around the origin: one scale, and no frame."""
    ax.set(aspect="equal", xlim=(-reach, reach), ylim=(-reach, reach))
    ax.axis("off")


def draw_curve(ax: Axes, view: View, points: ArrayLike, color: str, width: float = 1.4) -> None:
    """Draw a curve on a ball about the origin; behind the ball it is faint."""
    x, y, depth = view.components(points).T
    for hidden, alpha in ((depth < 0, 0.25), (depth >= 0, 1.0)):
        visible = [np.where(hidden, values, np.nan) for values in (x, y)]
        ax.plot(*visible, color=color, linewidth=width, alpha=alpha, solid_capstyle="round")


def draw_box(
    ax: Axes, view: View, centre: ArrayLike, axes: Array, half: ArrayLike, color: str
) -> None:
    """Draw the faces of a box that are towards us: the more they face us, the lighter.

    The columns of `axes` are those of the box, `half` its half-sizes along them.
    """
    edges = axes * np.asarray(half)  # columns, from the centre to the middles of faces
    for k in range(3):
        outwards = np.sign(view.components(axes[:, k])[2]) or 1.0
        lightness = abs(view.components(axes[:, k])[2])
        u, v = edges[:, k - 2], edges[:, k - 1]
        middle = np.asarray(centre) + outwards * edges[:, k]
        corners = view.components([middle + u + v, middle + u - v, middle - u - v, middle - u + v])
        shade = (color, 0.55 - 0.4 * lightness)
        ax.fill(*corners[:, :2].T, facecolor=shade, edgecolor=color, linewidth=1.0)


def draw_arrow(
    ax: Axes, view: View, start: ArrayLike, end: ArrayLike, color: str, label: str = ""
) -> None:
    """Draw an arrow, with a label beyond its tip."""
    (x0, y0, _), (x1, y1, _) = view.components([start, end])
    style = {"arrowstyle": "-|>", "color": color, "shrinkA": 0, "shrinkB": 0, "linewidth": 1.6}
    ax.annotate("", (x1, y1), (x0, y0), arrowprops=style)
    if label:
        label_place = np.array([x1, y1]) + 0.3 * np.array([x1 - x0, y1 - y0])
        ax.text(*label_place, label, color=color, ha="center", va="center")
