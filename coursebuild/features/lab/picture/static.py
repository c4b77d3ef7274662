"""The static form of a lab: what its trial recorded, as a picture, plots and a table.

Lines of a plot have their names at their ends, and differ in dashes as well as in colour. Colours
are classes that the style sheet defines for light and dark pages; text has the page's colour.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise
from typing import Any, TypeGuard

import numpy as np
from markupsafe import Markup
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from coursebuild.core.drawing.scales import Scale, separate_labels, typeset_number
from coursebuild.core.drawing.scales import markup_text as _text
from coursebuild.core.text.quantities import with_unit
from coursebuild.features.lab.equations.reference import CurveRun
from coursebuild.features.lab.model import ODE, Lab
from coursebuild.features.lab.picture.draw import Floor, FreeCamera, draw, round_length
from coursebuild.features.lab.picture.png import moving_png, png
from coursebuild.features.lab.picture.raster import SKY, texture_of
from coursebuild.features.lab.picture.scenery import ground_of, scene_solids
from coursebuild.features.lab.picture.shapes import light_of
from coursebuild.features.lab.reply import LabRecord, MainRun, unpack_arrays
from coursebuild.features.lab.schema import FILM_RATE, Plot, TraceFields

_WIDTH = 640
_USUAL = 1.6
"""Width of a usual view over its height."""
_ARROWS = ("momentum", "angularMomentum", "forces")
_FROM_AFAR = 1000.0
_BAR = 0.2
"""The largest part of the picture's width that the scale bar takes."""
_FILM_ROUNDS = 2
"""A film ends within five seconds, so that it needs no button (WCAG 2.2, 2.2.2)."""
_LARGE = 1e9
"""From here on numbers are written with powers of ten, as in the live lab."""


def draw_picture(lab: Lab, main: MainRun) -> bytes:
    """Draw the start of the main run of a lab's trial, as PNG."""
    frame = unpack_arrays(main["pictures"][0]["frame"])
    return png(_draw_frame(lab, unpack_arrays(main["scene"]), frame, _size(lab)))


def draw_film(lab: Lab, main: MainRun) -> bytes:
    """Draw the film of a lab's trial, as animated PNG of half the width."""
    width, height = _size(lab)
    scene = unpack_arrays(main["scene"])
    size = width // 2, height // 2
    frames = [_draw_frame(lab, scene, frame, size) for frame in unpack_arrays(main["film"])]
    return moving_png(frames, FILM_RATE, _FILM_ROUNDS)


def _draw_frame(
    lab: Lab, scene: dict[str, Any], frame: Any, size: tuple[int, int]
) -> NDArray[np.uint8]:
    camera = _camera(lab, scene["camera"])
    light = light_of(scene, np.asarray(frame, dtype=float), camera.forward)
    skies = (texture_of(t) for t in scene["textures"] if t["type"] == SKY)
    solids = tuple(scene_solids(scene, frame))
    ground = ground_of(scene)
    floor = None if ground is None else Floor(ground, camera.distance, camera.target)
    return draw(solids, camera, size, light, next(skies, None), floor)


def _camera(lab: Lab, record: dict[str, Any]) -> FreeCamera:
    distance, fovy = record["distance"], record["fovy"]
    if record["orthographic"]:  # its `fovy` is a length; from far away the view is the same
        distance *= _FROM_AFAR
        fovy = math.degrees(2 * math.atan(fovy / 2 / distance))
    else:  # a narrow picture shows the full width
        width, height = _size(lab)
        wider = max(1.0, _USUAL * height / width)
        fovy = math.degrees(2 * math.atan(wider * math.tan(math.radians(fovy) / 2)))
    target = tuple(record["target"])
    return FreeCamera(record["azimuth"], record["elevation"], distance, target, fovy)


def _size(lab: Lab) -> tuple[int, int]:
    return (_WIDTH, max(160, min(round(_WIDTH * lab.fields.height / 480), 480)))


def lab_record(lab: Lab, main: MainRun, decimal: str) -> LabRecord:
    """Make the record of a lab from the main run of its trial; `decimal`: the sign in numbers."""
    first, last = main["pictures"][0], main["pictures"][-1]
    recorded = main["plots"]
    plots = tuple(
        Markup(recorded_svg(plot, recorded["times"], traces, decimal, narrow=lab.fields.dock))
        for plot, traces in zip(lab.fields.plots, recorded["plots"], strict=True)
    )
    readouts = tuple(
        (readout.label, _format_value(value, readout.digits, decimal))
        for readout, value in zip(lab.fields.readouts, last["readouts"] or (), strict=False)
    )
    camera = _camera(lab, main["scene"]["camera"])
    width, height = _size(lab)
    metre = height / (2 * camera.distance * math.tan(math.radians(camera.fovy) / 2))
    length = round_length(_BAR * width / metre)
    scale = length, length * metre
    arrows = sum(name in (main["arrows"] or {}) for name in _ARROWS)
    return LabRecord(_size(lab), scale, first["time"], readouts, last["time"], plots, arrows=arrows)


