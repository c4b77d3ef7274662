"""The glossary: every term of the course, what the text says of it, and where it is used.

Entry points: `course_terms`; `glossary_values`, what the page shows.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from itertools import groupby

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.model import TermTarget
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library, Owner, documents, links
from coursebuild.core.pages.owner_links import (
    OwnerLink,
    OwnerLinks,
    added_page,
    owner_link,
    owner_links,
)
from coursebuild.features.glossary.terms import DefinedTerm


class GlossaryTerm(Struct, frozen=True):
    """A term of the course."""

    term: DefinedTerm
    owner: Owner
    """Where it is defined."""
    used: tuple[Owner, ...]
    """Where else it is linked to, in the order of the course."""


def course_terms(library: Library) -> Iterator[GlossaryTerm]:
    """The terms of a course; of two definitions of one the first."""
    users: dict[str, list[Owner]] = {}
    for owner, document in documents(library.course):
        targets = links(library.course, document)
        for id in {target.id for target in targets if isinstance(target, TermTarget)}:
            users.setdefault(id, []).append(owner)
    done: set[str] = set()
    for owner, found in library.summaries("glossary"):
        for term in found.terms:
            if term.id not in done:
                done.add(term.id)
                used = tuple(user for user in users.get(term.id, ()) if user is not owner)
                yield GlossaryTerm(term, owner, used)


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
    terms = sorted(course_terms(library), key=lambda t: sort_key(t.term.name))
    groups = groupby(terms, key=lambda t: initial(t.term.name))
    letters = tuple(
        LetterView(letter, tuple(_view(library, place, term) for term in group))
        for letter, group in groups
    )
    return {
        "letters": letters,
        "symbols": added_page(library, place, "symbols"),
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
