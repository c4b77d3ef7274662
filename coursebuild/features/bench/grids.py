"""Measured figures as a page shows them: numbers in print style, and tables."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TypeAlias

from markupsafe import Markup, escape
from msgspec import Struct

from coursebuild.core.model.results import Machine
from coursebuild.core.pages.renderer import Strings

_MINUS = "\u2212"
_THIN = "\u2009"
"""A thin space; the style sheet keeps tables and numbers on one line."""


class FigurePart(Struct, frozen=True):
    """Successive rows of a table under a title of their own."""

    title: str
    remark: str
    count: int
    """The number of rows."""


class Grid(Struct, frozen=True):
    """A table."""

    label: str
    """What it shows, for screen readers."""
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    """The first cell names the row."""
    left: tuple[int, ...]
    """Columns of words, set left; numbers are set right."""
    minor: tuple[int, ...] = ()
    """Columns that come last if there is no room for all."""
    highlights: tuple[int, ...] = ()
    """Rows that stand out."""
    parts: tuple[FigurePart, ...] = ()
    """The parts of the table, in order; empty if it has none."""

    @property
    def bodies(
        self,
    ) -> tuple[tuple[FigurePart | None, tuple[tuple[int, tuple[str, ...]], ...]], ...]:
        """The rows with their numbers, by part."""
        rows = tuple(enumerate(self.rows))
        if not self.parts:
            return ((None, rows),)
        bodies, start = [], 0
        for part in self.parts:
            bodies.append((part, rows[start : start + part.count]))
            start += part.count
        return tuple(bodies)


def grid(
    label: str,
    columns: list[tuple[str, list[str]]],
    *,
    words: tuple[str, ...] = (),
    minor: tuple[str, ...] = (),
    highlights: tuple[int, ...] = (),
    parts: tuple[FigurePart, ...] = (),
) -> Grid:
    """Make a table of the columns that hold text; `words` and `minor` are titles of columns."""
    filled_columns = [column for n, column in enumerate(columns) if not n or any(column[1])]
    titles = tuple(title for title, _ in filled_columns)
    return Grid(
        label=label,
        head=titles,
        rows=tuple(zip(*(cells for _, cells in filled_columns), strict=True)),
        left=tuple(n for n, title in enumerate(titles) if not n or title in words),
        minor=tuple(n for n, title in enumerate(titles) if title in minor),
        highlights=highlights,
        parts=parts,
    )


NamedRow: TypeAlias = tuple[str, tuple[str, ...]]
"""The name of a row, and its other cells."""


def merge_rows(rows: Iterable[NamedRow]) -> list[NamedRow]:
    """Join rows with the same cells under all of their names."""
    names_by_cells: dict[tuple[str, ...], list[str]] = {}
    for name, cells in rows:
        names_by_cells.setdefault(cells, []).append(name)
    return [(", ".join(names), cells) for cells, names in names_by_cells.items()]


def power(value: float | None, digits: int = 3) -> Markup:
    """Write a number in so many digits, with a power of ten if it is very large or small."""
    if value is None:
        return Markup()
    if not value or not math.isfinite(value):
        return Markup("0" if not value else f"{value}")
    mantissa, _, digits_of_exponent = f"{value:.{digits - 1}e}".partition("e")
    exponent = int(digits_of_exponent)
    if -3 <= exponent < 5:
        places = max(0, digits - 1 - exponent)
        return Markup(f"{value:.{places}f}".replace("-", _MINUS))
    text = f"{mantissa}{_THIN}×{_THIN}10<sup>{exponent}</sup>"
    return Markup(text.replace("-", _MINUS))


def bounded(value: float | None, least: float) -> Markup:
    """Write an error; one that is not above `least` is only known to be smaller than that."""
    if value is not None and least > 0.0 and value <= least * (1 + 1e-9):
        return Markup("&lt; ") + power(least, 2)
    return power(value)


def percent(value: float | None) -> Markup:
    """Write a relative change, with its sign."""
    if value is None:
        return Markup()
    change = 100 * value
    if 1e-3 <= abs(change) < 1e4:
        return Markup(f"{change:+.3f}{_THIN}%".replace("-", _MINUS))
    return Markup("" if change <= 0 else "+") + power(change, 2) + f"{_THIN}%"


def phrase(words: Strings, key: str, **values: str) -> Markup:
    """Put values into a text of the interface; no line end breaks the numbers among them."""
    texts = {
        name: unbroken(words.decimals(text)) if isinstance(text, Markup) else text
        for name, text in values.items()
    }
    return Markup(escape(words(key)).format(**texts))


def unbroken(number: str) -> Markup:
    """Mark a number so that no line end breaks it."""
    return Markup('<span class="whole">{}</span>').format(number)


def factor(value: float | None, digits: int = 3) -> str:
    """Write in so many digits how many times as fast, or as slow, something is."""
    if value is None:
        return ""
    value = float(f"{value:.{digits}g}")
    return whole_number(value) if value >= 100 else f"{value:g}"


def whole_number(value: float | None) -> str:
    """Write a whole number in groups of three digits, as it is understood in every language."""
    return "" if value is None else f"{value:,.0f}".replace(",", _THIN)


def size(count: int) -> str:
    """Write a number of bytes."""
    amount, unit = count / 1e6, "MB"
    if count < 1e7:
        amount, unit = (count, "B") if count < 1e4 else (count / 1e3, "kB")
    return f"{whole_number(amount)} {unit}"


def machine_text(words: Strings, machine: Machine) -> str:
    """Name the machine and the versions."""
    return words(
        "measured.where",
        engine=machine.engine,
        python=machine.python,
        numpy=machine.numpy,
        machine=machine.hardware,
    )


def sentence(text: str) -> str:
    """Make a sentence of a clause."""
    text = text[:1].upper() + text[1:]
    return text if not text or text.endswith((".", "?", "!")) else f"{text}."
