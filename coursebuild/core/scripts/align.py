"""Which recorded line corresponds to which line that ran.

Entry points: `same_lines` (do they match?) and `align` (where do they differ?).

1. Lines of only `...` stand for any number of lines, also none. The recorded lines between two of
   them are a block, which must stand in the output without a gap: the first block at the start, the
   last at the end, the others each at its first place. A place is tried only where the first line
   fits, and its lines are first compared as numbered skeletons, then number by number.
2. `align` pairs lines by weight: lines that match, lines that differ only in their numbers, lines
   that share at least half of their words. Lines in between that found no partner are taken as
   changed, one for one, and the rest as missing or extra; beside a recorded `...` line, lines that
   ran are elided instead.
"""

from __future__ import annotations

import enum
from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Sequence

from msgspec import Struct

from coursebuild.core.model import Comparison, Mode
from coursebuild.core.scripts.lines import LineMatcher
from coursebuild.core.scripts.mapped_text import Side
from coursebuild.core.scripts.pairing import MATCH, Keys, pair
from coursebuild.core.text.patterns import pattern


class _Block(Struct, frozen=True):
    lines: tuple[str, ...]
    runs: tuple[tuple[int, list[int]], ...]
    """Stretches of lines without an ellipsis: (index of the first, ids of their skeletons)."""


class _Output:
    """The lines that ran, with an id for each different skeleton."""

    def __init__(self, lines: Sequence[str], matcher: LineMatcher) -> None:
        self.lines = lines
        self.matcher = matcher
        self._known: dict[str, int] = {}
        self.ids = [self.id(line) for line in lines]
        self._places: dict[int, list[int]] = defaultdict(list)
        for place, key in enumerate(self.ids):
            self._places[key].append(place)

    def id(self, line: str) -> int:
        """The id of a line's skeleton (of its text where lines are compared exactly)."""
        exact = self.matcher.comparison.mode is Mode.EXACT
        key = line if exact else self.matcher.canon(line).skeleton
        return self._known.setdefault(key, len(self._known))

    def block(self, lines: Sequence[str]) -> _Block:
        """A block of recorded lines."""
        runs: list[tuple[int, list[int]]] = []
        for index, line in enumerate(lines):
            if self.matcher.elides(line):
                continue
            if runs and runs[-1][0] + len(runs[-1][1]) == index:
                runs[-1][1].append(self.id(line))
            else:
                runs.append((index, [self.id(line)]))
        return _Block(tuple(lines), tuple(runs))

    def stands_at(self, block: _Block, place: int) -> bool:
        """Whether the block stands at a place."""
        if place < 0 or place + len(block.lines) > len(self.lines):
            return False
        for index, keys in block.runs:
            if self.ids[place + index : place + index + len(keys)] != keys:
                return False
        return all(
            self.matcher.matches(line, self.lines[place + index])
            for index, line in enumerate(block.lines)
        )

    def find(self, block: _Block, start: int, stop: int) -> int:
        """The first place of the block from `start` on such that it ends before `stop`; or -1."""
        last = stop - len(block.lines)
        if not block.lines:
            return start if start <= last else -1
        if not block.runs:
            tries: Sequence[int] = range(start, last + 1)
            shift = 0
        else:
            shift, keys = block.runs[0]
            places = self._places.get(keys[0], [])
            tries = places[bisect_left(places, start + shift) :]
        for place in tries:
            if place - shift > last:
                break
            if self.stands_at(block, place - shift):
                return place - shift
        return -1


def blocks_match(recorded: Sequence[str], ran: Sequence[str], matcher: LineMatcher) -> bool:
    """Whether the lines that ran are what was recorded, `...` lines understood."""
    groups: list[list[str]] = [[]]
    for line in recorded:
        if matcher.elides_lines(line):
            groups.append([])
        else:
            groups[-1].append(line)
    if len(groups) == 1 and len(recorded) != len(ran):
        return False
    output = _Output(ran, matcher)
    blocks = [output.block(group) for group in groups]
    first, last = blocks[0], blocks[-1]
    stop = len(ran) - len(last.lines)
    if not (output.stands_at(first, 0) and output.stands_at(last, stop)):
        return False
    at = len(first.lines)
    for block in blocks[1:-1]:
        at = output.find(block, at, stop)
        if at < 0:
            return False
        at += len(block.lines)
    return len(blocks) == 1 or at <= stop


_ALIKE = 6
_WORD = pattern(r"[^\W\d]+")


