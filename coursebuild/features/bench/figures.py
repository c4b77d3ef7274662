"""Measured figures as a page sets them: numbers in words of a book, and tables.

Entry points: `Grid`, a table; `power`, `bounded`, `percent`, `factor`, `size`, numbers; `said`,
`sentence`.
"""

from __future__ import annotations

import math

from markupsafe import Markup, escape
from msgspec import Struct

from coursebuild.core.model.results import Machine
from coursebuild.core.pages.strings import Strings

_MINUS = "\u2212"
_THIN = "\u2009"
"""A thin space; tables and numbers are kept in one line by the style sheet."""


class FigurePart(Struct, frozen=True):
    """Rows of a table under a title of their own."""

    title: str
    remark: str
    count: int
    """How many."""


class Grid(Struct, frozen=True):
    """A table."""

    label: str
    """What it is, for who cannot see it."""
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    """The first cell of each is what the row is about."""
    left: tuple[int, ...]
    """Columns of words; numbers stand at the right."""
    minor: tuple[int, ...] = ()
    """Columns that go first where there is no room for all."""
    marked: tuple[int, ...] = ()
    """Rows that stand out."""
    parts: tuple[FigurePart, ...] = ()
    """All rows in order; empty where they are not parted."""

    @property
    def bodies(
        self,
    ) -> tuple[tuple[FigurePart | None, tuple[tuple[int, tuple[str, ...]], ...]], ...]:
        """The rows with their numbers, by part."""
        numbered = tuple(enumerate(self.rows))
        if not self.parts:
            return ((None, numbered),)
        found, at = [], 0
        for part in self.parts:
            found.append((part, numbered[at : at + part.count]))
            at += part.count
        return tuple(found)


def grid(
    label: str,
    columns: list[tuple[str, list[str]]],
    *,
    words: tuple[str, ...] = (),
    minor: tuple[str, ...] = (),
    marked: tuple[int, ...] = (),
    parts: tuple[FigurePart, ...] = (),
) -> Grid:
    """A table of columns without those that have no text; `words` and `minor` name some of them."""
    shown = [(title, cells) for n, (title, cells) in enumerate(columns) if not n or any(cells)]
    titles = tuple(title for title, _ in shown)
    return Grid(
        label=label,
        head=titles,
        rows=tuple(zip(*(cells for _, cells in shown), strict=True)),
        left=tuple(n for n, title in enumerate(titles) if not n or title in words),
        minor=tuple(n for n, title in enumerate(titles) if title in minor),
        marked=marked,
        parts=parts,
    )


def power(value: float | None, digits: int = 3) -> Markup:
    """A number in so many digits, with a power of ten where it is very large or small."""
    if value is None:
        return Markup()
    if not value or not math.isfinite(value):
        return Markup("0" if not value else f"{value}")
    exponent = int(f"{value:.{digits - 1}e}".partition("e")[2])
    if -3 <= exponent < 5:
        places = max(0, digits - 1 - exponent)
        return Markup(f"{value:.{places}f}".replace("-", _MINUS))
    return _raised(f"{value:.{digits - 1}e}")


def bounded(value: float | None, least: float) -> Markup:
    """An error, of which no more is known than that it is smaller where it is `least`."""
    if value is not None and least > 0.0 and value <= least * (1 + 1e-9):
        return Markup("&lt; ") + power(least, 2)
    return power(value)


def _raised(text: str) -> Markup:
    """A number as Python writes it, with a raised exponent."""
    mantissa, found, exponent = text.partition("e")
    tens = f"{_THIN}×{_THIN}10<sup>{int(exponent)}</sup>" if found else ""
    return Markup((mantissa + tens).replace("-", _MINUS))


def percent(value: float | None) -> Markup:
    """A relative change, with its sign."""
    if value is None:
        return Markup()
    change = 100 * value
    if 1e-3 <= abs(change) < 1e4:
        return Markup(f"{change:+.3f}{_THIN}%".replace("-", _MINUS))
    return Markup("" if change <= 0 else "+") + power(change, 2) + f"{_THIN}%"


def said(words: Strings, key: str, **values: str) -> Markup:
    """A text of the interface with values; numbers among them stay in one line."""
    kept = {
        name: whole(text) if isinstance(text, Markup) else text for name, text in values.items()
    }
    return Markup(escape(words(key)).format(**kept))


def whole(number: Markup) -> Markup:
    """A number that no line end breaks."""
    return Markup('<span class="whole">{}</span>').format(number)


def factor(value: float | None) -> str:
    """How many times as fast as real time."""
    if value is None:
        return ""
    return f"{value:,.0f}".replace(",", _THIN) if value >= 100 else f"{value:.3g}"


def size(count: int) -> str:
    """Bytes."""
    share, unit = count / 1e6, "MB"
    if count < 1e7:
        share, unit = (count, "B") if count < 1e4 else (count / 1e3, "kB")
    return f"{share:,.0f} {unit}".replace(",", _THIN)


def where(words: Strings, machine: Machine) -> str:
    """On what machine, and with which versions."""
    return words(
        "measured.where",
        engine=machine.engine,
        python=machine.python,
        numpy=machine.numpy,
        machine=machine.hardware,
    )


def sentence(text: str) -> str:
    """A clause as a sentence of its own."""
    text = text[:1].upper() + text[1:]
    return text if not text or text.endswith((".", "?", "!")) else f"{text}."
