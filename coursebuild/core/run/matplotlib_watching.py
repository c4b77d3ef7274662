"""Put into a figure, as Matplotlib saves it, what it draws: the data, apart from layout and fonts.

Each artist of each axes is drawn once more, by a renderer that only notes the places that it is
given. They are kept in the coordinates of the axes' scales, so that neither the size of the axes
nor their place in the figure matters. What Matplotlib places by the size of texts (a legend, a
title, ticks that it chooses, boxes) counts with its words alone.

An SVG holds the data in an element `metadata`, a PNG in a chunk of text. They are read and compared
by `core.scripts.figure_data`. A figure that another tool saves, or that the script writes itself,
holds none.
"""

from __future__ import annotations

import builtins
import contextlib
import json
import math
import os
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from html import escape
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any

_MODULE = "matplotlib.backend_bases"
MOST_DATA = 1 << 20
"""The most bytes of data that a figure holds; one with more is compared as it is drawn."""
_SHADES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""The places in a colour map whose colours are kept."""
_DIGITS = 4
"""The decimal places that are kept of a place, as a part of its axis."""


class FigureWatch:
    """Finds Matplotlib's module of canvases, and lets what is saved by them hold its data."""

    def __init__(self, paths: Mapping[str, str]) -> None:
        """`paths` are those under which a script saves figures, with the files that it writes."""
        self._paths = paths
        self._open = builtins.open
        self._load: Callable[[ModuleType], None] | None = None

    def find_spec(
        self, name: str, path: Any = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The spec of that module, whose loader also wraps the method that saves."""
        spec = PathFinder.find_spec(name, path, target) if name == _MODULE else None
        if spec is None or spec.loader is None:
            return None
        load = spec.loader.exec_module

        def load_and_wrap(module: ModuleType) -> None:
            load(module)
            self._wrap(module.FigureCanvasBase)

        spec.loader.exec_module = load_and_wrap  # type: ignore[method-assign]
        return spec

    def _wrap(self, canvas: Any) -> None:
        save = canvas.print_figure

        def print_figure(self_: Any, filename: Any, *args: Any, **keywords: Any) -> Any:
            result = save(self_, filename, *args, **keywords)
            with contextlib.suppress(Exception):  # the script's own figure is saved
                path = self._paths.get(os.path.abspath(filename))  # noqa: PTH100
                if path is not None:
                    self._add_data(path, self_.figure)
            return result

        canvas.print_figure = print_figure

    def _add_data(self, path: str, figure: Any) -> None:
        data = json.dumps(describe_figure(figure), separators=(",", ":"), ensure_ascii=False)
        if len(data) > MOST_DATA:
            return
        with self._open(path, "rb") as file:
            old = file.read()
        if path.endswith(".svg"):
            start, end, rest = old.rpartition(b"</svg>")
            new = b'<metadata class="drawn">' + escape(data, quote=False).encode() + b"</metadata>"
            new = start + new + end + rest
        else:
            start, end, rest = old.rpartition(struct.pack(">I", 0) + b"IEND")
            chunk = b"zTXtdrawn\0\0" + zlib.compress(data.encode())
            length, check = struct.pack(">I", len(chunk) - 4), struct.pack(">I", zlib.crc32(chunk))
            new = start + length + chunk + check + end + rest
        with self._open(path, "wb") as file:
            file.write(new)


# --- figures and axes


def describe_figure(figure: Any) -> dict[str, Any]:
    """What a figure draws, as JSON holds it; see `core.scripts.figure_data.FigureData`."""
    from matplotlib.font_manager import findfont
    from matplotlib.text import Text

    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
    fonts = {os.path.basename(findfont(text.get_fontproperties())) for text in texts}  # noqa: PTH119
    own_texts = [text for text in figure.get_children() if isinstance(text, Text)]
    return {
        "size": [round(float(length), 3) for length in figure.get_size_inches()],
        "fonts": sorted(fonts),
        "texts": [text.get_text() for text in own_texts if text.get_text()],
        "legends": [_legend_words(legend) for legend in figure.legends],
        "axes": [_Axes(axes).describe() for axes in _all_axes(figure.axes)],
    }


def _all_axes(axes: list[Any]) -> Iterator[Any]:
    for item in axes:
        if item.get_visible():
            yield item
            yield from _all_axes(item.child_axes)


def _legend_words(legend: Any) -> list[str]:
    return [legend.get_title().get_text(), *(text.get_text() for text in legend.get_texts())]


class _Axes:
    """Describes one axes."""

    def __init__(self, axes: Any) -> None:
        self._axes = axes
        names = ("xaxis", "yaxis", "zaxis")
        self._all_axis = [getattr(axes, name) for name in names if hasattr(axes, name)]
        self._is_flat = axes.name == "rectilinear"
        self._limits = [sorted(map(float, axis.get_view_interval())) for axis in self._all_axis]
        place = axes.transLimits + axes.transAxes if self._is_flat else axes.transAxes
        self._place = place.inverted()
        self._ranges = [1.0, 1.0]
        if self._is_flat:
            (left, bottom), (right, top) = self._place.transform(
                axes.transAxes.transform([(0, 0), (1, 1)])
            )
            self._ranges = [abs(float(right - left)), abs(float(top - bottom))]

    def describe(self) -> dict[str, Any]:
        axes = self._axes
        sides = ("left", "center", "right")
        legend = axes.get_legend()
        return {
            "kind": axes.name,
            "titles": [axes.get_title(loc=side) for side in sides],
            "labels": [axis.get_label_text() for axis in self._all_axis],
            "scales": [_scale(axis) for axis in self._all_axis],
            "limits": self._limits,
            "inverted": [bool(axis.get_inverted()) for axis in self._all_axis],
            "ticks": [_chosen_ticks(axis) for axis in self._all_axis],
            "ranges": self._ranges,
            "legend": [] if legend is None else _legend_words(legend),
            "parts": list(self._parts()),
        }

    def _parts(self) -> Iterator[dict[str, Any]]:
        from matplotlib.axes import Axes
        from matplotlib.collections import Collection
        from matplotlib.image import _ImageBase
        from matplotlib.legend import Legend
        from matplotlib.lines import Line2D
        from matplotlib.patches import Patch
        from matplotlib.text import Text

        axes, counts = self._axes, dict[str, int]()
        frame = {*axes.spines.values(), *self._all_axis, axes.patch}
        frame |= {axes.title, axes._left_title, axes._right_title}
        artists = [a for a in axes.get_children() if a.get_visible() and a not in frame]
        artists.sort(key=lambda artist: float(artist.get_zorder()))  # as they are drawn
        labels = {text for artist in artists for text in getattr(artist, "labelTexts", ())}
        for artist in artists:
            if isinstance(artist, Axes | Legend) or artist in labels:
                continue  # how many labels contours have depends on their size
            kinds = {
                "curve": Line2D,
                "shape": Patch,
                "image": _ImageBase,
                "collection": Collection,
                "text": Text,
            }
            kind = next((kind for kind, type in kinds.items() if isinstance(artist, type)), "box")
            counts[kind] = counts.get(kind, 0) + 1
            label = str(artist.get_label())
            name = f"{kind} {counts[kind]}" if label.startswith("_") or not label else label
            part: dict[str, Any] = {"kind": kind, "name": name}
            if kind == "text":
                part |= {"words": [artist.get_text()], "paths": [self._text_place(artist)]}
            elif kind == "box":
                part["words"] = [text.get_text() for text in artist.findobj(Text)]
            else:
                part |= {"style": _style(artist)} | self._places(artist, is_image=kind == "image")
            yield part

    def _text_place(self, text: Any) -> list[Any]:
        """Where a text stands; nothing where its author has not placed it in the axes."""
        coordinates = getattr(text, "xycoords", None)
        if coordinates not in (None, "data"):
            return []
        place = text.xy if coordinates == "data" else text.get_unitless_position()
        transform = self._axes.transData if coordinates == "data" else text.get_transform()
        if coordinates == "data":
            place = [axis.convert_units(v) for axis, v in zip(self._all_axis, place, strict=False)]
        return self._rounded(self._place.transform(transform.transform([place])))

    def _places(self, artist: Any, *, is_image: bool) -> dict[str, Any]:
        values: dict[str, Any] = {}
        if is_image:
            left, right, bottom, top = artist.get_extent()
            corners = artist.get_transform().transform([(left, bottom), (right, top)])
            values["paths"] = [self._rounded(self._place.transform(corners))]
        else:
            paths = self._drawn_paths(artist)
            values["paths"] = [self._rounded(self._place.transform(path)) for path in paths]
        numbers = getattr(artist, "get_array", lambda: None)()
        if numbers is not None:
            low, high = map(float, artist.get_clim()) if numbers.ndim < 3 else (0.0, 255.0)
            values |= {"shape": list(numbers.shape), "range": [low, high]}
            digits = _decimals(high - low)
            values["values"] = [_round(v, digits) for v in numbers.astype(float).ravel().tolist()]
        if hasattr(artist, "get_sizes"):
            values["sizes"] = [_round(size, 2) for size in artist.get_sizes().tolist()]
        return values

    def _drawn_paths(self, artist: Any) -> list[Any]:
        """The paths of an artist on the canvas."""
        if getattr(artist, "labelTexts", ()):  # contours, which make room for their labels
            contours, to_canvas = artist._contour_generator, self._axes.transData.transform
            paths = (contours.lines(level) for level in artist.levels)  # with or without codes
            points = (path[0] if isinstance(path, tuple) else path for path in paths)
            return [to_canvas(line) for lines in points for line in lines]
        renderer = _renderer(self._axes.figure.dpi)
        artist.draw(renderer)
        return list(renderer.paths)

    def _rounded(self, points: Any) -> list[list[float | None]]:
        digits = list(map(_decimals, self._ranges))
        return [
            [_round(v, n) for v, n in zip(point, digits, strict=True)] for point in points.tolist()
        ]


def _scale(axis: Any) -> str:
    """The name of an axis' scale; with its base, if it has one."""
    base = getattr(axis.get_transform(), "base", None)
    return str(axis.get_scale()) if base is None else f"{axis.get_scale()} {float(base):g}"


def _chosen_ticks(axis: Any) -> list[str]:
    """The labels of ticks that the author has set, also as categories."""
    from matplotlib.category import StrCategoryLocator
    from matplotlib.ticker import FixedLocator

    if not isinstance(axis.get_major_locator(), FixedLocator | StrCategoryLocator):
        return []
    return [label.get_text() for label in axis.get_majorticklabels()]


def _style(artist: Any) -> dict[str, Any]:
    """What a text may refer to: colours, the kind of line, markers, hatching."""
    from matplotlib.colors import to_hex, to_rgba_array

    style: dict[str, Any] = {}
    mapped = getattr(artist, "get_array", lambda: None)() is not None
    if mapped:
        colours = artist.get_cmap()(_SHADES)  # it need not have a name that stays
        style["colours"] = [to_hex(rgba, keep_alpha=True) for rgba in colours]
    for name in ("color", "facecolor", "edgecolor"):
        colour = getattr(artist, f"get_{name}", None)
        if colour is not None and not mapped:
            colours = [to_hex(rgba, keep_alpha=True) for rgba in to_rgba_array(colour())]
            style[name] = colours[:1] if len(set(colours)) == 1 else colours
    for name in ("linestyle", "marker", "hatch"):
        value = getattr(artist, f"get_{name}", lambda: None)()
        if isinstance(value, str | int):
            style[name] = str(value)
    return style


def _decimals(size: float) -> int:
    return _DIGITS - math.floor(math.log10(size)) if math.isfinite(size) and size > 0 else 12


def _round(value: float, digits: int) -> float | None:
    return round(value, digits) + 0.0 if math.isfinite(value) else None  # no minus zero


def _renderer(dpi: float) -> Any:
    """A renderer that notes where paths lead, on the canvas."""
    import numpy as np
    from matplotlib.backend_bases import RendererBase

    class Renderer(RendererBase):
        def __init__(self) -> None:
            super().__init__()
            self.paths: list[Any] = []

        def points_to_pixels(self, points: Any) -> Any:
            return points * dpi / 72.0

        def draw_path(self, gc: Any, path: Any, transform: Any, rgbFace: Any = None) -> None:
            self.paths.append(transform.transform(path.vertices))

        def draw_markers(
            self, gc: Any, marker: Any, marker_trans: Any, path: Any, trans: Any, *_: Any
        ) -> None:
            self._add_places(trans.transform(path.vertices))

        def draw_path_collection(self, gc: Any, *args: Any, **_: Any) -> None:
            master, paths, _all, offsets, place = args[:5]
            offsets = np.asarray(offsets, float).reshape(-1, 2)
            if len(offsets) > 1 or offsets.any():
                self._add_places(place.transform(offsets))
            else:
                self.paths += (master.transform(path.vertices) for path in paths)

        def draw_quad_mesh(self, gc: Any, *args: Any, **_: Any) -> None:
            master, _width, _height, coordinates = args[:4]
            self.paths.append(master.transform(np.asarray(coordinates).reshape(-1, 2)))

        def draw_gouraud_triangles(
            self, gc: Any, triangles: Any, colors: Any, transform: Any
        ) -> None:
            self.paths.append(transform.transform(np.asarray(triangles).reshape(-1, 2)))

        def draw_image(self, *_: Any, **__: Any) -> None:
            pass

        def draw_text(self, *_: Any, **__: Any) -> None:
            pass

        def _add_places(self, places: Any) -> None:
            """Add the places of markers, unless a curve leads through them."""
            if not any(np.array_equal(places, path) for path in self.paths):
                self.paths.append(places)

    return Renderer()