def recorded_svg(
    plot: Plot,
    times: Sequence[float],
    traces: Sequence[Sequence[float | None]],
    decimal: str,
    *,
    narrow: bool,
) -> str:
    """Draw a plot of a main run, against the time or against its last column."""
    if plot.x is None:
        return plot_svg(plot, times, traces, decimal, narrow=narrow)
    start = times[-1] - plot.window if times and plot.window is not None else -math.inf
    first = bisect_left(times, start)
    *lines, places = (column[first:] for column in traces)
    plot = replace(plot, window=None, xlabel=plot.xlabel or plot.x)
    return plot_svg(plot, *_interrupt(places, lines), decimal, narrow=narrow)


def _interrupt(
    places: Sequence[float | None], lines: Sequence[Sequence[float | None]]
) -> tuple[list[float], list[list[float | None]]]:
    """Interrupt lines where their place on the horizontal axis is unknown."""
    parts = [
        [None if x is None else y for x, y in zip(places, line, strict=True)] for line in lines
    ]
    return [x or 0.0 for x in places], parts


def equation_record(lab: Lab, config: dict[str, Any], run: CurveRun, decimal: str) -> LabRecord:
    """Make the record of a lab without an engine from what follows from its start."""
    plots = []
    for plot, data, source in zip(lab.fields.plots, run.plots, config["plots"], strict=True):
        axis = config["axis"]
        ends = (source["xmin"], source["xmax"]) if source["x"] else (axis["min"], axis["max"])
        horizontal, lines = _interrupt(data["x"], data["traces"])
        points = (source["points"] or {"data": ()})["data"]
        svg = plot_svg(
            plot, horizontal, lines, decimal, narrow=lab.fields.dock, ends=ends, marks=points
        )
        plots.append(Markup(svg))
    readouts = tuple(
        (readout.label, _format_value(value, readout.digits, decimal))
        for readout, value in zip(lab.fields.readouts, run.readouts, strict=True)
    )
    axis, at = config["axis"], run.end if lab.kind == ODE else config["axis"]["at"]
    number = typeset_number(f"{at:.4g}", decimal)
    place = f"{axis['name']} = {with_unit(number, axis['unit'])}"
    size = (round(_WIDE), round(_HEIGHT) * len(plots))
    return LabRecord(size, None, at, readouts, run.end, tuple(plots), place)


_FILE_STYLE = (
    "svg{font:11px sans-serif;fill:#555}path{fill:none;stroke:#555}.lab-grid{stroke:#ddd}"
    ".lab-measured{fill:none;stroke:#555}.lab-reference{stroke-dasharray:1 3}"
    ".lab-trace{stroke-width:1.6}"
    + "".join(
        f".lab-trace-{i}{{stroke:{colour}}}"
        for i, colour in enumerate(("#0072b2", "#b84f00", "#00785a", "#a3487d", "#8a6000"), 1)
    )
)
"""Colours that can be seen on white and on black: a file does not know the page's."""


def plots_file(plots: Sequence[Markup]) -> bytes:
    """Write plots, one below the other, as an SVG file, for copies of a page."""
    rows = (
        plot.replace("<svg ", f'<svg y="{_HEIGHT * i:g}" height="{_HEIGHT:g}" ', 1)
        for i, plot in enumerate(plots)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDE:g} {_HEIGHT * len(plots):g}">'
        f"<style>{_FILE_STYLE}</style>{''.join(rows)}</svg>"
    ).encode()


def _format_value(value: Any, digits: int, decimal: str) -> str:
    if isinstance(value, str):
        return value
    if not isinstance(value, int | float):
        return "\u2013"
    form = f".{max(2, digits)}e" if abs(value) >= _LARGE else f".{digits}f"
    return typeset_number(f"{value:{form}}", decimal)


_WIDE, _NARROW, _HEIGHT = 480.0, 340.0, 210.0
_TOP, _BOTTOM = 24.0, 38.0
_LETTER = 6.2
"""Width of a letter or a digit."""
_DASHES = ("", "6 3", "2 3", "8 3 2 3", "1 4")
_LABEL_GAP = 13.0
_TICKS = 5
"""About how many ticks the axis of values has."""
_LARGEST = 4e307
"""Larger values are drawn here, so that the range of an axis is finite."""


