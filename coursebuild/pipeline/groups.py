"""What belongs to the documents of a course, put into groups that are looked up together.

Entry point: `groups`.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

T = TypeVar("T")

_FEW = 48
_LONGEST = 5
"""How many times as long as it should be a group is at most, about."""


def groups(
    items: Iterable[T], path: Callable[[T], str], few: int = _FEW
) -> Iterator[tuple[T, ...]]:
    """Groups of some `few` items, in order.

    Where one ends is decided by paths alone, so that an item that is added moves no other far.
    """
    group: list[T] = []
    for item in items:
        begins = zlib.crc32(path(item).encode("utf-8", "surrogatepass")) % few == 0
        if group and (begins or len(group) >= _LONGEST * few):
            yield tuple(group)
            group.clear()
        group.append(item)
    if group:
        yield tuple(group)
