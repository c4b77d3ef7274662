"""The glossary: every term of the course with its definition and its uses.

Entry point: `glossary_values`, for the page.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from itertools import groupby

from msgspec import Struct

from coursebuild.core.model import Owner, TermTarget
from coursebuild.core.pages import urls
from coursebuild.core.pages.document_inputs import (
    OwnerLink,
    OwnerLinks,
    added_page,
    owner_link,
    owner_links,
)
from coursebuild.core.pages.library import Library, links
from coursebuild.features.glossary.terms import DefinedTerm


class TermEntry(Struct, frozen=True):
    """An entry of the glossary."""

    term: DefinedTerm
    place: OwnerLink
    """The lesson or page that defines it."""
    uses: OwnerLinks
    """The other lessons and pages that link to it, in the order of the course."""


def glossary_values(library: Library) -> dict[str, object]:
    """Return the values for the template: the entries, grouped by letters."""
    place = urls.Place("glossary/index.html")
    entries = sorted(_term_entries(library, place), key=lambda entry: sort_key(entry.term.name))
    groups = groupby(entries, key=lambda entry: initial(entry.term.name))
    return {
        "letters": tuple((letter, tuple(group)) for letter, group in groups),
        "symbols": added_page(library, place, "symbols"),
    }


def _term_entries(library: Library, place: urls.Place) -> Iterator[TermEntry]:
    """Yield an entry for each term of the course, for its first definition."""
    users: dict[str, list[Owner]] = {}
    for owner, document in library.course.owned_documents:
        targets = links(library.course, document)
        for id in {target.id for target in targets if isinstance(target, TermTarget)}:
            users.setdefault(id, []).append(owner)
    ids: set[str] = set()
    for owner, document_terms in library.summaries("glossary"):
        for term in document_terms.terms:
            if term.id not in ids:
                ids.add(term.id)
                term_users = [user for user in users.get(term.id, ()) if user is not owner]
                link = owner_link(place, owner, f"term:{term.id}")
                yield TermEntry(term, link, owner_links(place, term_users))


def sort_key(name: str) -> tuple[object, ...]:
    """Sort digits and signs before Latin letters and others; marks and case count last."""
    plain = _without_accents(name)
    first = plain[:1]
    return (first.isalpha() + (first.isalpha() and not _is_latin(first)), plain, name)


def initial(name: str) -> str:
    """Return the letter under which a name is listed; empty for digits and signs."""
    first = _without_accents(name)[:1]
    return first.upper()[:1] if first.isalpha() else ""


def _without_accents(name: str) -> str:
    """Return a name in lower case, without accents and leading signs."""
    parts = unicodedata.normalize("NFKD", name.casefold())
    letters = "".join(char for char in parts if not unicodedata.combining(char))
    return letters.lstrip("$\\{[(\"'“‘ ")


def _is_latin(char: str) -> bool:
    return char.isascii() or unicodedata.name(char, "").startswith("LATIN")