def plot_svg(
    plot: Plot,
    times: Sequence[float],
    traces: Sequence[Sequence[float | None]],
    decimal: str = ".",
    *,
    narrow: bool = False,
    ends: tuple[float | None, float | None] = (None, None),
    marks: Sequence[Sequence[float]] = (),
) -> str:
    """Draw a plot as an `svg` element; values that are not finite interrupt their line.

    A narrow plot is for the margin: its text has the same size there. `ends` are those of the
    horizontal axis, if they are not where the samples end; `marks` are points beside the lines. The
    result is empty if nothing was recorded.
    """
    start = -math.inf if plot.window is None or not times else times[-1] - plot.window * (1 + 1e-9)
    samples = [(t, i) for i, t in enumerate(times) if t >= start]
    if not samples:
        return ""
    low_t = min(t for t, _ in samples) if ends[0] is None else ends[0]
    high_t = max(t for t, _ in samples) if ends[1] is None else ends[1]
    lines = [[(t, line[i]) for t, i in samples] for line in traces]
    values = [v for points in lines for _, v in points if _is_finite(v)]
    values += [line.y for line in plot.refLines] + [y for _, y in marks]
    low, high = _range(values, plot.ymin, plot.ymax)
    labels = [trace.label for trace in plot.traces]
    last_t = high_t if high_t > low_t else low_t + 1.0
    frame = _Frame.of(low_t, last_t, low, high, labels, decimal, narrow=narrow)
    paths: list[str] = []
    names: list[tuple[float, str, int]] = []
    for n, (trace, points) in enumerate(zip(plot.traces, lines, strict=True)):
        paths.append(frame.trace(points, n, trace))
        last = next((v for _, v in reversed(points) if _is_finite(v)), None)
        if last is not None:
            names.append((frame.y(last), trace.label, n))
    references = [
        frame.reference(line.y, line.label) for line in plot.refLines if low <= line.y <= high
    ]
    parts = [*frame.axes(plot), *references, *paths, *frame.labels(names)]
    parts += [
        f'<circle class="lab-measured" cx="{frame.x(x):.1f}" cy="{frame.y(y):.1f}" r="3"/>'
        for x, y in marks
    ]
    title = ", ".join(filter(None, (plot.ylabel, plot.xlabel, *labels)))  # in any language
    return (
        f'<svg class="lab-plot" viewBox="0 0 {frame.width:g} {_HEIGHT:g}" role="img" '
        f'aria-label="{_text(title)}">' + "".join(parts) + "</svg>"
    )


def _range(values: list[float], ymin: float | None, ymax: float | None) -> tuple[float, float]:
    low = min(values, default=0.0) if ymin is None else ymin
    high = max(values, default=1.0) if ymax is None else ymax
    low, high = max(low, -_LARGEST), min(high, _LARGEST)
    size = max(abs(low), abs(high))
    if not high - low > 1e-12 * size:
        pad = size * 0.1 or 1.0
        middle = high if ymin is None and ymax is not None else low
        return middle - pad, middle + pad
    pad = 0.04 * (high - low)
    return (low if ymin is not None else low - pad), (high if ymax is not None else high + pad)


def _is_finite(value: float | None) -> TypeGuard[float]:
    return value is not None and math.isfinite(value)


