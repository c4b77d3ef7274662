"""Layouts of directed graphs without cycles, in layers: what comes first stands above.

Entry points: `layered(nodes, edges, …)`, `reduced(nodes, edges)`.

The method is that of Sugiyama, Tagawa and Toda (IEEE Trans. Syst., Man, Cybern. 11(2), 1981):

1. A node stands one layer below the lowest of those that it comes from; one that comes from nothing
   stands just above the highest of those that it leads to.
2. An edge that passes layers gets a place in each of them.
3. The layers are ordered by the mean place of their neighbours above and below in turn; the order
   with the fewest crossings counts.
4. In each layer the places are those next to the means of the neighbours that keep the order and
   the distances: an isotonic regression, solved by pooling.

The same graph gives the same layout: ties go by the order in which the nodes are given.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import TypeAlias

from msgspec import Struct

Edge: TypeAlias = tuple[str, str]
_Point: TypeAlias = str | tuple[str, str, int]
"""A node, or the place of an edge in a layer."""

_SWEEPS = 12
_PLACINGS = 40
_BOTH_SIDES = 32
"""Of the placings, the last, which look at the layers above and below at once."""
_STRAIGHT = 20.0
"""How much more an arrow counts between two of which each has no other on that side."""


class PlacedNode(Struct, frozen=True):
    """A node with the middle of its place."""

    id: str
    x: float
    layer: int


class PlacedEdge(Struct, frozen=True):
    """An edge, by the places that it goes through from layer to layer."""

    start: str
    end: str
    xs: tuple[float, ...]


class Layout(Struct, frozen=True):
    """A graph laid out; its left edge is at 0."""

    nodes: tuple[PlacedNode, ...]
    edges: tuple[PlacedEdge, ...]
    width: float
    layers: int


def reduced(nodes: Sequence[str], edges: Iterable[Edge]) -> tuple[Edge, ...]:
    """The edges but those that say no more than a longer way along others does."""
    known = set(nodes)
    after: dict[str, list[str]] = {node: [] for node in nodes}
    kept = [(a, b) for a, b in dict.fromkeys(edges) if a in known and b in known]
    for a, b in kept:
        after[a].append(b)
    far: dict[str, set[str]] = {}

    def beyond(node: str) -> set[str]:
        waiting = [node]
        while waiting:
            at = waiting[-1]
            missing = [following for following in after[at] if following not in far]
            if missing:
                waiting += missing
                continue
            waiting.pop()
            far[at] = set(after[at]).union(*(far[following] for following in after[at]))
        return far[node]

    return tuple((a, b) for a, b in kept if not any(b in beyond(c) for c in after[a] if c != b))


def layered(
    nodes: Sequence[str], edges: Sequence[Edge], width: float, gap: float, passing: float
) -> Layout:
    """The layout of a graph.

    Args:
        nodes: in the order that ties go by.
        edges: between these nodes, without a cycle.
        width: of a node, in the units of the drawing.
        gap: the least room between two things in a layer.
        passing: room for an edge that passes a layer.
    """
    layer = _layers(nodes, edges)
    rows: list[list[_Point]] = [[] for _ in range(max(layer.values(), default=-1) + 1)]
    for node in nodes:
        rows[layer[node]].append(node)
    ways: list[tuple[Edge, list[_Point]]] = []
    for a, b in edges:
        between: list[_Point] = [(a, b, level) for level in range(layer[a] + 1, layer[b])]
        for level, point in enumerate(between, layer[a] + 1):
            rows[level].append(point)
        ways.append(((a, b), [a, *between, b]))
    links = [pair for _, way in ways for pair in pairwise(way)]
    above = _neighbours(links, upwards=True)
    below = _neighbours(links, upwards=False)
    rows = _ordered(rows, above, below)
    half = {p: (width if isinstance(p, str) else passing) / 2 for row in rows for p in row}
    x = _placed(rows, above, below, half, gap)
    left = min((x[point] - half[point] for point in x), default=0.0)
    right = max((x[point] + half[point] for point in x), default=0.0)
    return Layout(
        tuple(PlacedNode(node, x[node] - left, layer[node]) for node in nodes),
        tuple(PlacedEdge(*edge, tuple(x[p] - left for p in way)) for edge, way in ways),
        right - left,
        len(rows),
    )


def _layers(nodes: Sequence[str], edges: Sequence[Edge]) -> dict[str, int]:
    before: dict[str, list[str]] = {node: [] for node in nodes}
    after: dict[str, list[str]] = {node: [] for node in nodes}
    for a, b in edges:
        before[b].append(a)
        after[a].append(b)
    missing = {node: len(before[node]) for node in nodes}
    ready = [node for node in nodes if not missing[node]]
    found: dict[str, int] = {}
    for node in ready:  # which grows meanwhile
        found[node] = max((found[b] + 1 for b in before[node]), default=0)
        for following in after[node]:
            missing[following] -= 1
            if not missing[following]:
                ready.append(following)
    for node in nodes:
        if not before[node] and after[node]:
            found[node] = min(found[following] for following in after[node]) - 1
    return found


def _neighbours(
    links: Sequence[tuple[_Point, _Point]], *, upwards: bool
) -> dict[_Point, list[_Point]]:
    found: dict[_Point, list[_Point]] = {}
    for a, b in links:
        found.setdefault(b if upwards else a, []).append(a if upwards else b)
    return found


def _ordered(
    rows: list[list[_Point]],
    above: Mapping[_Point, list[_Point]],
    below: Mapping[_Point, list[_Point]],
) -> list[list[_Point]]:
    best, fewest = rows, _crossings(rows, below)
    for sweep in range(_SWEEPS):
        if not fewest:
            break
        down = sweep % 2 == 0
        near = above if down else below
        rows = [list(row) for row in rows]
        order = range(1, len(rows)) if down else range(len(rows) - 2, -1, -1)
        for level in order:
            beside = rows[level - 1] if down else rows[level + 1]
            place = {point: float(at) for at, point in enumerate(beside)}
            means = {
                point: _mean([place[other] for other in near.get(point, ())], float(at))
                for at, point in enumerate(rows[level])
            }
            rows[level].sort(key=means.__getitem__)
        crossings = _crossings(rows, below)
        if crossings < fewest:
            best, fewest = rows, crossings
    return best


def _crossings(rows: Sequence[list[_Point]], below: Mapping[_Point, list[_Point]]) -> int:
    count = 0
    for upper, lower in pairwise(rows):
        place = {point: at for at, point in enumerate(lower)}
        seen: list[int] = []
        for point in upper:
            ends = sorted(place[other] for other in below.get(point, ()))
            count += sum(len(seen) - bisect_right(seen, end) for end in ends)
            for end in ends:
                insort(seen, end)
    return count


def _placed(
    rows: Sequence[list[_Point]],
    above: Mapping[_Point, list[_Point]],
    below: Mapping[_Point, list[_Point]],
    half: Mapping[_Point, float],
    gap: float,
) -> dict[_Point, float]:
    x: dict[_Point, float] = {}
    steps: list[list[float]] = []
    for row in rows:
        at, places = 0.0, []
        for point in row:
            places.append(at + half[point])
            at += 2 * half[point] + gap
        middle = (at - gap) / 2
        steps.append(places)
        x |= {point: place - middle for point, place in zip(row, places, strict=True)}
    pulls = _pulls(above, below), _pulls(below, above)
    for placing in range(_PLACINGS):
        down = placing % 2 == 0
        sides = pulls if placing >= _PLACINGS - _BOTH_SIDES else pulls[:1] if down else pulls[1:]
        for level in range(len(rows)) if down else reversed(range(len(rows))):
            row, places = rows[level], steps[level]
            offsets = [
                _pulled(x, point, sides) - place for point, place in zip(row, places, strict=True)
            ]
            fitted = zip(row, places, _rising(offsets), strict=True)
            x |= {point: place + offset for point, place, offset in fitted}
    return x


def _pulls(
    near: Mapping[_Point, list[_Point]], far: Mapping[_Point, list[_Point]]
) -> dict[_Point, list[tuple[_Point, float]]]:
    """The neighbours on one side with their weights; `far` has those of the other side."""
    return {
        point: [
            (other, _STRAIGHT if len(others) == len(far[other]) == 1 else 1.0) for other in others
        ]
        for point, others in near.items()
    }


def _pulled(
    x: Mapping[_Point, float],
    point: _Point,
    sides: Sequence[Mapping[_Point, list[tuple[_Point, float]]]],
) -> float:
    """Where a point would best be; where it is if it has no neighbours."""
    pairs = [pair for side in sides for pair in side.get(point, ())]
    if not pairs:
        return x[point]
    return sum(weight * x[other] for other, weight in pairs) / sum(weight for _, weight in pairs)


def _rising(values: Sequence[float]) -> list[float]:
    """The rising sequence that is nearest in the mean square: pools of neighbours that fall."""
    pools: list[tuple[float, int]] = []
    for value in values:
        total, count = value, 1
        while pools and pools[-1][0] * count >= total * pools[-1][1]:
            more, members = pools.pop()
            total, count = total + more, count + members
        pools.append((total, count))
    return [total / count for total, count in pools for _ in range(count)]


def _mean(values: Sequence[float], otherwise: float) -> float:
    return sum(values) / len(values) if values else otherwise
