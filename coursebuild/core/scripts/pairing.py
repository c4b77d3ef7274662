"""Which items of one sequence correspond to which of another: an alignment that stays affordable.

Entry point: `pair`.

1. Items that match at the start and at the end are paired.
2. What is left is aligned for the greatest sum of weights by dynamic programming (Needleman and
   Wunsch, J. Mol. Biol. 48, 1970) where the table is small.
3. A large rest is first cut at items that occur once on either side (patience diff), by their
   exact keys and then by their skeletons; what remains too large is paired item by item.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Hashable, Sequence

from msgspec import Struct

Weight = Callable[[int, int], int]

MATCH = 8
"""The weight of a pair that matches; smaller ones are for items that are alike, 0 for no pair."""

_CELLS = 40_000
"""Cells of a table of dynamic programming."""
_ALL_CELLS = 400_000
"""Cells of all tables of one alignment."""


class Keys(Struct, frozen=True):
    """What makes items of a sequence recognisable: equal keys, equal items."""

    exact: Sequence[Hashable]
    skeleton: Sequence[Hashable]


class _Region(Struct, frozen=True):
    """The stretches `[i0, i1)` and `[j0, j1)` that are still to be aligned."""

    i0: int
    i1: int
    j0: int
    j1: int

    @property
    def cells(self) -> int:
        return (self.i1 - self.i0) * (self.j1 - self.j0)


class _Aligner:
    def __init__(self, left: Keys, right: Keys, weight: Weight, free: Sequence[bool]) -> None:
        self.left, self.right, self.weight, self.free = left, right, weight, free
        self.pairs: list[tuple[int, int]] = []
        self.cells_left = _ALL_CELLS

    def run(self) -> tuple[tuple[int, int], ...]:
        todo = [_Region(0, len(self.left.exact), 0, len(self.right.exact))]
        while todo:
            region = self._trimmed(todo.pop())
            if region.cells == 0:
                continue
            if region.cells <= min(_CELLS, self.cells_left):
                self.cells_left -= region.cells
                self.pairs += _best(region, self.weight, self.free)
                continue
            anchors = _anchors(region, self.left.exact, self.right.exact) or _anchors(
                region, self.left.skeleton, self.right.skeleton
            )
            if anchors:
                self.pairs += anchors
                todo += _between(region, anchors)
            else:
                self._in_step(region)
        return tuple(sorted(self.pairs))

    def _trimmed(self, region: _Region) -> _Region:
        """Pair what matches at the ends, up to where items on the right may be left out."""
        i0, i1, j0, j1 = region.i0, region.i1, region.j0, region.j1
        while i0 < i1 and j0 < j1 and not self.free[i0] and self.weight(i0, j0) == MATCH:
            self.pairs.append((i0, j0))
            i0, j0 = i0 + 1, j0 + 1
        while i0 < i1 and j0 < j1 and not self.free[i1] and self.weight(i1 - 1, j1 - 1) == MATCH:
            i1, j1 = i1 - 1, j1 - 1
            self.pairs.append((i1, j1))
        return _Region(i0, i1, j0, j1)

    def _in_step(self, region: _Region) -> None:
        for i, j in zip(range(region.i0, region.i1), range(region.j0, region.j1), strict=False):
            if self.weight(i, j) > 0:
                self.pairs.append((i, j))


def pair(
    left: Keys, right: Keys, weight: Weight, free: Sequence[bool] | None = None
) -> tuple[tuple[int, int], ...]:
    """Pairs `(i, j)`, growing in both, of items that correspond.

    `weight(i, j)` is `MATCH` for items that match, less for items that are alike, 0 for others.
    `free[i]` says that right items left out before left item `i` (or at the end) cost nothing.
    """
    boundaries = [False] * (len(left.exact) + 1) if free is None else free
    return _Aligner(left, right, weight, boundaries).run()


def _best(region: _Region, weight: Weight, free: Sequence[bool]) -> list[tuple[int, int]]:
    """The pairs of greatest weight; an item left out costs 1. Of equal choices, the earliest."""
    n, m = region.i1 - region.i0, region.j1 - region.j0
    weights = [[weight(region.i0 + i, region.j0 + j) for j in range(m)] for i in range(n)]
    cost = [0 if free[region.i0 + i] else 1 for i in range(n + 1)]
    score = [[0] * (m + 1) for _ in range(n + 1)]
    score[n] = [-cost[n] * (m - j) for j in range(m + 1)]
    for i in range(n - 1, -1, -1):
        row, below, row_weights, extra = score[i], score[i + 1], weights[i], cost[i]
        row[m] = below[m] - 1
        for j in range(m - 1, -1, -1):
            best = max(below[j] - 1, row[j + 1] - extra)
            w = row_weights[j]
            row[j] = w + below[j + 1] if w and w + below[j + 1] >= best else best
    pairs: list[tuple[int, int]] = []
    i = j = 0
    while i < n and j < m:
        w = weights[i][j]
        if w and score[i][j] == w + score[i + 1][j + 1]:
            pairs.append((region.i0 + i, region.j0 + j))
            i, j = i + 1, j + 1
        elif score[i][j] == score[i][j + 1] - cost[i]:
            j += 1
        else:
            i += 1
    return pairs


def _anchors(
    region: _Region, left: Sequence[Hashable], right: Sequence[Hashable]
) -> list[tuple[int, int]]:
    """Items that occur once on either side of a region, the longest chain that grows in both."""
    left_count = Counter(left[region.i0 : region.i1])
    right_count = Counter(right[region.j0 : region.j1])
    where = {right[j]: j for j in range(region.j0, region.j1) if right_count[right[j]] == 1}
    candidates = [
        (i, where[left[i]])
        for i in range(region.i0, region.i1)
        if left_count[left[i]] == 1 and left[i] in where
    ]
    tails: list[int] = []
    chain: list[int] = []
    before: list[int] = []
    for index, (_, j) in enumerate(candidates):
        length = bisect_left(tails, j)
        before.append(chain[length - 1] if length else -1)
        if length == len(tails):
            tails.append(j)
            chain.append(index)
        else:
            tails[length], chain[length] = j, index
    found: list[tuple[int, int]] = []
    index = chain[-1] if chain else -1
    while index >= 0:
        found.append(candidates[index])
        index = before[index]
    return found[::-1]


def _between(region: _Region, anchors: Sequence[tuple[int, int]]) -> list[_Region]:
    regions: list[_Region] = []
    i0, j0 = region.i0, region.j0
    for i, j in anchors:
        regions.append(_Region(i0, i, j0, j))
        i0, j0 = i + 1, j + 1
    return [*regions, _Region(i0, region.i1, j0, region.j1)]
