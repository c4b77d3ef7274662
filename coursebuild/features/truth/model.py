"""What a document states: numbers, with what each is held against."""

from __future__ import annotations

from collections.abc import Iterable

from msgspec import Struct

from coursebuild.api import Span


class StatedNumber(Struct, frozen=True):
    """A number that a document states."""

    span: Span
    text: str
    """Empty for a mark that stands beside no number."""
    values: tuple[tuple[float, float], ...] = ()
    """Its value and one unit of its last place: as it is written, and in base units."""
    sources: tuple[str, ...] = ()
    """The parts of the course of which one must hold it."""
    mark: Span | None = None
    """Where these are named."""

    def is_in(self, numbers: Iterable[float]) -> bool:
        """Whether one of these, rounded to its digits, is this number."""
        return any(
            2 * abs(abs(number) - abs(value)) <= step * (1 + 1e-9)
            for number in numbers
            for value, step in self.values
        )


class Claims(Struct, frozen=True):
    """The claims of a document that its scripts and formulas do not prove."""

    open: tuple[StatedNumber, ...]
    """Those that name no source."""
    sourced: tuple[StatedNumber, ...] = ()
    """Those whose source is a part of the course."""
    inputs: tuple[float, ...] = ()
    """The numbers that are given, or computed with."""
