"""Which items of one sequence correspond to which of another: an alignment that stays affordable.

Entry point: `pair`.

1. Items that match at the start and at the end are paired.
2. What is left is aligned for the greatest sum of weights by dynamic programming (Needleman and
   Wunsch, J. Mol. Biol. 48, 1970) where the table is small.
3. A large rest is first cut at items that occur once on either side (patience diff); what remains
   too large even so is paired item by item.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Sequence

Weight = Callable[[int, int], int]
_Pairs = list[tuple[int, int]]

MATCH = 8
"""The weight of a pair that matches; smaller ones are for items that are alike, 0 for no pair."""

_CELLS = 250_000
"""Cells of a table of dynamic programming."""


def pair(
    left: Sequence[str], right: Sequence[str], weight: Weight, free: Sequence[bool] = ()
) -> _Pairs:
    """Pairs `(i, j)`, growing in both, of items that correspond.

    `weight(i, j)` is `MATCH` for items that match, less for items that are alike, 0 for others.
    `free[i]` says that right items left out before left item `i` (or at the end) cost nothing.
    """
    free = free or [False] * (len(left) + 1)
    pairs: _Pairs = []
    regions = [(0, len(left), 0, len(right))]
    while regions:
        i0, i1, j0, j1 = regions.pop()
        while i0 < i1 and j0 < j1 and not free[i0] and weight(i0, j0) == MATCH:
            pairs.append((i0, j0))
            i0, j0 = i0 + 1, j0 + 1
        while i0 < i1 and j0 < j1 and not free[i1] and weight(i1 - 1, j1 - 1) == MATCH:
            i1, j1 = i1 - 1, j1 - 1
            pairs.append((i1, j1))
        rows, columns = range(i0, i1), range(j0, j1)
        if len(rows) * len(columns) <= _CELLS:
            pairs += _best(rows, columns, weight, free)
        elif anchors := _anchors(left, rows, right, columns):
            pairs += anchors
            for i, j in [*anchors, (i1, j1)]:
                regions.append((i0, i, j0, j))
                i0, j0 = i + 1, j + 1
        else:
            pairs += [(i, j) for i, j in zip(rows, columns, strict=False) if weight(i, j)]
    return sorted(pairs)


def _best(rows: range, columns: range, weight: Weight, free: Sequence[bool]) -> _Pairs:
    """The pairs of greatest weight; an item left out costs 1. Of equal choices, the earliest."""
    n, m = len(rows), len(columns)
    weights = [[weight(i, j) for j in columns] for i in rows]
    cost = [0 if free[rows.start + i] else 1 for i in range(n + 1)]
    score = [[0] * (m + 1) for _ in range(n + 1)]
    score[n] = [-cost[n] * (m - j) for j in range(m + 1)]
    for i in range(n - 1, -1, -1):
        row, below, row_weights, extra = score[i], score[i + 1], weights[i], cost[i]
        row[m] = below[m] - 1
        for j in range(m - 1, -1, -1):
            best = max(below[j] - 1, row[j + 1] - extra)
            w = row_weights[j]
            row[j] = w + below[j + 1] if w and w + below[j + 1] >= best else best
    pairs: _Pairs = []
    i = j = 0
    while i < n and j < m:
        w = weights[i][j]
        if w and score[i][j] == w + score[i + 1][j + 1]:
            pairs.append((rows[i], columns[j]))
            i, j = i + 1, j + 1
        elif score[i][j] == score[i][j + 1] - cost[i]:
            j += 1
        else:
            i += 1
    return pairs


def _anchors(left: Sequence[str], rows: range, right: Sequence[str], columns: range) -> _Pairs:
    """Items that occur once on either side, the longest chain that grows in both."""
    left_count = Counter(left[i] for i in rows)
    right_count = Counter(right[j] for j in columns)
    where = {right[j]: j for j in columns if right_count[right[j]] == 1}
    found = [(i, where[left[i]]) for i in rows if left_count[left[i]] == 1 and left[i] in where]
    # For each length, the least place on the right at which a chain of that length ends.
    tails: list[int] = []
    lengths: list[int] = []
    for _, j in found:
        length = bisect_left(tails, j)
        tails[length : length + 1] = [j]
        lengths.append(length)
    chain: _Pairs = []
    wanted = len(tails) - 1
    for (i, j), length in zip(reversed(found), reversed(lengths), strict=True):
        if length == wanted and (not chain or j < chain[-1][1]):
            chain.append((i, j))
            wanted -= 1
    return chain[::-1]
