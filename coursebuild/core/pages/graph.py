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
from collections.abc import Iterable, Mapping, Sequence
from graphlib import TopologicalSorter
from itertools import accumulate, combinations, pairwise, product
from statistics import fmean
from typing import TypeAlias

from msgspec import Struct

from coursebuild.core.drawing.scales import shorten_to_width, text_width
from coursebuild.core.model import Lesson, Level
from coursebuild.core.pages import urls
from coursebuild.core.pages.context import GraphNode, LessonGraph
from coursebuild.core.pages.library import Library

_MOST_LINKED = 5
"""The most prerequisites that are shown of a lesson, and the most lessons it leads to."""
_MOST_NEIGHBOURS = 12
"""The most lessons in a neighbourhood, unless direct neighbours alone are more."""
_MOST_IN_LEVEL = 40
"""The most lessons of a level in a drawing; as many again may be of other levels."""


class _Look(Struct, frozen=True):
    """Sizes in the units of the drawing, which are the pixels of CSS."""

    name: str
    width: float
    height: float
    gap: float
    step: float


_WIDE, _NARROW = _Look("wide", 132, 56, 12, 92), _Look("narrow", 50, 30, 5, 58)
_SIZE = 12.0
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


class DrawnNode(Struct, frozen=True):
    """A node with the middle of its upper edge, and the lines of its title."""

    node: GraphNode
    x: float
    top: float
    lines: list[str]


class Drawing(Struct, frozen=True):
    """A graph as `partials/graph.html` draws it."""

    name: str
    """`wide`, with titles, or `narrow`, without."""
    width: float
    height: float
    node_width: float
    node_height: float
    edges: str
    """The path of all arrows, and that of their heads."""
    heads: str
    nodes: tuple[DrawnNode, ...]


def drawings(graph: LessonGraph) -> tuple[Drawing, Drawing]:
    """The drawing with titles and the one without, both with the same layout."""
    numbers = {node.id: number for number, node in enumerate(graph.nodes)}
    edges = tuple((numbers[a], numbers[b]) for a, b in graph.edges)
    layout = layered_layout(len(numbers), edges, _CROSSING_WIDTH)
    return _drawing(graph, layout, _WIDE), _drawing(graph, layout, _NARROW)


def _drawing(graph: LessonGraph, layout: Layout, look: _Look) -> Drawing:
    node_width = max(look.width, 26 + max(text_width(node.id, _SIZE) for node in graph.nodes))
    unit, edges, heads = node_width + look.gap, "", ""
    left = _EDGE - look.gap / 2
    for edge in layout.edges:
        xs = [left + x * unit for x in edge.xs]
        top = _EDGE + edge.layer * look.step
        edges += f"M{xs[0]:.1f} {top + look.height:.1f}"
        for x, following in pairwise(xs):
            bend = top + (look.height + look.step) / 2
            top += look.step
            edges += f"C{x:.1f} {bend:.1f} {following:.1f} {bend:.1f} {following:.1f} {top:.1f}"
            edges += f"v{look.height:g}"  # behind the node, at the end
        heads += f"M{xs[-1] - 4:.1f} {top - 7:.1f}l4 7 4-7z"
    nodes = (
        DrawnNode(
            node,
            left + place.x * unit,
            _EDGE + place.layer * look.step,
            _title_lines(node.title, node_width - 12) if look is _WIDE else [],
        )
        for node, place in zip(graph.nodes, layout.nodes, strict=True)
    )
    width = layout.width * unit - look.gap + 2 * _EDGE
    height = (layout.layers - 1) * look.step + look.height + 2 * _EDGE
    sizes = width, height, node_width, look.height
    return Drawing(look.name, *sizes, edges, heads, tuple(nodes))


def _title_lines(title: str, room: float) -> list[str]:
    """A title on one line or on two, of which the second is cut."""
    line, words = "", title.split()
    while words and text_width(f"{line} {words[0]}".strip(), _SIZE) <= room:
        line = f"{line} {words.pop(0)}".strip()
    return [text for text in (line, shorten_to_width(" ".join(words), room, _SIZE)) if text]


# --- layout

_Point: TypeAlias = int | tuple[int, int, int]
"""A node, or an edge where it crosses a layer."""

_SWEEPS = 12
_PASSES = 40


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
    neighbours = {
        point: [*parents.get(point, ()), *children.get(point, ())] or [point]
        for point in half_widths
    }
    x = _place_points(rows, neighbours, half_widths)
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
        for level in range(1, len(rows)) if down else range(len(rows) - 2, -1, -1):
            fixed_row = rows[level - 1 if down else level + 1]
            places = {point: position for position, point in enumerate(fixed_row)}
            means = {
                point: fmean([places[n] for n in fixed_neighbours.get(point, ())] or [position])
                for position, point in enumerate(rows[level])
            }
            rows[level].sort(key=means.__getitem__)
        crossings = _crossings(rows, children)
        if crossings < fewest:
            best, fewest = rows, crossings
    return best


def _crossings(rows: Sequence[list[_Point]], children: Mapping[_Point, list[_Point]]) -> int:
    count = 0
    for upper, lower in pairwise(rows):
        places = {point: position for position, point in enumerate(lower)}
        ends = [[places[child] for child in children.get(point, ())] for point in upper]
        pairs = (pair for a, b in combinations(ends, 2) for pair in product(a, b))
        count += sum(first > second for first, second in pairs)
    return count


def _place_points(
    rows: Sequence[list[_Point]],
    neighbours: Mapping[_Point, list[_Point]],
    half_widths: Mapping[_Point, float],
) -> dict[_Point, float]:
    x: dict[_Point, float] = {}
    steps: list[list[float]] = []
    for row in rows:
        ends = list(accumulate((2 * half_widths[point] for point in row), initial=0.0))
        steps.append([(start + end) / 2 for start, end in pairwise(ends)])
        x |= {p: place - ends[-1] / 2 for p, place in zip(row, steps[-1], strict=True)}
    for number in range(_PASSES):
        levels = range(len(rows))
        for level in reversed(levels) if number % 2 else levels:
            row, places = rows[level], steps[level]
            near = ([x[neighbour] for neighbour in neighbours[p]] for p in row)
            offsets = [fmean(xs) - place for xs, place in zip(near, places, strict=True)]
            fitted = zip(row, places, _isotonic_regression(offsets), strict=True)
            x |= {point: place + offset for point, place, offset in fitted}
    return x


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
