"""The primitives of charts: marks, dashes, rings, lines, texts, the key, and the `svg` element.

Entry points: `path`, `area`, `label`, `symbol`, `bar`, `cross`, `ring`; `colour`, `line_look`;
`key`, `svg`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from coursebuild.core.drawing.marks import markup_text, shorten_to_width, text_width

_DASHES = ("", "7 3", "2 3", "10 3 2 3", "1 4", "5 2 1 2 1 2", "12 4")
_LIGHT = ("#0072b2", "#b34d00", "#00795a", "#a8467f", "#7a6a00", "#2b6f9e", "#1e1e1c")
"""Okabe and Ito's, darker on paper."""
_MARK_CORNERS = (0, 4, 4, 3, 3, 5, 6)
_MARK_ANGLES = (0.0, 45.0, 0.0, -90.0, 90.0, -90.0, 0.0)
SIZE, TICK_SIZE = 12.0, 11.0
"""Of letters, in the units of the drawing."""
MARK, SMALL = 4.2, 2.9
RING = 8.5
ROW = 18.0
"""From one line of a key to the next."""
OWN_COLOUR = "var(--rust, #86340c)"
INK = "var(--ink, currentColor)"
PAPER = "var(--paper, Canvas)"
FINE = 'font-size="11"'
"""Of texts other than names and titles."""
HALO = f'stroke="{PAPER}" stroke-width="3" stroke-linejoin="round" paint-order="stroke"'
"""The paper around letters, so that lines below do not cross them."""
_FONT = "var(--sans, system-ui, sans-serif)"


class Entry(NamedTuple):
    """An entry of the key: the meaning of a mark or a line."""

    kind: str
    """`line`, `front`, `beaten`, `other`, `own` or `lost`."""
    text: str
    number: int | None = None
    """The number of a line."""


def path(d: str, look: str) -> str:
    """A line without filling."""
    return f'<path d="{d}" fill="none" {look}/>'


def area(d: str, look: str) -> str:
    """A filled area."""
    return f'<path d="{d}" {look}/>'


def label(x: float, y: float, text: str, look: str = "") -> str:
    """A text at a place."""
    return f'<text x="{x:.1f}" y="{y:.1f}"{look and f" {look}"}>{markup_text(text)}</text>'


def colour(number: int) -> str:
    """The colour of a line; the page may have its own."""
    n = number % len(_LIGHT)
    return f"var(--trace-{n + 1}, {_LIGHT[n]})"


def line_look(number: int) -> str:
    """The colour, width and dashes of a line."""
    dash = _DASHES[number % len(_DASHES)]
    dashes = f' stroke-dasharray="{dash}"' if dash else ""
    return f'stroke="{colour(number)}" stroke-width="1.7" stroke-linejoin="round"{dashes}'


def mark(number: int, x: float, y: float, size: float) -> str:
    """The path of a mark: circle, square, diamond, triangles up and down, pentagon, hexagon.

    All of about the same area; `size` is the radius of the circle.
    """
    n = number % len(_MARK_CORNERS)
    corners = _MARK_CORNERS[n]
    if not corners:
        r = f"{size:g} {size:g} 0 1 0"
        return f"M{x - size:.1f} {y:.1f}a{r} {2 * size:g} 0a{r} {-2 * size:g} 0Z"
    radius = size * math.sqrt(2 * math.pi / (corners * math.sin(2 * math.pi / corners)))
    angles = [math.radians(_MARK_ANGLES[n] + 360 * k / corners) for k in range(corners)]
    places = (f"{x + radius * math.cos(a):.1f} {y + radius * math.sin(a):.1f}" for a in angles)
    return "M" + "L".join(places) + "Z"


def cross(x: float, y: float, paint: str, title: str = "") -> str:
    """The mark of a lost run."""
    s = 3.6
    d = f"M{x - s:.1f} {y - s:.1f}l{2 * s:g} {2 * s:g}m0 {-2 * s:g}l{-2 * s:g} {2 * s:g}"
    return f'<path d="{d}" fill="none" stroke="{paint}" stroke-width="1.8">{_title(title)}</path>'


def symbols(number: int, marks: Iterable[str]) -> str:
    """Marks of a line, in its colour."""
    paint = colour(number)
    return f'<g fill="{paint}" stroke="{paint}" stroke-width="1.5">{"".join(marks)}</g>'


def symbol(number: int, x: float, y: float, size: float, *, full: bool, title: str = "") -> str:
    """The mark of a run, among `symbols`; `full` where it is on the front."""
    look = "" if full else f' fill="{PAPER}"'
    return f'<path d="{mark(number, x, y, size)}"{look}>{_title(title)}</path>'


def _title(text: str) -> str:
    return f"<title>{markup_text(text)}</title>" if text else ""


def bar(low: float, high: float, y: float) -> str:
    """The path of an interval, with an end at each side."""
    return f"M{low:.1f} {y:.1f}H{high:.1f}M{low:.1f} {y - 3:.1f}v6M{high:.1f} {y - 3:.1f}v6"


def ring(x: float, y: float, radius: float) -> str:
    """The ring around the scene's own setting."""
    look = f'fill="none" stroke="{OWN_COLOUR}" stroke-width="1.8"'
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:g}" {look}/>'


def key(entries: Iterable[Entry], left: float, top: float, width: float) -> tuple[str, float]:
    """The key, in rows, and the place where it ends."""
    parts: list[str] = []
    x, y = left, top
    for entry in entries:
        text = shorten_to_width(entry.text, width - left - 40, TICK_SIZE)
        entry_width = 30 + text_width(text, TICK_SIZE) + 10
        if x > left and x + entry_width > width:
            x, y = left, y + ROW
        parts += _key_mark(entry, x + 14, y - 4)
        parts.append(label(x + 30, y, text, FINE))
        x += entry_width
    return "".join(parts), y + 6


def _key_mark(entry: Entry, x: float, y: float) -> Iterator[str]:
    """The mark that stands before an entry of the key."""
    if entry.number is not None:
        yield path(f"M{x - 13:.1f} {y:.1f}h26", line_look(entry.number))
        yield symbols(entry.number, [symbol(entry.number, x, y, MARK, full=True)])
    elif entry.kind == "own":
        yield ring(x, y, 6)
    elif entry.kind == "lost":
        yield cross(x, y, INK)
    else:
        full = INK if entry.kind == "front" else PAPER
        look = f'fill="{full}" stroke="{INK}" stroke-width="1.5"'
        yield area(mark(0, x, y, SMALL if entry.kind == "other" else MARK), look)


def svg(body: str, size: tuple[float, float], name: str, texts: tuple[str, str]) -> str:
    """A drawing as an element; `texts`: its title, and its description for screen readers."""
    key = markup_text(name.replace("/", "-"))  # a name in XML has no slash
    title, text = map(markup_text, texts)
    return (
        f'<svg class="work-precision" viewBox="0 0 {size[0]:g} {size[1]:g}" '
        f'role="img" aria-labelledby="{key}-title {key}-text" fill="currentColor" '
        f'font-size="{SIZE:g}" font-family="{_FONT}"><title id="{key}-title">{title}'
        f'</title><desc id="{key}-text">{text}</desc>{body}</svg>'
    )
