"""The bindings that were found to hold, and by which lines.

Entry points: `Held`, which a check asks; `Bearings`, a memory that follows a course from one check
to the next. When an output is another, it knows where the number of a binding was printed before.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeAlias

from msgspec import Struct


class Leans(Struct, frozen=True):
    """What a binding shows, and on which outputs it leans, whatever they are now."""

    text: str
    script: str
    document: str
    """Empty where the binding names the script."""
    nth: int
    """Of the recorded outputs of the script in the document."""
    count: int
    """Of these outputs: with another one, it is not known any more which is which."""


class Borne(Struct, frozen=True):
    """The lines by which a binding held."""

    lines: tuple[str, ...] = ()
    ran: bool = False
    """They were those of a run, and not recorded."""


Asked: TypeAlias = Callable[[], Leans]
"""Gives what a binding leans on: not every memory asks for it."""


class Held(Protocol):
    """Remembers bindings in which nothing is wrong."""

    def holds(self, key: str, leans: Asked) -> bool:
        """Whether nothing is wrong with a binding, by a hash of all that this depends on."""

    def add(self, key: str, leans: Asked, borne: Borne) -> None:
        """That nothing is wrong; there are no lines where nothing could be looked at."""

    def before(self, leans: Asked) -> Borne:
        """By what a binding held when it was last looked at and held, if that is known."""


class Bearings:
    """See the module."""

    def __init__(self) -> None:
        self._by: dict[str, Borne] = {}
        self._last: dict[Leans, Borne] = {}
        self._lines: dict[tuple[str, ...], tuple[str, ...]] = {}
        """Each once: many bindings hold by the same."""

    def __len__(self) -> int:
        """How much is remembered: bindings, and lines."""
        return len(self._by) + sum(map(len, self._lines))

    def clear(self) -> None:
        """Forget all of them."""
        for remembered in (self._by, self._last, self._lines):
            remembered.clear()

    def holds(self, key: str, leans: Asked) -> bool:
        """See `Held`."""
        borne = self._by.get(key)
        if borne is not None and borne.lines:
            self._last[leans()] = borne
        return borne is not None

    def add(self, key: str, leans: Asked, borne: Borne) -> None:
        """See `Held`."""
        lines = self._lines.setdefault(borne.lines, borne.lines)
        self._by[key] = borne = Borne(lines, borne.ran)
        if lines:
            self._last[leans()] = borne

    def before(self, leans: Asked) -> Borne:
        """See `Held`."""
        return self._last.get(leans(), Borne())
