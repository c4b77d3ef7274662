"""What is printed now in the place where a bound number was printed before.

Entry point: `succession`.

1. A line is known by its text without its numbers, and by the heading that it stands under: the
   last line above it that has words and no number. Lines of which there are several alike are told
   apart by any line above them that there is only once. What is so known before and now is the same
   line, wherever it stands; one that stood under none may have got one that is new.
2. Lines that are alike even so, such as the rows of a table, are the same in their order, if there
   are as many as before and what each has kept, such as a label, tells it from the others. Lines of
   a single number are so, if none of the numbers stands in another line now. Else lines may have
   come and gone, and what is printed in place of one is not certain.
3. Inside a line numbers are counted.
"""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from decimal import Decimal

from msgspec import Struct

from coursebuild.core.scripts.bound_numbers import PrintedLine, Shown, Window
from coursebuild.core.scripts.lines import canonical


class Succession(Struct, frozen=True):
    """Where the numbers of a binding were printed, and what is printed there now."""

    before: tuple[Window, ...]
    now: tuple[Window | None, ...]
    """For each of them; `None` where it is not certain."""


def succession(shown: Shown, before: tuple[str, ...], now: Sequence[PrintedLine]) -> Succession:
    """What became of the numbers that a binding shows; `before` are the lines by which it held."""
    lines = list(map(PrintedLine.of, before))
    at = {id(line): index for index, line in enumerate(lines)}
    places = tuple(w for w in shown.windows(lines) if shown.shows(w))
    same = _same_lines(before, tuple(line.text for line in now))

    def successor(window: Window) -> Window | None:
        index = same.get(at[id(window.line)])
        if index is None:
            return None
        first = window.line.numbers.index(window.numbers[0])
        line = now[index]
        return Window(line, line.numbers[first : first + len(window.numbers)])

    return Succession(places, tuple(map(successor, places)))


class _Known(Struct, frozen=True):
    """What a line with numbers is known by."""

    index: int
    heading: str
    """Empty for what stands above all headings."""
    skeleton: str
    values: tuple[Decimal, ...]


_Pairs = list[tuple[_Known, _Known]]


@functools.lru_cache(maxsize=16)
def _same_lines(before: tuple[str, ...], now: tuple[str, ...]) -> Mapping[int, int]:
    """The line that each line of before is now, where that is certain: indices."""
    (old, earlier), (new, _) = _known(before), _known(now)
    groups = list(_groups(old, new, lambda line: (line.heading, line.skeleton)))
    left = {line.index for group in groups for line, _ in group}
    taken = {line.index for group in groups for _, line in group}
    old = [line for line in old if line.index not in left and not line.heading]
    new = [line for line in new if line.index not in taken and line.heading not in earlier]
    groups += filter(_together, _groups(old, new, lambda line: line.skeleton))
    # Of lines that belong together, such as a step and its error below it, all have moved.
    moved = {line.heading for group in groups if _moved(group) for line, _ in group}
    return {
        one.index: other.index
        for group in groups
        for one, other in group
        if len(group) == 1 or one.heading not in moved
    }


def _known(texts: tuple[str, ...]) -> tuple[list[_Known], set[str]]:
    """The lines that have numbers, and all headings."""
    canons = [canonical(text) for text in texts]
    count = Counter(canon.skeleton for canon in canons)
    heading = above = ""
    headings = {""}
    lines: list[_Known] = []
    for index, canon in enumerate(canons):
        skeleton, once = canon.skeleton.strip(), count[canon.skeleton] == 1
        if canon.numbers:
            values = tuple(number.value for number in canon.numbers)
            lines.append(_Known(index, heading if once else above, canon.skeleton, values))
        if any(map(str.isalpha, skeleton)) and (once or not canon.numbers):
            above = skeleton
            heading = heading if canon.numbers else above
            headings.add(above)
    return lines, headings


def _groups(
    old: Sequence[_Known], new: Sequence[_Known], key: Callable[[_Known], Hashable]
) -> Iterator[_Pairs]:
    """The lines that are known by the same key, in order, where there are as many as before."""
    both: dict[Hashable, tuple[list[_Known], list[_Known]]] = {}
    for side, lines in enumerate((old, new)):
        for line in lines:
            both.setdefault(key(line), ([], []))[side].append(line)
    for before, now in both.values():
        if before and len(before) == len(now):
            yield list(zip(before, now, strict=True))


def _together(group: _Pairs) -> bool:
    """Whether all lines stood under one heading, and do so now."""
    return all(len({line.heading for line in side}) == 1 for side in zip(*group, strict=True))


def _moved(group: _Pairs) -> bool:
    """Whether lines may have come, gone or changed places."""
    if len(group) == 1:
        return False
    ones, others = (
        zip(*(line.values for line in side), strict=True) for side in zip(*group, strict=True)
    )
    columns = list(zip(ones, others, strict=True))
    kept = [old for old, new in columns if old == new]
    changed = [(old, new) for old, new in columns if old != new]
    if any(Counter(old) == Counter(new) for old, new in changed):
        return True
    if len(set(zip(*kept, strict=True))) == len(group):
        return False
    return len(columns) > 1 or any(not set(old).isdisjoint(new) for old, new in changed)
