"""The glossary: every term of the course, the sentence that defines it, and where it is used.

Entry point: `glossary_values`.
"""

from __future__ import annotations

import unicodedata
from itertools import groupby

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.lookup.references import GlossaryTerm
from coursebuild.core.pages.owners import OwnerLink, OwnerLinks, owner_link, owner_links


class PieceView(Struct, frozen=True):
    """A part of a definition; `display`: a formula on a line of its own."""

    html: Markup
    display: bool


class TermView(Struct, frozen=True):
    """An entry."""

    id: str
    title: Markup
    pieces: tuple[PieceView, ...]
    place: OwnerLink
    used: OwnerLinks


class LetterView(Struct, frozen=True):
    """The entries under a letter."""

    letter: str
    terms: tuple[TermView, ...]


def glossary_values(library: Library) -> dict[str, object]:
    """What the glossary shows."""
    place = urls.Place("glossary/index.html")
    terms = sorted(library.references.terms.values(), key=lambda t: sort_key(t.term.name))
    groups = groupby(terms, key=lambda t: initial(t.term.name))
    letters = tuple(
        LetterView(letter, tuple(_view(library, place, term) for term in group))
        for letter, group in groups
    )
    return {
        "letters": letters,
        "symbols": place.href("symbols/index.html") if library.references.has_symbols else "",
    }


def _view(library: Library, place: urls.Place, found: GlossaryTerm) -> TermView:
    term = found.term
    return TermView(
        term.id,
        Markup(term.title),
        tuple(PieceView(Markup(piece.html), piece.display) for piece in term.definition),
        owner_link(place, found.owner, f"term:{term.id}"),
        owner_links(library, place, found.used),
    )


def sort_key(name: str) -> tuple[object, ...]:
    """Digits and signs first, then Latin letters, then others; marks and case count last."""
    plain = _plain(name)
    first = plain[:1]
    return (first.isalpha() + (first.isalpha() and not _is_latin(first)), plain, name)


def initial(name: str) -> str:
    """The letter under which a name stands; empty for digits and signs."""
    first = _plain(name)[:1]
    return first.upper()[:1] if first.isalpha() else ""


def _plain(name: str) -> str:
    parts = unicodedata.normalize("NFKD", name.casefold())
    letters = "".join(char for char in parts if not unicodedata.combining(char))
    return letters.lstrip("$\\{[(\"'“‘ ")


def _is_latin(char: str) -> bool:
    return char.isascii() or unicodedata.name(char, "").startswith("LATIN")
