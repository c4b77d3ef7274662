"""The index of symbols: what the letters in the formulas of the course stand for, and where.

Entry points: `symbols_values`, for the page; `used_symbols`.

Symbols whose meaning a lesson declares come first; for the others only their places are listed.
"""

from __future__ import annotations

from collections.abc import Iterator

from markupsafe import Markup
from msgspec import Struct, field

from coursebuild.core.model import Lesson, Owner
from coursebuild.core.pages import urls
from coursebuild.core.pages.document_inputs import (
    OwnerLink,
    OwnerLinks,
    added_page,
    owner_link,
    owner_links,
)
from coursebuild.core.pages.library import Library
from coursebuild.features.symbols.mathml import sort_key
from coursebuild.features.symbols.uses import SymbolUse


class CourseSymbol(Struct):
    """A symbol of the formulas of the lessons of a course."""

    first: SymbolUse
    owners: list[Owner] = field(default_factory=list)
    """The lessons that use it, in the order of the course."""
    meanings: dict[tuple[str, str], list[Owner]] = field(default_factory=dict)
    """The lessons that declare it, by its meaning and unit there."""


def used_symbols(library: Library) -> Iterator[tuple[Lesson, SymbolUse]]:
    """Yield the symbols of all lessons, in the order of the course."""
    for owner, symbols in library.summaries("symbols"):
        if isinstance(owner, Lesson):
            for use in symbols.uses:
                yield owner, use


def _course_symbols(library: Library) -> list[CourseSymbol]:
    rows: dict[str, CourseSymbol] = {}
    for owner, use in used_symbols(library):
        row = rows.setdefault(use.symbol, CourseSymbol(use))
        row.owners.append(owner)
        if use.meaning:
            row.meanings.setdefault((use.meaning, use.unit), []).append(owner)
    return sorted(rows.values(), key=lambda row: sort_key(row.first.symbol))


class MeaningView(Struct, frozen=True):
    """What a symbol stands for; `places` are the lessons that say so, if others differ."""

    text: str
    unit: str
    places: OwnerLinks | None


class SymbolView(Struct, frozen=True):
    """A symbol in the index."""

    symbol: Markup
    meanings: tuple[MeaningView, ...]
    first: OwnerLink
    section: str
    """The heading above its first use; empty before the first heading."""
    later_uses: OwnerLinks
    """The lessons that use it after the first one."""


def symbols_values(library: Library) -> dict[str, object]:
    """Return the values for the template of the index."""
    place = urls.Place("symbols/index.html")
    rows = [_symbol_view(library, place, row) for row in _course_symbols(library)]
    return {
        "declared": tuple(row for row in rows if row.meanings),
        "undeclared": tuple(row for row in rows if not row.meanings),
        "glossary": added_page(library, place, "glossary"),
    }


def _symbol_view(library: Library, place: urls.Place, row: CourseSymbol) -> SymbolView:
    anchor, section = row.first.section
    is_ambiguous = len(row.meanings) > 1
    return SymbolView(
        Markup(f"<math>{row.first.symbol}</math>"),
        tuple(
            MeaningView(text, unit, owner_links(place, owners) if is_ambiguous else None)
            for (text, unit), owners in row.meanings.items()
        ),
        owner_link(place, row.owners[0], anchor),
        section,
        owner_links(place, row.owners[1:]),
    )
