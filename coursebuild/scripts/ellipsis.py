"""Does a text with lines of only `...` match? Each stands for any number of lines, also none.

Entry point: `blocks_match`.

1. The recorded lines between two `...` are a block, which must stand in the output without a gap:
   the first block at the start, the last at the end, the others each at its first place.
2. A place is tried only where the first line fits, and its lines are first compared as numbered
   skeletons (a comparison of lists of integers), then number by number.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Sequence

from msgspec import Struct

from coursebuild.model import Mode
from coursebuild.scripts.lines import LineMatcher


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
