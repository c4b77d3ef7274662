"""Draws the site's icon as pictures, for systems that take no SVG.

    python site/prepare_icons.py FOLDER [OLD]

`site/bundle.py` calls it with the bundle that it makes, and with the old one, from which the
pictures are copied where nothing has changed.

1. The shapes of `templates/icon.svg` are read: rectangles, circles, and paths of straight lines
   with round ends. Anything else is an error, so that no picture lacks a part of the icon.
2. A pixel takes a share of a shape's colour that depends on its distance from the shape's edge.
3. A picture is written as PNG. The same icon gives the same bytes.

Only the standard library is used here: the module runs in pip's build environment.
"""

import hashlib
import json
import math
import re
import struct
import sys
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

ICON = Path(__file__).resolve().parents[1] / "templates" / "icon.svg"
SIDE = 32.0
"""The icon's side in its own coordinates."""

_SVG = "{http://www.w3.org/2000/svg}"
_INHERITED = ("fill", "stroke", "stroke-width", "stroke-linecap", "stroke-linejoin")
_STEP = re.compile(r"\s*([MLHVlhv])\s*((?:-?[\d.]+[\s,]*)+)")


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture of the icon."""

    name: str
    side: int
    """Pixels."""
    full: bool = False
    """Whether the background fills the square, for systems that cut out a shape of their own."""
    share: float = 1.0
    """The share of the side that the drawing takes: systems cut away only background."""


PICTURES = (
    Picture("icon-192.png", 192),
    Picture("icon-512.png", 512),
    # Of a maskable icon, a circle of four fifths of the side is never cut away.
    Picture("icon-maskable.png", 512, full=True, share=0.8),
    Picture("icon-touch.png", 180, full=True, share=0.9),
)


class IconError(Exception):
    """The icon has a part that cannot be drawn here; the message says which."""


Colour = tuple[int, int, int]
Distance = Callable[[float, float], float]
"""The distance of a point from the edge of a shape, negative inside, in the icon's coordinates."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A part of the icon in one colour."""

    colour: Colour
    distance: Distance
    box: tuple[float, float, float, float]
    """Left, top, right, bottom."""
    is_background: bool = False


def shapes(svg: str) -> tuple[Shape, ...]:
    """The shapes of an icon, from the lowest to the highest.

    Raises:
        IconError: it has other parts.
    """
    root = ElementTree.fromstring(svg)
    if root.get("viewBox") != f"0 0 {SIDE:g} {SIDE:g}":
        raise IconError(f"the icon's viewBox is {root.get('viewBox')!r}")
    drawing = tuple(_shapes(root, {}))
    if not drawing or not drawing[0].is_background:
        raise IconError("the icon's first shape is no rectangle that fills it")
    return drawing


def _shapes(parent: ElementTree.Element, inherited: dict[str, str]) -> Iterator[Shape]:
    for element in parent:
        style = inherited | {name: value for name, value in element.items() if name in _INHERITED}
        kind = element.tag.removeprefix(_SVG)
        if kind == "g":
            yield from _shapes(element, style)
        elif kind == "rect":
            yield _rectangle(element, style)
        elif kind == "circle":
            yield _disc(element, style)
        elif kind == "path":
            yield _line(element, style)
        else:
            raise IconError(f"the icon has an element `{kind}`")


def _rectangle(element: ElementTree.Element, style: dict[str, str]) -> Shape:
    x, y = _number(element, "x"), _number(element, "y")
    width, height, radius = (_number(element, name) for name in ("width", "height", "rx"))
    middle = x + width / 2, y + height / 2
    inner = width / 2 - radius, height / 2 - radius

    def distance(px: float, py: float) -> float:
        dx, dy = abs(px - middle[0]) - inner[0], abs(py - middle[1]) - inner[1]
        return math.hypot(max(dx, 0.0), max(dy, 0.0)) + min(max(dx, dy), 0.0) - radius

    box = (x, y, x + width, y + height)
    return Shape(_colour(style.get("fill")), distance, box, box == (0.0, 0.0, SIDE, SIDE))


def _disc(element: ElementTree.Element, style: dict[str, str]) -> Shape:
    x, y, radius = (_number(element, name) for name in ("cx", "cy", "r"))
    box = (x - radius, y - radius, x + radius, y + radius)
    return Shape(_colour(style.get("fill")), lambda a, b: math.hypot(a - x, b - y) - radius, box)


def _line(element: ElementTree.Element, style: dict[str, str]) -> Shape:
    if style.get("fill") != "none" or style.get("stroke-linecap") != "round":
        raise IconError("the icon has a path that is filled, or whose ends are not round")
    points = _points(element.get("d", ""))
    half = float(style["stroke-width"]) / 2

    def distance(px: float, py: float) -> float:
        return min(_to_segment(px, py, a, b) for a, b in pairwise(points)) - half

    xs, ys = zip(*points, strict=True)
    box = (min(xs) - half, min(ys) - half, max(xs) + half, max(ys) + half)
    return Shape(_colour(style.get("stroke")), distance, box)


