"""What a figure draws, as Matplotlib's own data say it, and how two figures differ in that.

The data are in the figure's file, where `core.run.matplotlib_watching` has put them; they say
nothing of layout and fonts. Places are in the coordinates of the scales of their axes, and may
differ by `TOLERANCE` of an axis.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import re
import struct
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Iterator
from html import unescape
from typing import TypeAlias

import msgspec
from msgspec import Struct

from coursebuild.core.drawing.safe_svg import SVG
from coursebuild.core.text.regex import regex

TOLERANCE = 1e-3
"""How much numbers may differ: this part of an axis of a figure, of the longer side of a drawing in
SVG, or of the largest number in a column of data."""
MOST_DATA = 1 << 20
"""The most bytes of data that a figure may hold."""
_MARK = "drawn"
_PNG_MARK = b"zTXt" + _MARK.encode() + b"\0\0"
"""How the chunk with the data begins."""
_SVG_DATA = regex(rb'<metadata class="%s">([^<]*+)</metadata>' % _MARK.encode())
_MOST_NAMED = 2
"""The most differences that a message names."""

Point: TypeAlias = tuple[float | None, float | None]


class DrawnPart(Struct, frozen=True, omit_defaults=True):
    """A curve, or whatever else an axes draws."""

    kind: str
    name: str
    """Its label, or its kind and its number among those."""
    style: dict[str, str | list[str]] = {}
    words: tuple[str, ...] = ()
    paths: tuple[tuple[Point, ...], ...] = ()
    values: tuple[float | None, ...] = ()
    """Numbers that are shown as colours."""
    shape: tuple[int, ...] = ()
    range: tuple[float | None, float | None] = (None, None)
    """The numbers of the first and the last colour."""
    sizes: tuple[float | None, ...] = ()
    """Of markers."""


class Axes(Struct, frozen=True):
    """A pair of axes, or more, with what is drawn between them."""

    kind: str
    titles: tuple[str, ...]
    labels: tuple[str, ...]
    scales: tuple[str, ...]
    limits: tuple[tuple[float | None, ...], ...]
    inverted: tuple[bool, ...]
    ticks: tuple[tuple[str, ...], ...]
    """The labels of ticks, if the author has set them."""
    ranges: tuple[float, float]
    """How long the axes are, in the coordinates of places."""
    legend: tuple[str, ...]
    parts: tuple[DrawnPart, ...]
    """In the order in which they are drawn."""


class FigureData(Struct, frozen=True):
    """The data of a figure."""

    size: tuple[float, float]
    """Inches."""
    fonts: tuple[str, ...]
    """The files of its fonts, on which its layout depends."""
    texts: tuple[str, ...]
    legends: tuple[tuple[str, ...], ...]
    axes: tuple[Axes, ...]


def read_figure_data(data: bytes) -> FigureData | None:
    """The data in a figure's file; `None` where there are none."""
    text: str | bytes = b""
    if not data.startswith(b"\x89PNG"):
        match = _SVG_DATA.search(data)
        if match is not None and len(match[1]) <= 2 * MOST_DATA:
            text = unescape(match[1].decode("utf-8", "replace"))
    elif (at := data.rfind(_PNG_MARK)) >= 0:
        start, end = at + len(_PNG_MARK), at + 4 + int.from_bytes(data[at - 4 : at], "big")
        with contextlib.suppress(zlib.error):
            text = zlib.decompressobj().decompress(data[start:end], MOST_DATA)
    with contextlib.suppress(msgspec.MsgspecError, UnicodeDecodeError):
        return msgspec.json.decode(text, type=FigureData)
    return None


def add_to_svg(root: ET.Element, figure_data: FigureData) -> None:
    """Put the data of a figure into its drawing."""
    element = ET.SubElement(root, f"{SVG}metadata", {"class": _MARK})
    element.text = msgspec.json.encode(figure_data).decode()


