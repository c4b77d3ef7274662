"""Which recorded line corresponds to which printed line.

1. A line of only `...` stands for any number of lines, or none. The recorded lines between two of
   them must be printed without a gap: the first block at the start, the last one at the end, each
   other one at its first place.
2. `align` pairs lines by weight: lines that match, lines that differ only in their numbers, lines
   that share at least half of their words. Lines in between that found no partner count as
   changed, one for one, and the rest as missing or extra; next to a recorded `...` line, printed
   lines are elided instead.
3. `pair` pairs what matches at the start and at the end, and aligns what is left for the greatest
   sum of weights by dynamic programming (Needleman and Wunsch, J. Mol. Biol. 48, 1970) where the
   table is small. A large rest is first cut at items that are equal on both sides; what remains too
   large even so is paired item by item.
"""

from __future__ import annotations

import difflib
import enum
from collections import Counter
from collections.abc import Callable, Sequence

from msgspec import Struct

from coursebuild.core.model import Comparison
from coursebuild.core.scripts.lines import LineMatcher, Side, find_in_order
from coursebuild.core.text.regex import regex

_ALIKE_WEIGHT = 6
_WORD = regex(r"[^\W\d]+")


class StepKind(enum.Enum):
    """What happens at one step through both sides."""

    SAME = "same"
    DIFFERS = "differs"
    MISSING = "missing"
    EXTRA = "extra"
    ELLIPSIS = "ellipsis"
    ELIDED = "elided"
    """A printed line that a `...` line stands for."""


class Step(Struct, frozen=True):
    """One step; the indices count lines from 0.

    For `EXTRA` and `ELIDED`, `recorded` is the line before which the line stands; for `MISSING` and
    `ELLIPSIS`, `printed` is the line that comes next.
    """

    kind: StepKind
    recorded: int
    printed: int


def same_lines(recorded: Side, printed: Side, comparison: Comparison) -> bool:
    """Whether the printed lines match the recorded ones."""
    if recorded.lines == printed.lines:
        return True
    matcher, lines = LineMatcher(comparison), printed.lines
    blocks: list[list[str]] = [[]]
    for line in recorded.lines:
        if matcher.elides_lines(line):
            blocks.append([])
        else:
            blocks[-1].append(line)

    def fits(block: int, place: int) -> bool:
        return all(matcher.matches(line, lines[place + i]) for i, line in enumerate(blocks[block]))

    if len(blocks) == 1:
        return len(lines) == len(blocks[0]) and fits(0, 0)
    return find_in_order(list(map(len, blocks)), len(lines), fits) is not None


def align(recorded: Side, printed: Side, matcher: LineMatcher) -> tuple[Step, ...]:
    """The steps that lead through both sides, in order."""
    literal = [i for i, line in enumerate(recorded.lines) if not matcher.elides_lines(line)]
    pairs = _line_pairs(recorded, literal, printed, matcher)
    steps: list[Step] = []
    i = j = 0
    for literal_index, printed_index in (*pairs, (len(literal), len(printed.lines))):
        stop = literal[literal_index] if literal_index < len(literal) else len(recorded.lines)
        elides = [matcher.elides_lines(line) for line in recorded.lines[i:stop]]
        if any(elides):
            for k, is_ellipsis in enumerate(elides, start=i):
                steps.append(Step(StepKind.ELLIPSIS if is_ellipsis else StepKind.MISSING, k, j))
                if is_ellipsis:
                    steps += (Step(StepKind.ELIDED, k + 1, n) for n in range(j, printed_index))
                    j = printed_index
        else:
            count = min(stop - i, printed_index - j)
            steps += (Step(StepKind.DIFFERS, i + k, j + k) for k in range(count))
            steps += (Step(StepKind.MISSING, k, printed_index) for k in range(i + count, stop))
            steps += (Step(StepKind.EXTRA, stop, k) for k in range(j + count, printed_index))
        if stop < len(recorded.lines):
            is_match = matcher.matches(recorded.lines[stop], printed.lines[printed_index])
            steps.append(Step(StepKind.SAME if is_match else StepKind.DIFFERS, stop, printed_index))
        i, j = stop + 1, printed_index + 1
    return tuple(steps)