def _to_segment(px: float, py: float, a: tuple[float, float], b: tuple[float, float]) -> float:
    dx, dy = b[0] - a[0], b[1] - a[1]
    share = ((px - a[0]) * dx + (py - a[1]) * dy) / (dx * dx + dy * dy)
    share = min(max(share, 0.0), 1.0)
    return math.hypot(px - a[0] - share * dx, py - a[1] - share * dy)


def _points(path: str) -> list[tuple[float, float]]:
    points: list[tuple[float, float]] = []
    at = 0
    while at < len(path):
        step = _STEP.match(path, at)
        if step is None or (step[1] == "M") != (not points):
            raise IconError(f"the icon has a path `{path}`")
        values = [float(value) for value in re.findall(r"-?[\d.]+", step[2])]
        wide = step[1] in "MLl"
        pairs = zip(values[::2], values[1::2], strict=True) if wide else ((v, v) for v in values)
        for x, y in pairs:
            px, py = points[-1] if points else (0.0, 0.0)
            if step[1].islower():
                x, y = px + x, py + y
            points.append((px if step[1] in "Vv" else x, py if step[1] in "Hh" else y))
        at = step.end()
    if len(points) < 2:
        raise IconError(f"the icon has a path `{path}`")
    return points


def _number(element: ElementTree.Element, name: str) -> float:
    return float(element.get(name, "0"))


def _colour(text: str | None) -> Colour:
    digits = re.fullmatch("#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})", text or "")
    if digits is None:
        raise IconError(f"the icon has a colour {text!r}")
    red, green, blue = (int(part, 16) for part in digits.groups())
    return red, green, blue


def draw(icon: tuple[Shape, ...], picture: Picture) -> bytes:
    """Draw the icon as PNG."""
    side = picture.side
    scale = side * picture.share / SIDE
    shift = side * (1 - picture.share) / 2
    rows = [bytearray(4 * side) for _ in range(side)]
    for shape in icon:
        if picture.full and shape.is_background:
            rows = [bytearray((*shape.colour, 255) * side) for _ in range(side)]
        else:
            _paint(rows, shape, scale, shift)
    return _png(side, rows)


def _paint(rows: list[bytearray], shape: Shape, scale: float, shift: float) -> None:
    side = len(rows)
    left, top, right, bottom = (value * scale + shift for value in shape.box)
    columns = range(max(math.floor(left - 1), 0), min(math.ceil(right + 1), side))
    for j in range(max(math.floor(top - 1), 0), min(math.ceil(bottom + 1), side)):
        row, y = rows[j], (j + 0.5 - shift) / scale
        for i in columns:
            cover = 0.5 - scale * shape.distance((i + 0.5 - shift) / scale, y)
            if cover >= 1.0:
                row[4 * i : 4 * i + 4] = bytes((*shape.colour, 255))
            elif cover > 0.0:
                _blend(row, 4 * i, shape.colour, cover)


def _blend(row: bytearray, at: int, colour: Colour, cover: float) -> None:
    rest = row[at + 3] / 255 * (1 - cover)
    whole = cover + rest
    for k in range(3):
        row[at + k] = round((colour[k] * cover + row[at + k] * rest) / whole)
    row[at + 3] = round(255 * whole)


def _png(side: int, rows: list[bytearray]) -> bytes:
    row_above = bytearray(4 * side)
    lines = bytearray()
    for row in rows:  # filter 2: the difference to the row above, which is small in flat colours
        lines.append(2)
        lines += bytes((a - b) & 255 for a, b in zip(row, row_above, strict=True))
        row_above = row
    header = struct.pack(">IIBBBBB", side, side, 8, 6, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(lines, 9)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        for name, body in chunks
    )


def main(bundle: Path, old: Path | None = None) -> None:
    """Write the pictures into a bundle."""
    folder = bundle / "icons"
    folder.mkdir()
    sources = (ICON.read_bytes(), Path(__file__).read_bytes())
    source_hash = hashlib.sha256(b"\0".join(sources)).hexdigest()
    pictures_before = _read_pictures(old / "icons", source_hash) if old is not None else None
    icon = () if pictures_before is not None else shapes(ICON.read_text(encoding="utf-8"))
    for picture in PICTURES:
        data = draw(icon, picture) if pictures_before is None else pictures_before[picture.name]
        (folder / picture.name).write_bytes(data)
    (folder / "source.json").write_text(f"{json.dumps(source_hash)}\n", encoding="utf-8")


def _read_pictures(folder: Path, source_hash: str) -> dict[str, bytes] | None:
    try:
        if json.loads((folder / "source.json").read_text(encoding="utf-8")) != source_hash:
            return None
        return {picture.name: (folder / picture.name).read_bytes() for picture in PICTURES}
    except (OSError, ValueError):
        return None


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
    except IconError as error:
        sys.exit(f"site/prepare_icons.py: {error}")
