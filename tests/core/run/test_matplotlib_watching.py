"""What a figure of Matplotlib draws, without layout and fonts, and how two figures differ in it."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from typing import Any

import matplotlib as mpl
import msgspec
import numpy as np
import pytest
from matplotlib.figure import Figure

from coursebuild.core.run.matplotlib_watching import describe_figure
from coursebuild.core.scripts.figure_data import FigureData, describe_data_difference

T = np.linspace(0.1, 4, 50)
GRID = np.meshgrid(T, T)
Draw = Callable[[Figure], Any]


def data_of(draw: Draw, **settings: Any) -> FigureData:
    """The data of a figure as its file holds them, after it was laid out and drawn."""
    with mpl.rc_context({"figure.autolayout": False, **settings}):
        figure = Figure()
        draw(figure)
        figure.savefig(io.BytesIO(), format="svg")
        text = json.dumps(describe_figure(figure))
    return msgspec.json.decode(text, type=FigureData)


def difference(old: Draw, new: Draw) -> str:
    return describe_data_difference(data_of(old), data_of(new))


def curve(values: Any = T**2, **options: Any) -> Draw:
    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.plot(T, T, label="straight")
        axes.plot(T[: len(values)], values, **{"label": "exact", **options})
        axes.set_xlim(0, 5)
        axes.set_ylim(-5, 20)
        axes.legend()

    return draw


def with_change(index: int, step: float) -> Any:
    values = T**2
    values[index] += step
    return values


def scaled(scale: str, step: float = 0.0) -> Draw:
    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.plot(T, with_change(9, step))
        axes.set_yscale(scale)
        axes.set_ylim(0.01, 100)

    return draw


def one_axes(act: Callable[[Any], Any], **options: Any) -> Draw:
    return lambda figure: act(figure.subplots(**options))


CHANGES: dict[str, tuple[Draw, Draw]] = {
    "the curve “exact” has its point 31 of 50 at (2.488, 6.289) where (2.488, 6.189) is recorded": (
        curve(),
        curve(with_change(30, 0.1)),
    ),
    "the curve “exact” has its point 6 of 50 at (0.498, 0.748) where (0.498, 0.248) is recorded, "
    "and 1 more points moved": (curve(), curve(with_change([5, 9], [0.5, 0.2]))),
    "the curve “exact” has 50 points where 49 are recorded": (
        curve(T[:49]),
        curve(T),
    ),
    "the curve 1 has its point 10 of 50 at (0.8163, 0.8664) where (0.8163, 0.6663) is recorded": (
        scaled("log"),
        scaled("log", 0.2),
    ),
    "the curve “exact” has the color #ff0000ff where #000000ff is recorded": (
        curve(color="k"),
        curve(color="r"),
    ),
    "what is drawn: “straight, Euler” where “straight, exact” is recorded; "
    "the legend: “straight, Euler” where “straight, exact” is recorded": (
        curve(),
        curve(label="Euler"),
    ),
    "what is drawn: “b, a” where “a, b” is recorded": (
        one_axes(lambda axes: [axes.plot(T, T, label=name) for name in "ab"]),
        one_axes(lambda axes: [axes.plot(T, T, label=name) for name in "ba"]),
    ),
    "the shape 2 has its point 3 of 5 at (1.4, 3) where (1.4, 2) is recorded, "
    "and 1 more points moved": (
        one_axes(lambda axes: (axes.bar(["x", "y"], [1, 2]), axes.set_ylim(0, 4))),
        one_axes(lambda axes: (axes.bar(["x", "y"], [1, 3]), axes.set_ylim(0, 4))),
    ),
    "the ticks: “x, z” where “x, y” is recorded": (
        one_axes(lambda axes: axes.bar(["x", "y"], [1, 2])),
        one_axes(lambda axes: axes.bar(["x", "z"], [1, 2])),
    ),
    "the image 1 has the value 3 at row 2, column 1 where 2 is recorded": (
        one_axes(lambda axes: axes.imshow([[0, 1], [2, 9]])),
        one_axes(lambda axes: axes.imshow([[0, 1], [3, 9]])),
    ),
    "the image 1 has the colours #000000ff, #404040ff, #808080ff, #c0c0c0ff, #ffffffff "
    "where #ffffffff, #bfbfbfff, #7f7f7fff, #3f3f3fff, #000000ff is recorded": (
        one_axes(lambda axes: axes.imshow([[0, 1]], cmap="gray_r")),
        one_axes(lambda axes: axes.imshow([[0, 1]], cmap="gray")),
    ),
    "the collection 1 has its point 2 of 3 at (1, 2.5) where (1, 2) is recorded": (
        one_axes(lambda axes: axes.scatter([0, 1, 2], [0, 2, 4])),
        one_axes(lambda axes: axes.scatter([0, 1, 2], [0, 2.5, 4])),
    ),
    "the text 1 says “high” where “low” is recorded": (
        one_axes(lambda axes: axes.text(0.5, 0.5, "low")),
        one_axes(lambda axes: axes.text(0.5, 0.5, "high")),
    ),
    "the labels of the axes: “t / ms” where “t / s” is recorded": (
        one_axes(lambda axes: axes.set_xlabel("t / s")),
        one_axes(lambda axes: axes.set_xlabel("t / ms")),
    ),
    "the y axis goes from 0 to 2, not from 0 to 1": (
        one_axes(lambda axes: axes.set_ylim(0, 1)),
        one_axes(lambda axes: axes.set_ylim(0, 2)),
    ),
    "an axis runs the other way": (
        one_axes(lambda axes: axes.set_ylim(0, 1)),
        one_axes(lambda axes: (axes.set_ylim(0, 1), axes.invert_yaxis())),
    ),
    "it has 2 axes where 1 are recorded": (
        lambda figure: figure.subplots(),
        lambda figure: figure.subplots(2),
    ),
}


def test_what_differs_is_named_with_its_curve_and_place() -> None:
    wordings = {wording: difference(*figures) for wording, figures in CHANGES.items()}
    assert wordings == {wording: wording for wording in CHANGES}


def panels(figure: Figure) -> None:
    first, second = figure.subplots(1, 2)
    first.plot(T, T**2, "o-", label="exact")
    first.fill_between(T, T, T**2, alpha=0.3)
    first.errorbar(T[::9], T[::9], yerr=0.2)
    first.annotate("here", (1, 1), xytext=(20, 20), textcoords="offset points", arrowprops={})
    first.set_title("falls")
    first.legend(loc="best")
    second.loglog(T, np.where(T > 2, np.nan, T))
    second.text(0.5, 0.5, "middle", transform=second.transAxes)
    figure.suptitle("Two")


def fields(figure: Figure) -> None:
    axes, image = figure.subplots(1, 2)
    axes.clabel(axes.contour(*GRID, GRID[0] * GRID[1]))
    axes.quiver(T[::9], T[::9], T[::9], -T[::9])
    figure.colorbar(image.pcolormesh(T, T, GRID[0]))
    image.hist(np.sin(T))


def projections(figure: Figure) -> None:
    space = figure.add_subplot(121, projection="3d")
    space.plot_surface(*(part[:9, :9] for part in (*GRID, GRID[0])))
    figure.add_subplot(122, projection="polar").plot(T, T)


LAYOUTS = (
    {"figure.constrained_layout.use": True, "font.size": 14},
    {"font.family": "serif", "axes.titlepad": 20, "figure.subplot.left": 0.3},
)


@pytest.mark.parametrize("draw", [panels, fields, projections])
def test_layout_and_fonts_do_not_count(draw: Draw) -> None:
    base = data_of(draw)
    differences = [describe_data_difference(base, data_of(draw, **layout)) for layout in LAYOUTS]
    assert differences == [""] * len(LAYOUTS)


def test_data_that_cannot_be_seen_do_not_count() -> None:
    assert difference(curve(), curve(with_change(30, 0.001))) == ""


def test_fonts_of_a_figure_are_known() -> None:
    plain, serif = data_of(panels), data_of(panels, **{"font.family": "serif"})
    assert plain.fonts != serif.fonts and all(name.endswith(".ttf") for name in plain.fonts)