class _Frame(Struct, frozen=True):
    """The place of a plot in its drawing, and what is drawn in it."""

    x: Scale
    y: Scale
    width: float

    @classmethod
    def of(
        cls,
        low_t: float,
        high_t: float,
        low: float,
        high: float,
        labels: Sequence[str],
        decimal: str,
        *,
        narrow: bool,
    ) -> _Frame:
        width = _NARROW if narrow else _WIDE
        y = Scale(_HEIGHT - _BOTTOM, _TOP, low, high, logarithmic=False, decimal=decimal)
        longest = max(len(text) for _, text in y.ticks(_TICKS))
        left = min(8.0 + _LETTER * longest, 0.35 * width)
        room = min(14.0 + _LETTER * max((len(label) for label in labels), default=0), 0.35 * width)
        x = Scale(left, width - room, low_t, high_t, logarithmic=False, decimal=decimal)
        return cls(x, y, width)

    def axes(self, plot: Plot) -> list[str]:
        left, right, bottom = self.x.start, self.x.end, self.y.start
        parts = []
        for y, text in self.y.ticks(_TICKS):
            parts.append(f'<path class="lab-grid" d="M{left:.1f} {y:.1f}H{right:.1f}"/>')
            place = f'x="{left - 6:.1f}" y="{y + 3.5:.1f}"'
            parts.append(f'<text {place} text-anchor="end">{text}</text>')
        for count in (6, 4, 3, 2):  # few enough that their texts do not touch
            ticks = self.x.ticks(count)
            longest = max(len(text) for _, text in ticks)
            if len(ticks) * (longest + 1.5) * _LETTER <= right - left:
                break
        else:
            ticks = ticks[:1]
        for x, text in ticks:
            parts.append(f'<path class="lab-axis" d="M{x:.1f} {bottom:g}v4"/>')
            place = f'x="{x:.1f}" y="{bottom + 16:g}"'
            parts.append(f'<text {place} text-anchor="middle">{text}</text>')
        parts.append(f'<path class="lab-axis" d="M{left:.1f} {_TOP:g}V{bottom:g}H{right:.1f}"/>')
        # Along the axis a long name would be cut.
        parts.append(f'<text x="0" y="11">{_text(plot.ylabel)}</text>')
        centre = (left + right) / 2
        parts.append(
            f'<text x="{centre:.1f}" y="{_HEIGHT - 5:g}" text-anchor="middle">'
            f"{_text(plot.xlabel)}</text>"
        )
        return parts

    def reference(self, y: float, label: str) -> str:
        at = self.y(y)
        return (
            f'<path class="lab-reference" d="M{self.x.start:.1f} {at:.1f}H{self.x.end:.1f}"/>'
            f'<text x="{self.x.start + 4:.1f}" y="{at - 4 if at > _TOP + 12 else at + 11:.1f}">'
            f"{_text(label)}</text>"
        )

    def trace(
        self, points: Sequence[tuple[float, float | None]], n: int, trace: TraceFields
    ) -> str:
        dash = _DASHES[n % len(_DASHES)]
        if trace.dash is True:
            dash = _DASHES[1]
        elif trace.dash:
            dash = " ".join(f"{x:g}" for x in trace.dash)
        path: list[str] = []
        # Values that are not finite end a run of points.
        for finite, group in groupby(points, key=lambda point: _is_finite(point[1])):
            if finite:
                run = [(t, min(max(v, -_LARGEST), _LARGEST)) for t, v in group if v is not None]
                path += self._path_commands(run)
        style = f' stroke-dasharray="{dash}"' if dash else ""
        style += ' stroke-linecap="round"' if "h0" in path else ""
        return f'<path class="lab-trace lab-trace-{n % 7 + 1}"{style} d="{"".join(path)}"/>'

    def _path_commands(self, run: list[tuple[float, float]]) -> Iterator[str]:
        if len(run) == 1:
            t, v = run[0]
            if self.y.low <= v <= self.y.high:
                yield f"M{self.x(t):.1f} {self.y(v):.1f}"
                yield "h0"  # round ends make a single point visible
            return
        pen = False
        for (t0, v0), (t1, v1) in pairwise(run):
            begin, end = self._clip_segment(v0, v1)
            if begin > end:
                pen = False
                continue
            if not pen:
                yield f"M{self._interpolate((t0, v0), (t1, v1), begin)}"
            yield f"L{self._interpolate((t0, v0), (t1, v1), end)}"
            pen = end == 1

    def _interpolate(
        self, first: tuple[float, float], second: tuple[float, float], fraction: float
    ) -> str:
        """Write the point at a fraction of a segment; it is inside, up to rounding."""
        pairs = zip(first, second, strict=True)
        t, v = (a + fraction * (b - a) if fraction < 1 else b for a, b in pairs)
        return f"{self.x(t):.1f} {self.y(v):.1f}"

    def _clip_segment(self, v0: float, v1: float) -> tuple[float, float]:
        """Return the fractions between which a segment is inside; start > end if none is."""
        if v0 == v1:
            return (0.0, 1.0) if self.y.low <= v0 <= self.y.high else (1.0, 0.0)
        # Halved, so that the difference of two large numbers is finite.
        change = v1 / 2 - v0 / 2
        cuts = sorted((edge / 2 - v0 / 2) / change for edge in (self.y.low, self.y.high))
        return max(cuts[0], 0.0), min(cuts[1], 1.0)

    def labels(self, ends: list[tuple[float, str, int]]) -> list[str]:
        heights = [y for y, _, _ in sorted(ends)]
        places = separate_labels(heights, _LABEL_GAP, -math.inf, _HEIGHT - _BOTTOM)
        return [
            f'<text class="lab-name lab-name-{n % 7 + 1}" x="{self.x.end + 6:.1f}" '
            f'y="{place + 3.5:.1f}">{_text(label)}</text>'
            for (_, label, n), place in zip(sorted(ends), places, strict=True)
        ]
