"""`check --shard 2/8`: which of the scripts and labs of a course one machine of several takes.

Entry points: `Shard`, `read_shard`, `read_timings`, `write_timings`.

Every machine computes the whole split by itself, so it must follow from what all of them have: the
names of the scripts and labs, and times only from files that are given to all of them. (What each
has in its own store, or finds in a shared cache at its own moment, differs, and a script could fall
between two shards.)
"""

from __future__ import annotations

import hashlib
import heapq
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from msgspec import Struct

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.write import write_atomic
from coursebuild.pipeline.options import UsageError

_MOST = 10_000


class Shard(Struct, frozen=True):
    """One part of the work, from 1 to `count`."""

    index: int
    count: int
    seconds: tuple[tuple[str, float], ...] = ()
    """How long scripts (by path) and labs (by name) take, where that is known."""

    def __str__(self) -> str:
        return f"{self.index}/{self.count}"

    def takes(self, names: Iterable[str]) -> frozenset[str]:
        """Of all names those that are of this part."""
        parts = split(names, self.count, dict(self.seconds))
        return frozenset(name for name, part in parts.items() if part == self.index)


def split(names: Iterable[str], count: int, seconds: Mapping[str, float]) -> dict[str, int]:
    """The part, from 1, of each name.

    With times: the longest first, each to the part that has least to do (within 4/3 of the best
    possible: Graham, SIAM J. Appl. Math. 17, 1969, p. 416). An unknown one counts as the median.
    Without times all count the same, in the order of their hashes, so that neighbours in a lesson,
    which are often alike, are spread.
    """
    everything = sorted(set(names), key=_hash)
    known = sorted(seconds[name] for name in everything if name in seconds)
    usual = known[len(known) // 2] if known else 1.0
    loads = [(0.0, 0, part) for part in range(1, count + 1)]
    found: dict[str, int] = {}
    for name in sorted(everything, key=lambda name: -seconds.get(name, usual)):
        load, number, part = heapq.heappop(loads)
        found[name] = part
        heapq.heappush(loads, (load + seconds.get(name, usual), number + 1, part))
    return found


def _hash(name: str) -> bytes:
    return hashlib.sha256(name.encode("utf-8", "surrogateescape")).digest()


def read_shard(text: str | None, timings: Sequence[str]) -> Shard | None:
    """What `--shard` and `--timings` say; `None` where nothing is divided.

    Raises:
        UsageError: it cannot be understood, or a file cannot be read.
    """
    if text is None:
        if timings:
            raise UsageError("--timings says how `--shard` divides the work: it needs `--shard`")
        return None
    match = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", text)
    if match is None:
        raise UsageError(f"--shard: {text!r} is no part of the work; write 2/8 for the second of 8")
    index, count = int(match[1]), int(match[2])
    if not 1 <= index <= count <= _MOST:
        raise UsageError(f"--shard: there is no part {index} of {count}")
    seconds: dict[str, float] = {}
    for file in timings:
        for name, value in read_timings(file).items():
            seconds[name] = max(value, seconds.get(name, 0.0))
    return Shard(index, count, tuple(sorted(seconds.items())))


def read_timings(file: str) -> dict[str, float]:
    """The times in a file that `--write-timings` wrote, s.

    Raises:
        UsageError: there are none.
    """
    try:
        value = json.loads(Path(file).read_bytes())
    except OSError as error:
        raise UsageError(f"--timings: {file} cannot be read: {reason(error)}") from None
    except (ValueError, RecursionError):
        value = None
    found = value.get("seconds") if isinstance(value, dict) else None
    if not isinstance(found, dict) or not all(_is_time(time) for time in found.values()):
        raise UsageError(f"--timings: {file} holds no times; `--write-timings` writes such a file")
    return {name: float(time) for name, time in found.items()}


def _is_time(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value < 1e9


def write_timings(file: str, seconds: Mapping[str, float], names: Iterable[str]) -> None:
    """Write how long things took, sorted; what else the file says of the course's names stays.

    Raises:
        UsageError: it cannot be written, or something else is in it.
    """
    path = Path(file).absolute()
    before = read_timings(file) if path.exists() else {}
    known = frozenset(names)
    merged = {name: time for name, time in before.items() if name in known}
    merged |= {name: round(time, 3) for name, time in seconds.items()}
    value = {"seconds": {name: merged[name] for name in sorted(merged)}}
    data = json.dumps(value, indent=2, ensure_ascii=True).encode() + b"\n"
    try:
        expected = path.read_bytes() if path.exists() else None
        write_atomic(path.parent, path.name, data, expected=expected, durable=False)
    except EffectError as error:
        raise UsageError(f"--write-timings: {error.message}") from None
    except OSError as error:
        raise UsageError(f"--write-timings: {file} cannot be written: {reason(error)}") from None
