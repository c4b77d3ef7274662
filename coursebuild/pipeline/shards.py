"""A part of the work of a check.

`check --shard 2/8` divides the scripts and labs of a course among several machines. Every machine
computes the whole split by itself, so it must follow from what all machines have: the names of the
scripts and labs, and times from files that are given to all. Stores and shared caches differ from
machine to machine: by their times, a script could fall between two shards.
"""

from __future__ import annotations

import hashlib
import heapq
import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta, Struct

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.write import write_atomic
from coursebuild.pipeline.options import UsageError

_LARGEST_COUNT = 10_000


class Shard(Struct, frozen=True):
    """One part of the work, from 1 to `count`."""

    index: int
    count: int
    seconds: tuple[tuple[str, float], ...] = ()
    """How long scripts (by path) and labs (by name) take, where that is known."""

    def __str__(self) -> str:
        return f"{self.index}/{self.count}"

    def takes(self, names: Iterable[str]) -> frozenset[str]:
        """Return those of the names that belong to this part."""
        parts = split(names, self.count, dict(self.seconds))
        return frozenset(name for name, part in parts.items() if part == self.index)


class _Timings(Struct):
    """What a file of timings holds."""

    seconds: dict[str, Annotated[float, Meta(ge=0, lt=1e9)]]


def split(names: Iterable[str], count: int, seconds: Mapping[str, float]) -> dict[str, int]:
    """Assign each name to a part, from 1.

    With times: the longest first, each to the part that has least to do (within 4/3 of the best
    possible: Graham, SIAM J. Appl. Math. 17, 1969, p. 416). An unknown time counts as the median.
    Without times all names count the same, in the order of their hashes: neighbours in a lesson,
    which are often alike, go to different parts.
    """
    sorted_names = sorted(set(names), key=lambda name: hashlib.sha256(os.fsencode(name)).digest())
    known_times = sorted(seconds[name] for name in sorted_names if name in seconds)
    median = known_times[len(known_times) // 2] if known_times else 1.0
    loads = [(0.0, 0, part) for part in range(1, count + 1)]
    parts: dict[str, int] = {}
    for name in sorted(sorted_names, key=lambda name: -seconds.get(name, median)):
        load, number, part = heapq.heappop(loads)
        parts[name] = part
        heapq.heappush(loads, (load + seconds.get(name, median), number + 1, part))
    return parts


def read_shard(text: str | None, timings: Sequence[str]) -> Shard | None:
    """Parse `--shard` and `--timings`; `None` where the work is not divided.

    Raises:
        UsageError: they cannot be understood, or a file cannot be read.
    """
    if text is None:
        if timings:
            raise UsageError("--timings says how `--shard` divides the work: it needs `--shard`")
        return None
    match = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", text)
    if match is None:
        raise UsageError(
            f"--shard: {text!r} is not a part of the work; write 2/8 for the second of 8"
        )
    index, count = int(match[1]), int(match[2])
    if not 1 <= index <= count <= _LARGEST_COUNT:
        raise UsageError(f"--shard: part {index} of {count} does not exist")
    seconds: dict[str, float] = {}
    for file in timings:
        for name, value in read_timings(file).items():
            seconds[name] = max(value, seconds.get(name, 0.0))
    return Shard(index, count, tuple(sorted(seconds.items())))


def read_timings(file: str) -> dict[str, float]:
    """Read the times, in seconds, from a file that `--write-timings` wrote.

    Raises:
        UsageError: it has none.
    """
    try:
        return msgspec.json.decode(Path(file).read_bytes(), type=_Timings).seconds
    except OSError as error:
        raise UsageError(f"--timings: {file} cannot be read: {reason(error)}") from None
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        raise UsageError(
            f"--timings: {file} holds no times; `--write-timings` writes such a file"
        ) from None


def write_timings(file: str, seconds: Mapping[str, float], names: Iterable[str]) -> None:
    """Write how long scripts and labs took; other times of the course that are in the file stay.

    Raises:
        UsageError: it cannot be written, or something else is in it.
    """
    path = Path(file).absolute()
    before = read_timings(file) if path.exists() else {}
    course_names = frozenset(names)
    times = {name: time for name, time in before.items() if name in course_names}
    times |= {name: round(time, 3) for name, time in seconds.items()}
    value = {"seconds": {name: times[name] for name in sorted(times)}}
    data = json.dumps(value, indent=2, ensure_ascii=True).encode() + b"\n"
    try:
        expected = path.read_bytes() if path.exists() else None
        write_atomic(path.parent, path.name, data, expected=expected, durable=False)
    except EffectError as error:
        raise UsageError(f"--write-timings: {error.message}") from None
    except OSError as error:
        raise UsageError(f"--write-timings: {file} cannot be written: {reason(error)}") from None
