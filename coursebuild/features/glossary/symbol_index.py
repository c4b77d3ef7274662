"""The index of symbols: what the letters in the formulas of the course stand for, and where.

Entry point: `symbols_values`.

Symbols whose meaning a lesson declares come first; the others are listed with their places.
"""

from __future__ import annotations

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.lookup.references import CourseSymbol
from coursebuild.core.pages.lookup.symbols import sort_key
from coursebuild.core.pages.owners import OwnerLink, OwnerLinks, owner_link, owner_links


class MeaningView(Struct, frozen=True):
    """What a symbol stands for; `places`, where lessons differ in it."""

    text: str
    unit: str
    places: OwnerLinks | None


class SymbolView(Struct, frozen=True):
    """A row."""

    symbol: Markup
    meanings: tuple[MeaningView, ...]
    first: OwnerLink
    section: str
    """The heading under which it stands there; empty before the first."""
    others: OwnerLinks


def symbols_values(library: Library) -> dict[str, object]:
    """What the index shows."""
    place = urls.Place("symbols/index.html")
    rows = [
        _view(library, place, row)
        for row in sorted(library.references.symbols, key=lambda row: sort_key(row.symbol))
    ]
    return {
        "declared": tuple(row for row in rows if row.meanings),
        "undeclared": tuple(row for row in rows if not row.meanings),
        "glossary": place.href("glossary/index.html") if library.references.terms else "",
    }


def _view(library: Library, place: urls.Place, row: CourseSymbol) -> SymbolView:
    anchor, section = row.section
    several = len(row.meanings) > 1
    return SymbolView(
        Markup(f"<math>{row.symbol}</math>"),
        tuple(
            MeaningView(
                meaning.text,
                meaning.unit,
                owner_links(library, place, meaning.owners) if several else None,
            )
            for meaning in row.meanings
        ),
        owner_link(place, row.owners[0], anchor),
        section,
        owner_links(library, place, row.owners[1:]),
    )