def png_chunk(figure_data: FigureData) -> bytes:
    """The chunk of a PNG that holds the data of its figure."""
    data = _PNG_MARK + zlib.compress(msgspec.json.encode(figure_data))
    return struct.pack(">I", len(data) - 4) + data + struct.pack(">I", zlib.crc32(data))


def without_data(figure: bytes) -> bytes:
    """A figure's file as readers get it, who see nothing of its data."""
    if not figure.startswith(b"\x89PNG"):
        return _SVG_DATA.sub(b"", figure)
    at = figure.rfind(_PNG_MARK)
    end = at + 8 + int.from_bytes(figure[at - 4 : at], "big")
    return figure if at < 0 else figure[: at - 4] + figure[end:]


# --- differences


def describe_data_difference(old: FigureData, new: FigureData) -> str:
    """How a new figure draws something else than the recorded one; empty where it does not."""
    differences = list(_differences(old, new))
    rest = len(differences) - _MOST_NAMED
    clauses = "; ".join(differences[:_MOST_NAMED])
    return f"{clauses}; and {rest} more" if rest > 0 else clauses


def _differences(old: FigureData, new: FigureData) -> Iterator[str]:
    if len(old.axes) != len(new.axes):
        yield f"it has {len(new.axes)} axes where {len(old.axes)} are recorded"
        return
    for number, (before, now) in enumerate(zip(old.axes, new.axes, strict=True), 1):
        lead = f"in axes {number}, " if len(old.axes) > 1 else ""
        for difference in (*_part_differences(before, now), *_axes_differences(before, now)):
            yield lead + difference
    yield from _words("its texts", old.texts, new.texts)
    for legend_before, legend_now in itertools.zip_longest(old.legends, new.legends, fillvalue=()):
        yield from _words("its legend", legend_before, legend_now)
    if old.size != new.size:
        yield "it is {:g}×{:g} inches where {:g}×{:g} are recorded".format(*new.size, *old.size)


_WORDS_OF_AXES = {
    "the titles": "titles",
    "the labels of the axes": "labels",
    "the legend": "legend",
}


def _axes_differences(old: Axes, new: Axes) -> Iterator[str]:
    for name, field in _WORDS_OF_AXES.items():
        yield from _words(name, getattr(old, field), getattr(new, field))
    yield from _words("the scales", (old.kind, *old.scales), (new.kind, *new.scales))
    for before, now in itertools.zip_longest(old.ticks, new.ticks, fillvalue=()):
        yield from _words("the ticks", before, now)
    if old.inverted != new.inverted:
        yield "an axis runs the other way"
    for name, before_limits, now_limits in zip("xyz", old.limits, new.limits, strict=False):
        low, high = (_number(value) for value in before_limits)
        pairs = zip(before_limits, now_limits, strict=True)
        if any(abs(_number(a) - _number(b)) > TOLERANCE * (high - low) for a, b in pairs):
            new_limits = " to ".join(f"{_number(value):.4g}" for value in now_limits)
            yield f"the {name} axis goes from {new_limits}, not from {low:.4g} to {high:.4g}"


def _part_differences(old: Axes, new: Axes) -> Iterator[str]:
    names = [part.name for part in old.parts], [part.name for part in new.parts]
    if names[0] != names[1]:
        yield from _words("what is drawn", *map(tuple, names))
        return
    for before, now in zip(old.parts, new.parts, strict=True):
        name = before.name if re.fullmatch(rf"{before.kind} \d+", before.name) else ""
        lead = f"the {name}" if name else f"the {before.kind} “{before.name}”"
        if difference := _part_difference(before, now, old):
            yield f"{lead} {difference}"


