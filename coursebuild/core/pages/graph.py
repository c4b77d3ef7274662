"""Graphs of lessons that build on each other, as small drawings whose nodes are links.

A drawing is never the only source: the page also lists the lessons with their titles. Arrows that a
longer path implies are left out, and so are nodes beyond a limit.

Nodes stand in layers, with predecessors above. The method is that of Sugiyama, Tagawa and Toda
(IEEE Trans. Syst., Man, Cybern. 11(2), 1981):

1. A node is one layer below the lowest of its predecessors; one without any is just above the
   highest of its successors.
2. An edge that crosses layers gets a place in each of them.
3. The layers are ordered by the mean place of their neighbours above and below in turn; the order
   with the fewest crossings wins.
4. In each layer, places are as near to the means of the neighbours as order and distances allow: an
   isotonic regression, solved by pooling.

The same graph gives the same layout: ties are broken by the order of the nodes.
"""

from __future__ import annotations

import functools
from bisect import bisect_right, insort
from collections.abc import Iterable, Mapping, Sequence
from graphlib import TopologicalSorter
from itertools import pairwise
from typing import TypeAlias

from markupsafe import Markup, escape
from msgspec import Struct

from coursebuild.core.drawing.scales import markup_text, shorten_to_width, text_width
from coursebuild.core.model import Lesson, Level
from coursebuild.core.pages import urls
from coursebuild.core.pages.context import GraphNode, LessonGraph
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.renderer import Strings

_MOST_LINKED = 5
"""The most prerequisites that are shown of a lesson, and the most lessons it leads to."""
_MOST_NEIGHBOURS = 12
"""The most lessons in a neighbourhood, unless direct neighbours alone are more."""
_MOST_IN_LEVEL = 40
"""The most lessons of a level in a drawing; as many again may be of other levels."""


class _Look(Struct, frozen=True):
    """Sizes in the units of the drawing, which are the pixels of CSS."""

    width: float
    height: float
    gap: float
    step: float
    titles: bool


_WIDE = _Look(132, 56, 12, 92, True)
_NARROW = _Look(50, 30, 5, 58, False)
_SIZE = 12.0
_LINE = 15.0
_CROSSING_WIDTH = 0.2
"""Room for an arrow that crosses a layer, in widths of nodes."""
_EDGE = 2.0
"""Room for the lines around nodes at the edge of a drawing."""


def neighbourhood(library: Library, place: urls.Place, lesson: Lesson) -> LessonGraph | None:
    """The prerequisites of a lesson, theirs, and what it leads to; `None` if too few."""
    # The last ones in the course, since the nearest prerequisites matter most.
    needs = sorted(lesson.prerequisites, key=library.positions.__getitem__)[-_MOST_LINKED:]
    leads = [follower.id for follower in library.leads[lesson.id]][:_MOST_LINKED]
    ids = dict.fromkeys([lesson.id, *needs, *leads])
    for need in needs:
        for further in library.lessons[need].prerequisites:
            if len(ids) < _MOST_NEIGHBOURS:
                ids.setdefault(further)
    return _graph(library, place, ids, current=lesson.id) if len(ids) > 2 else None


def level_graph(library: Library, place: urls.Place, level: Level) -> LessonGraph | None:
    """The lessons of a level, with their prerequisites of other levels."""
    own_ids = dict.fromkeys(lesson.id for lesson in level.lessons)
    if not 2 < len(own_ids) <= _MOST_IN_LEVEL:
        return None
    needed_ids = dict.fromkeys(
        need for lesson in level.lessons for need in lesson.prerequisites if need not in own_ids
    )
    ids = own_ids | needed_ids if len(needed_ids) <= _MOST_IN_LEVEL else own_ids
    graph = _graph(library, place, ids, level=level.id)
    return graph if graph.edges else None


def _graph(
    library: Library,
    place: urls.Place,
    wanted_ids: Iterable[str],
    *,
    current: str = "",
    level: str | None = None,
) -> LessonGraph:
    lessons = [library.lessons[id] for id in sorted(wanted_ids, key=library.positions.__getitem__)]
    ids = [lesson.id for lesson in lessons]
    edges = transitive_reduction(
        ids, ((n, dependent.id) for dependent in lessons for n in dependent.prerequisites)
    )
    return LessonGraph(
        tuple(
            GraphNode(
                lesson.id,
                lesson.title,
                place.href(urls.lesson_path(lesson)),
                lesson.status,
                lesson.id == current,
                level is not None and lesson.level != level,
            )
            for lesson in lessons
        ),
        edges,
    )


