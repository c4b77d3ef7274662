"""Layouts of directed acyclic graphs in layers, with predecessors above.

The method is that of Sugiyama, Tagawa and Toda (IEEE Trans. Syst., Man, Cybern. 11(2), 1981):

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

from msgspec import Struct

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
    layers = _assign_layers(count, edges)
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


def _assign_layers(count: int, edges: Iterable[tuple[int, int]]) -> list[int]:
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
    return layers


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
