"""JSON that somebody has changed so that it is still JSON."""

from __future__ import annotations

import copy
import json
import math
import random
from collections.abc import Iterator
from typing import Any

_POISONS: tuple[Any, ...] = (
    *(None, True, -1, 0, 7.5, 10**400, 1 << 62, -1e308, math.nan, math.inf),
    *("", "\x1b[2J", "</script><script>x</script>", "../../../etc/passwd", "\ud800", "A" * 5000),
    *([], {}, [[]], [[[1, "a"]]], {"type": "f64", "data": "AAAA"}, {"type": "u8", "data": "?"}),
)


def _places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    yield path
    for key, child in value.items() if isinstance(value, dict) else ():
        yield from _places(child, (*path, key))
    for index, child in enumerate(value[:3]) if isinstance(value, list) else ():
        yield from _places(child, (*path, index))


def mutate(value: Any, chance: random.Random) -> Any:
    """A copy of a value of JSON in which something is put in one place, or taken away."""
    path = (0, *chance.choice(list(_places(value))))
    whole = [copy.deepcopy(value)]
    parent: Any = whole
    for step in path[:-1]:
        parent = parent[step]
    if chance.random() < 0.15 and len(path) > 1:
        del parent[path[-1]]
    else:
        parent[path[-1]] = chance.choice(_POISONS)
    return whole[0]


def mutations(text: bytes, count: int) -> Iterator[bytes]:
    value, chance = json.loads(text), random.Random(21)
    for _ in range(count):
        yield json.dumps(mutate(value, chance)).encode()