def _line_pairs(
    recorded: Side, literal: Sequence[int], printed: Side, matcher: LineMatcher
) -> list[tuple[int, int]]:
    """Pairs of recorded lines, as indices of `literal`, and printed lines."""
    lines, texts = [recorded.lines[i] for i in literal], printed.lines
    # `is_free[k]`: a `...` line stands just before `lines[k]`, or at the end.
    following = [*literal, len(recorded.lines)]
    is_free = [before != after - 1 for before, after in zip([-1, *literal], following, strict=True)]
    words = {line: Counter(_WORD.findall(line)) for line in {*lines, *texts}}

    def weight(i: int, j: int) -> int:
        if matcher.matches(lines[i], texts[j]):
            return MATCH
        if matcher.pairs(lines[i], texts[j]) is not None:
            return _ALIKE_WEIGHT
        a = words[lines[i]]
        b = words[texts[j]]
        most = max(a.total(), b.total())
        shared = (a & b).total()
        return 1 + 3 * (2 * shared - most) // most if shared and 2 * shared >= most else 0

    return pair(lines, texts, weight, is_free)


# --- pairs of items of any kind

Weight = Callable[[int, int], int]
_Pairs = list[tuple[int, int]]

MATCH = 8
"""The weight of a pair that matches; smaller ones are for items that are alike, 0 for no pair."""

_CELLS = 250_000
"""The most cells that a table of dynamic programming may have."""


def pair(
    left: Sequence[str], right: Sequence[str], weight: Weight, is_free: Sequence[bool] = ()
) -> _Pairs:
    """Pairs `(i, j)`, growing in both, of items that correspond.

    `weight(i, j)` is `MATCH` for items that match, less for items that are alike, 0 for others.
    `is_free[i]`: right items left out before left item `i` (or at the end) cost nothing.
    """
    is_free = is_free or [False] * (len(left) + 1)
    pairs: _Pairs = []
    regions = [(0, len(left), 0, len(right))]
    while regions:
        i0, i1, j0, j1 = regions.pop()
        while i0 < i1 and j0 < j1 and not is_free[i0] and weight(i0, j0) == MATCH:
            pairs.append((i0, j0))
            i0, j0 = i0 + 1, j0 + 1
        while i0 < i1 and j0 < j1 and not is_free[i1] and weight(i1 - 1, j1 - 1) == MATCH:
            i1, j1 = i1 - 1, j1 - 1
            pairs.append((i1, j1))
        rows, columns = range(i0, i1), range(j0, j1)
        if len(rows) * len(columns) <= _CELLS:
            pairs += _best_pairs(rows, columns, weight, is_free)
            continue
        matcher = difflib.SequenceMatcher(None, left[i0:i1], right[j0:j1])
        if blocks := matcher.get_matching_blocks()[:-1]:
            for block in blocks:
                i, j = rows[block.a], columns[block.b]
                pairs += [(i + k, j + k) for k in range(block.size)]
                regions.append((i0, i, j0, j))
                i0, j0 = i + block.size, j + block.size
            regions.append((i0, i1, j0, j1))
        else:
            pairs += [(i, j) for i, j in zip(rows, columns, strict=False) if weight(i, j)]
    return sorted(pairs)


def _best_pairs(rows: range, columns: range, weight: Weight, is_free: Sequence[bool]) -> _Pairs:
    """The pairs of greatest total weight; an item left out costs 1. Ties go to the earliest."""
    n, m = len(rows), len(columns)
    weights = [[weight(i, j) for j in columns] for i in rows]
    cost = [0 if is_free[rows.start + i] else 1 for i in range(n + 1)]
    score = [[0] * (m + 1) for _ in range(n + 1)]
    score[n] = [-cost[n] * (m - j) for j in range(m + 1)]
    for i in range(n - 1, -1, -1):
        row, next_row, row_weights, extra = score[i], score[i + 1], weights[i], cost[i]
        row[m] = next_row[m] - 1
        for j in range(m - 1, -1, -1):
            best = max(next_row[j] - 1, row[j + 1] - extra)
            w = row_weights[j]
            row[j] = w + next_row[j + 1] if w and w + next_row[j + 1] >= best else best
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