# --- drawing


def drawings(graph: LessonGraph, words: Strings) -> tuple[Markup, Markup]:
    """The drawing with titles and the one without, both with the same layout."""
    numbers = {node.id: number for number, node in enumerate(graph.nodes)}
    edges = tuple((numbers[a], numbers[b]) for a, b in graph.edges)
    layout = layered_layout(len(numbers), edges, _CROSSING_WIDTH)
    return _drawing(graph, layout, words, _WIDE), _drawing(graph, layout, words, _NARROW)


def _drawing(graph: LessonGraph, layout: Layout, words: Strings, look: _Look) -> Markup:
    longest = max(text_width(node.id, _SIZE) for node in graph.nodes)
    wide = max(look.width, longest + 26)
    unit = wide + look.gap
    width = layout.width * unit - look.gap + 2 * _EDGE
    height = (layout.layers - 1) * look.step + look.height + 2 * _EDGE
    name = "wide" if look.titles else "narrow"
    parts = [
        f'<svg class="graph-{name}" width="{width:.0f}" height="{height:.0f}" role="group"'
        f' aria-label="{escape(words("graph.label"))}">',
    ]
    lines, heads = [], []
    for edge in layout.edges:
        xs = [_x(x, unit, look) for x in edge.xs]
        top = _EDGE + edge.layer * look.step
        path = [f"M{xs[0]:.1f} {top + look.height:.1f}"]
        for number, (x, following) in enumerate(pairwise(xs), 1):
            start, top = top + look.height, top + look.step
            bend = (start + top) / 2
            path.append(f"C{x:.1f} {bend:.1f} {following:.1f} {bend:.1f} {following:.1f} {top:.1f}")
            if number < len(xs) - 1:
                path.append(f"v{look.height:.1f}")
        lines.append("".join(path))
        heads.append(f"M{xs[-1] - 4:.1f} {top - 7:.1f}l4 7 4-7z")
    if lines:
        parts.append(f'<path class="edges" d="{"".join(lines)}"/>')
        parts.append(f'<path class="heads" d="{"".join(heads)}"/>')
    for node, placed_node in zip(graph.nodes, layout.nodes, strict=True):
        x, top = _x(placed_node.x, unit, look), _EDGE + placed_node.layer * look.step
        parts.append(_node(node, x, top, wide, words, look))
    return Markup("".join((*parts, "</svg>")))


def _x(place: float, unit: float, look: _Look) -> float:
    return place * unit - look.gap / 2 + _EDGE


def _node(node: GraphNode, x: float, top: float, width: float, words: Strings, look: _Look) -> str:
    """A node, its middle at `x`, with its status as a full or half disc, or a ring."""
    kinds = f"node node-{node.status}" + (" node-outside" if node.outside else "")
    left, middle = x - width / 2, top + look.height / 2
    texts: list[str] = []
    if look.titles:
        room, line, title_words = width - 12, "", node.title.split()
        while title_words and text_width(f"{line} {title_words[0]}".strip(), _SIZE) <= room:
            line = f"{line} {title_words.pop(0)}".strip()
        lines = (line, shorten_to_width(" ".join(title_words), room, _SIZE))
        texts = [text for text in lines if text]
    first = middle + 4.3 - len(texts) * _LINE / 2
    id_x, mark_x, mark_y = x, left + 10, top + 10
    if not look.titles:  # the mark is on the line of the number
        id_x += 5.5
        mark_x, mark_y = id_x - text_width(node.id, _SIZE) / 2 - 7, middle
    inner = [
        f'<rect x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{look.height:.1f}"'
        ' rx="3"/>',
        f'<circle class="ring" cx="{mark_x:.1f}" cy="{mark_y:.1f}" r="3.5"/>',
    ]
    if node.status == "complete":
        inner.append(f'<circle class="done" cx="{mark_x:.1f}" cy="{mark_y:.1f}" r="3.5"/>')
    elif node.status == "draft":
        half = f"M{mark_x:.1f} {mark_y - 3.5:.1f}a3.5 3.5 0 0 0 0 7z"
        inner.append(f'<path class="done" d="{half}"/>')
    inner.append(
        f'<text class="node-id" x="{id_x:.1f}" y="{first:.1f}">{markup_text(node.id)}</text>'
    )
    for number, text in enumerate(texts, 1):
        y = first + number * _LINE
        inner.append(f'<text x="{x:.1f}" y="{y:.1f}">{markup_text(text)}</text>')
    content = " ".join(inner)
    if node.current:
        return f'<g class="{kinds} node-current">{content}</g>'
    name = ""
    if not look.titles:  # otherwise the texts name it
        status = words(f"status.{node.status}")
        name = f' aria-label="{markup_text(f"{node.id} {node.title} ({status})")}"'
    return f'<a class="{kinds}" href="{escape(node.href)}"{name}>{content}</a>'