def _part_difference(old: DrawnPart, new: DrawnPart, axes: Axes) -> str:
    if old.kind != new.kind:
        return f"is a {new.kind} where a {old.kind} is recorded"
    counts = [sum(map(len, part.paths)) for part in (old, new)]
    if [len(path) for path in old.paths] != [len(path) for path in new.paths]:
        if counts[0] != counts[1]:
            return f"has {counts[1]} points where {counts[0]} are recorded"
        return f"has {len(new.paths)} pieces where {len(old.paths)} are recorded"
    points = zip(
        itertools.chain.from_iterable(old.paths),
        itertools.chain.from_iterable(new.paths),
        strict=True,
    )
    pairs = enumerate(points, 1)
    moves = [(n, a, b) for n, (a, b) in pairs if not all(map(_are_close, a, b, axes.ranges))]
    if moves:  # the farthest one says most
        number, before, now = max(moves, key=lambda move: _distance(move[1], move[2], axes.ranges))
        position = f"its point {number} of {counts[0]}" if counts[0] > 1 else "its point"
        suffix = f", and {len(moves) - 1} more points moved" if len(moves) > 1 else ""
        places = f"at {_place(now, axes)} where {_place(before, axes)} is recorded"
        return f"has {position} {places}{suffix}"
    if old.words != new.words:
        return f"says {_quote(new.words)} where {_quote(old.words)} is recorded"
    if old.shape != new.shape:
        sizes = ["×".join(map(str, part.shape)) for part in (new, old)]
        return "has {} values where {} are recorded".format(*sizes)
    return _value_difference(old, new) or _style_difference(old, new)


def _value_difference(old: DrawnPart, new: DrawnPart) -> str:
    low, high = map(_number, old.range)
    pairs = list(zip((*old.values, *old.range), (*new.values, *new.range), strict=True))
    different = [n for n, (a, b) in enumerate(pairs) if not _are_close(a, b, abs(high - low))]
    if different and different[0] >= len(old.values):
        return "has colours for another range of values"
    if different:
        first = different[0]
        now, before = map(_number, (new.values[first], old.values[first]))
        place = f"point {first + 1}"
        if len(old.shape) > 1:
            row, rest = divmod(first, math.prod(old.shape[1:]))
            place = f"row {row + 1}, column {rest // math.prod(old.shape[2:]) + 1}"
        suffix = f", and {len(different) - 1} more differ" if len(different) > 1 else ""
        return f"has the value {now:.4g} at {place} where {before:.4g} is recorded{suffix}"
    return ""


def _style_difference(old: DrawnPart, new: DrawnPart) -> str:
    for name, before in old.style.items():
        now = new.style.get(name, "")
        if before != now:
            words = [", ".join(v[:5]) if isinstance(v, list) else v for v in (now, before)]
            return f"has the {name} {words[0]} where {words[1]} is recorded"
    if old.sizes != new.sizes:
        return "has markers of other sizes"
    return ""


def _distance(old: Point, new: Point, ranges: tuple[float, float]) -> float:
    """How far a point moved, as a part of the axes; what is there only now moved farthest."""
    parts = (
        abs(_number(a) - _number(b)) / size
        if size and a is not None and b is not None
        else math.inf
        for a, b, size in zip(old, new, ranges, strict=True)
        if a != b
    )
    return max(parts, default=0.0)


def _are_close(old: float | None, new: float | None, size: float) -> bool:
    if old is None or new is None:
        return old is new
    return abs(old - new) <= TOLERANCE * size or old == new


def _place(point: Point, axes: Axes) -> str:
    """A point in the numbers that its axes show."""
    if axes.kind != "rectilinear":
        return f"({_number(point[0]):.4g}, {_number(point[1]):.4g}) of the axes’ size"
    numbers = []
    for value, scale in zip(point, axes.scales, strict=False):
        numbers.append(_number(value))
        name, _, base = scale.partition(" ")
        if name == "log" and base:
            with contextlib.suppress(OverflowError):
                numbers[-1] = math.pow(float(base), numbers[-1])
    return f"({', '.join(f'{number:.4g}' for number in numbers)})"


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _words(name: str, old: tuple[str, ...], new: tuple[str, ...]) -> Iterator[str]:
    if old != new:
        yield f"{name}: {_quote(new)} where {_quote(old)} is recorded"


def _quote(words: tuple[str, ...]) -> str:
    text = ", ".join(word for word in words if word)
    return f"“{text}”" if text else "nothing"
