"""Results of scripts that were recalled together, in one entry of the store.

Entry point: `Recalled`.

Each result lies in a file of its own, in the folder of its group: to list, open and read hundreds
of both takes longer than all else that a run asks of them. So what some scripts had in the last run
lies once more in one entry, with the time when the folder was changed last. Where that is the same,
the group holds what it held.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

from coursebuild.effects.store import Store
from coursebuild.effects.tool import tool_digest
from coursebuild.scripts.dependencies import Inputs
from coursebuild.scripts.remembered import Record, from_bytes
from coursebuild.source import key_of
from coursebuild.values import dataclass

_KIND = "recalled"
_LASTS = 3600
"""Seconds until a result is looked up by itself again, so that the store knows that it is used."""
_SETTLED = 100_000_000
"""ns for which a folder must not have changed to be known by its time of change."""


@dataclass(frozen=True, slots=True)
class _Row:
    """A result."""

    group: str
    changed: int
    """When the folder of its group was changed last, ns."""
    noted: int
    """When it was looked up by itself, in seconds since 1970."""
    data: bytes
    record: Record


class Recalled:
    """What some scripts had in the last run."""

    def __init__(self, store: Store, kind: str, some: Sequence[Inputs]) -> None:
        """`kind` is that of the results."""
        self._store = store
        self._kind = kind
        # A later entry of the same scripts takes the place of the one before.
        self._name = key_of(tool_digest(), kind, repr(some[0].around), some[0].path)
        self._before = _unpacked(store.peek(_KIND, self._name) or b"")
        self._now: dict[str, _Row] = {}

    def get(self, path: str) -> Record | None:
        """The result of a script, if it is kept by itself as it was then."""
        row = self._before.get(path)
        if row is None or not 0 <= time.time() - row.noted <= _LASTS:
            return None
        if self._store.group_changed(self._kind, row.group) != row.changed:
            return None
        self._now[path] = row
        return row.record

    def add(self, group: str, changed: int, data: bytes, record: Record) -> None:
        """Note a result that was looked up by itself; before that the time of change was."""
        if time.time_ns() - changed > _SETTLED:
            self._now[record.inputs.path] = _Row(group, changed, int(time.time()), data, record)

    def save(self) -> None:
        """Keep them for the next run, and no others."""
        if self._now.keys() != self._before.keys() or any(
            row is not self._before[path] for path, row in self._now.items()
        ):
            rows = self._now.values()
            lines = (f"{row.group} {row.changed} {row.noted} ".encode() + row.data for row in rows)
            self._store.keep(_KIND, self._name, b"\n".join(lines), packed=True)


def _unpacked(data: bytes) -> dict[str, _Row]:
    """Rows by the paths of their scripts."""
    rows: dict[str, _Row] = {}
    for line in data.split(b"\n"):
        parts = line.split(b" ", 3)
        record = from_bytes(parts[-1]) if len(parts) == 4 else None
        if record is not None:
            group, changed, noted, own = parts
            rows[record.inputs.path] = _Row(group.decode(), int(changed), int(noted), own, record)
    return rows