class StepKind(enum.Enum):
    """What happens at one step through both sides."""

    SAME = "same"
    DIFFERS = "differs"
    MISSING = "missing"
    EXTRA = "extra"
    ELLIPSIS = "ellipsis"
    """A recorded `...` line."""
    ELIDED = "elided"
    """A line that ran and that a `...` line stands for."""


class Step(Struct, frozen=True):
    """One step; the indices count lines from 0.

    For `EXTRA` and `ELIDED`, `recorded` is the line before which the line stands; for `MISSING` and
    `ELLIPSIS`, `ran` is the line that comes next.
    """

    kind: StepKind
    recorded: int
    ran: int


def same_lines(recorded: Side, ran: Side, comparison: Comparison) -> bool:
    """Whether what ran is what was recorded."""
    if recorded.texts == ran.texts:
        return True
    matcher = LineMatcher(comparison)
    if not comparison.ellipsis:
        return len(recorded.lines) == len(ran.lines) and all(
            matcher.matches(a.text, b.text) for a, b in zip(recorded.lines, ran.lines, strict=True)
        )
    return blocks_match(recorded.texts, ran.texts, matcher)


def align(recorded: Side, ran: Side, matcher: LineMatcher) -> tuple[Step, ...]:
    """The steps that lead through both sides, in order."""
    literal = [i for i, line in enumerate(recorded.lines) if not matcher.elides_lines(line.text)]
    pairs = _line_pairs([recorded.lines[i].text for i in literal], literal, ran, recorded, matcher)
    steps: list[Step] = []
    i = j = 0
    for literal_index, ran_index in (*pairs, (len(literal), len(ran.lines))):
        stop = literal[literal_index] if literal_index < len(literal) else len(recorded.lines)
        steps += _gap(i, stop, j, ran_index, recorded, matcher)
        if stop < len(recorded.lines):
            same = matcher.matches(recorded.lines[stop].text, ran.lines[ran_index].text)
            steps.append(Step(StepKind.SAME if same else StepKind.DIFFERS, stop, ran_index))
        i, j = stop + 1, ran_index + 1
    return tuple(steps)


def _line_pairs(
    lines: Sequence[str], literal: Sequence[int], ran: Side, recorded: Side, matcher: LineMatcher
) -> tuple[tuple[int, int], ...]:
    texts = ran.texts
    # A `...` line stands just before line `k` of those that are none.
    following = [*literal, len(recorded.lines)]
    free = [before != after - 1 for before, after in zip([-1, *literal], following, strict=True)]
    words: dict[str, Counter[str]] = {}

    def words_of(line: str) -> Counter[str]:
        if line not in words:
            words[line] = Counter(_WORD.findall(line))
        return words[line]

    def weight(i: int, j: int) -> int:
        if matcher.matches(lines[i], texts[j]):
            return MATCH
        if matcher.alike(lines[i], texts[j]):
            return _ALIKE
        return _likeness(words_of(lines[i]), words_of(texts[j]))

    return pair(
        Keys(lines, [matcher.canon(line).skeleton for line in lines]),
        Keys(texts, [matcher.canon(line).skeleton for line in texts]),
        weight,
        free,
    )


def _likeness(a: Counter[str], b: Counter[str]) -> int:
    """From 1 to 4 for lines that share half to all of their words, else 0."""
    most = max(a.total(), b.total())
    shared = (a & b).total()
    return 1 + 3 * (2 * shared - most) // most if shared and 2 * shared >= most else 0


def _gap(
    i: int, i_stop: int, j: int, j_stop: int, recorded: Side, matcher: LineMatcher
) -> list[Step]:
    """The steps between two pairs: recorded lines `[i, i_stop)`, lines that ran `[j, j_stop)`."""
    elliptic = [matcher.elides_lines(recorded.lines[k].text) for k in range(i, i_stop)]
    steps: list[Step] = []
    if any(elliptic):
        for k, elides in enumerate(elliptic, start=i):
            steps.append(Step(StepKind.ELLIPSIS if elides else StepKind.MISSING, k, j))
            if elides:
                steps += (Step(StepKind.ELIDED, k + 1, line) for line in range(j, j_stop))
                j = j_stop
        return steps
    both = min(i_stop - i, j_stop - j)
    steps += (Step(StepKind.DIFFERS, i + k, j + k) for k in range(both))
    steps += (Step(StepKind.MISSING, k, j_stop) for k in range(i + both, i_stop))
    steps += (Step(StepKind.EXTRA, i_stop, k) for k in range(j + both, j_stop))
    return steps