# --- layout

_Point: TypeAlias = int | tuple[int, int, int]
"""A node, or an edge where it crosses a layer."""

_SWEEPS = 12
_PASSES = 40
_BOTH_SIDES = 32
"""The last passes, which use the layers above and below at once."""
_STRAIGHT = 20.0
"""The weight of an edge that is the only one of both its ends on that side."""


class PlacedNode(Struct, frozen=True):
    """The place of a node: its middle, and its layer."""

    x: float
    layer: int


class PlacedEdge(Struct, frozen=True):
    """An edge, by the layer where it starts and its places from layer to layer."""

    layer: int
    xs: tuple[float, ...]


class Layout(Struct, frozen=True):
    """The layout of a graph, in widths of a node; its left edge is at 0."""

    nodes: tuple[PlacedNode, ...]
    edges: tuple[PlacedEdge, ...]
    width: float
    layers: int


def transitive_reduction(
    nodes: Iterable[str], edges: Iterable[tuple[str, str]]
) -> tuple[tuple[str, str], ...]:
    """The edges between these nodes, without those that a longer path of others implies."""
    successors: dict[str, list[str]] = {node: [] for node in nodes}
    known_edges = [e for e in dict.fromkeys(edges) if successors.keys() >= {*e}]
    for a, b in known_edges:
        successors[a].append(b)
    descendants: dict[str, set[str]] = {}
    for node in TopologicalSorter(successors).static_order():  # successors first
        below = (descendants[successor] for successor in successors[node])
        descendants[node] = set(successors[node]).union(*below)
    return tuple(
        (a, b) for a, b in known_edges if not any(b in descendants[c] for c in successors[a])
    )


@functools.lru_cache(maxsize=256)
def layered_layout(count: int, edges: tuple[tuple[int, int], ...], passing: float) -> Layout:
    """Lay out a graph without cycles; the order of nodes breaks ties.

    `passing` is the room, in widths of a node, for an edge that crosses a layer.
    """
    predecessors: dict[int, list[int]] = {node: [] for node in range(count)}
    successors: dict[int, list[int]] = {node: [] for node in range(count)}
    for a, b in edges:
        predecessors[b].append(a)
        successors[a].append(b)
    layers = [0] * count
    for node in TopologicalSorter(predecessors).static_order():
        layers[node] = max((layers[b] + 1 for b in predecessors[node]), default=0)
    for node in range(count):
        if not predecessors[node] and successors[node]:
            layers[node] = min(layers[successor] for successor in successors[node]) - 1
    rows: list[list[_Point]] = [[] for _ in range(max(layers, default=-1) + 1)]
    for node, layer in enumerate(layers):
        rows[layer].append(node)
    routes: list[list[_Point]] = []
    for a, b in edges:
        passing_points: list[_Point] = [(a, b, level) for level in range(layers[a] + 1, layers[b])]
        for level, point in enumerate(passing_points, layers[a] + 1):
            rows[level].append(point)
        routes.append([a, *passing_points, b])
    links = [pair for route in routes for pair in pairwise(route)]
    parents = _neighbours(links, upwards=True)
    children = _neighbours(links, upwards=False)
    rows = _order_rows(rows, parents, children)
    half_widths = {p: (1.0 if isinstance(p, int) else passing) / 2 for row in rows for p in row}
    x = _place_points(rows, parents, children, half_widths)
    left = min((x[point] - half_widths[point] for point in x), default=0.0)
    right = max((x[point] + half_widths[point] for point in x), default=0.0)
    return Layout(
        tuple(PlacedNode(x[node] - left, layer) for node, layer in enumerate(layers)),
        tuple(
            PlacedEdge(layers[a], tuple(x[point] - left for point in route))
            for (a, _), route in zip(edges, routes, strict=True)
        ),
        right - left,
        len(rows),
    )


def _neighbours(
    links: Sequence[tuple[_Point, _Point]], *, upwards: bool
) -> dict[_Point, list[_Point]]:
    neighbours: dict[_Point, list[_Point]] = {}
    for a, b in links:
        neighbours.setdefault(b if upwards else a, []).append(a if upwards else b)
    return neighbours


def _order_rows(
    rows: list[list[_Point]],
    parents: Mapping[_Point, list[_Point]],
    children: Mapping[_Point, list[_Point]],
) -> list[list[_Point]]:
    best, fewest = rows, _crossings(rows, children)
    for sweep in range(_SWEEPS):
        if not fewest:
            break
        down = sweep % 2 == 0
        fixed_neighbours = parents if down else children
        rows = [list(row) for row in rows]
        order = range(1, len(rows)) if down else range(len(rows) - 2, -1, -1)
        for level in order:
            fixed_row = rows[level - 1] if down else rows[level + 1]
            places = {point: float(position) for position, point in enumerate(fixed_row)}
            means: dict[_Point, float] = {}
            for position, point in enumerate(rows[level]):
                near = [places[neighbour] for neighbour in fixed_neighbours.get(point, ())]
                means[point] = sum(near) / len(near) if near else float(position)
            rows[level].sort(key=means.__getitem__)
        crossings = _crossings(rows, children)
        if crossings < fewest:
            best, fewest = rows, crossings
    return best


def _crossings(rows: Sequence[list[_Point]], children: Mapping[_Point, list[_Point]]) -> int:
    count = 0
    for upper, lower in pairwise(rows):
        places = {point: position for position, point in enumerate(lower)}
        ends_so_far: list[int] = []
        for point in upper:
            ends = sorted(places[neighbour] for neighbour in children.get(point, ()))
            count += sum(len(ends_so_far) - bisect_right(ends_so_far, end) for end in ends)
            for end in ends:
                insort(ends_so_far, end)
    return count


def _place_points(
    rows: Sequence[list[_Point]],
    parents: Mapping[_Point, list[_Point]],
    children: Mapping[_Point, list[_Point]],
    half_widths: Mapping[_Point, float],
) -> dict[_Point, float]:
    x: dict[_Point, float] = {}
    steps: list[list[float]] = []
    for row in rows:
        position, places = 0.0, []
        for point in row:
            places.append(position + half_widths[point])
            position += 2 * half_widths[point]
        middle = position / 2
        steps.append(places)
        x |= {point: place - middle for point, place in zip(row, places, strict=True)}
    weights = _weigh_neighbours(parents, children), _weigh_neighbours(children, parents)
    for number in range(_PASSES):
        down = number % 2 == 0
        sides = weights if number >= _PASSES - _BOTH_SIDES else weights[:1] if down else weights[1:]
        for level in range(len(rows)) if down else reversed(range(len(rows))):
            row, places = rows[level], steps[level]
            offsets = []
            for point, place in zip(row, places, strict=True):
                pairs = [pair for side in sides for pair in side.get(point, ())]
                best = x[point]  # without neighbours it stays where it is
                if pairs:
                    best = sum(weight * x[neighbour] for neighbour, weight in pairs)
                    best /= sum(weight for _, weight in pairs)
                offsets.append(best - place)
            fitted = zip(row, places, _isotonic_regression(offsets), strict=True)
            x |= {point: place + offset for point, place, offset in fitted}
    return x


def _weigh_neighbours(
    neighbours: Mapping[_Point, list[_Point]], opposite: Mapping[_Point, list[_Point]]
) -> dict[_Point, list[tuple[_Point, float]]]:
    """The neighbours on one side with their weights; `opposite` are their neighbours back."""
    return {
        point: [
            (neighbour, _STRAIGHT if len(points) == len(opposite[neighbour]) == 1 else 1.0)
            for neighbour in points
        ]
        for point, points in neighbours.items()
    }


def _isotonic_regression(values: Sequence[float]) -> list[float]:
    """The nearest rising sequence by least squares, found by pooling falling neighbours."""
    pools: list[tuple[float, int]] = []
    for value in values:
        total, count = value, 1
        while pools and pools[-1][0] * count >= total * pools[-1][1]:
            pool_total, members = pools.pop()
            total, count = total + pool_total, count + members
        pools.append((total, count))
    return [total / count for total, count in pools for _ in range(count)]
