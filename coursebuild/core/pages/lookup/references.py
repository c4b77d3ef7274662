"""What the documents of a course say of each other: links, terms and symbols, brought together.

Entry points: `mentions(document, course, lexicon)`, for one document; `CrossReferences.of`, for all
of them.

Each document is looked at once. What is kept is what pages show: who refers to a lesson, where a
term is defined and used, which symbols there are and where.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import TypeAlias

from msgspec import Struct, field

from coursebuild.core.model import (
    Course,
    DefinedTerm,
    Document,
    Lesson,
    LessonTarget,
    Lexicon,
    Link,
    Page,
    TermTarget,
    document_inlines,
    resolve,
)
from coursebuild.core.pages import urls

Owner: TypeAlias = Lesson | Page


def owner_path(owner: Owner) -> str:
    """The site path of the page of a lesson, or of another page."""
    return urls.lesson_path(owner) if isinstance(owner, Lesson) else urls.page_path(owner)


class Mentions(Struct, frozen=True):
    """What one document says of others, and adds to what all share."""

    lessons: frozenset[str] = frozenset()
    """Ids of lessons that it links to."""
    terms: frozenset[str] = frozenset()
    """Ids of terms that it links to."""
    lexicon: Lexicon = field(default_factory=Lexicon)


class GlossaryTerm(Struct, frozen=True):
    """A term of the course."""

    term: DefinedTerm
    owner: Owner
    """Where it is defined."""
    used: tuple[Owner, ...]
    """Where else it is linked to, in the order of the course."""


class SymbolMeaning(Struct, frozen=True):
    """What a symbol stands for, and in which documents."""

    text: str
    unit: str
    owners: tuple[Owner, ...]


class CourseSymbol(Struct, frozen=True):
    """A symbol of the formulas of the lessons of a course."""

    symbol: str
    """See `SymbolUse`."""
    section: tuple[str, str]
    """Anchor and text of the heading under which it stands first; empty before the first."""
    owners: tuple[Owner, ...]
    """Where it is used, in the order of the course."""
    meanings: tuple[SymbolMeaning, ...]
    """In the order of the course; none where nobody says."""


class CrossReferences(Struct, frozen=True, dict=True):
    """See the module."""

    referrers: Mapping[str, tuple[Owner, ...]] = field(default_factory=dict)
    """Who links to a lesson, by its id, in the order of the course."""
    terms: Mapping[str, GlossaryTerm] = field(default_factory=dict)
    """By id; of two definitions the first."""
    has_symbols: bool = False
    documents: Callable[[], Iterable[tuple[Owner, Mentions]]] = tuple
    """Gives lessons and pages in the order of the course."""

    @cached_property
    def symbols(self) -> tuple[CourseSymbol, ...]:
        """In the order in which they are first used.

        They are many, and only the page that lists them needs them.
        """
        rows: dict[str, _Row] = {}
        for owner, said in self.documents():
            if isinstance(owner, Lesson):
                _note_symbols(rows, owner, said.lexicon)
        return tuple(row.made(symbol) for symbol, row in rows.items())

    @classmethod
    def of(cls, documents: Callable[[], Iterable[tuple[Owner, Mentions]]]) -> CrossReferences:
        """All of it, from what gives lessons and pages in the order of the course."""
        referrers: dict[str, list[Owner]] = {}
        users: dict[str, list[Owner]] = {}
        defined: dict[str, tuple[DefinedTerm, Owner]] = {}
        has_symbols = False
        for owner, said in documents():
            for id in said.lessons:
                if not (isinstance(owner, Lesson) and owner.id == id):
                    referrers.setdefault(id, []).append(owner)
            for id in said.terms:
                users.setdefault(id, []).append(owner)
            for term in said.lexicon.terms:
                defined.setdefault(term.id, (term, owner))
            if not has_symbols and isinstance(owner, Lesson):
                has_symbols = bool(said.lexicon.symbols)
        terms = {
            id: GlossaryTerm(term, owner, tuple(o for o in users.get(id, ()) if o is not owner))
            for id, (term, owner) in defined.items()
        }
        referred = {id: tuple(found) for id, found in referrers.items()}
        return cls(referred, terms, has_symbols, documents)


class _Row(Struct):
    """A symbol, as far as the course was looked at."""

    section: tuple[str, str]
    owners: list[Owner] = field(default_factory=list)
    meanings: dict[tuple[str, str], list[Owner]] = field(default_factory=dict)

    def made(self, symbol: str) -> CourseSymbol:
        """The whole."""
        meanings = (SymbolMeaning(*said, tuple(owners)) for said, owners in self.meanings.items())
        return CourseSymbol(symbol, self.section, tuple(self.owners), tuple(meanings))


def _note_symbols(rows: dict[str, _Row], owner: Owner, lexicon: Lexicon) -> None:
    symbols, sections = lexicon.symbols, lexicon.sections
    for use in symbols:
        row = rows.get(use.symbol)
        if row is None:
            section = sections[use.section] if use.section >= 0 else ("", "")
            row = rows[use.symbol] = _Row(section)
        row.owners.append(owner)
        if use.meaning:
            row.meanings.setdefault((use.meaning, use.unit), []).append(owner)


def mentions(document: Document, course: Course, lexicon: Lexicon) -> Mentions:
    """What a document says; its summary does as well."""
    lessons: set[str] = set()
    terms: set[str] = set()
    path = document.source.path
    for inline in document_inlines(document):
        if isinstance(inline, Link):
            target = resolve(inline.target, course, path)
            if isinstance(target, LessonTarget):
                lessons.add(target.id)
            elif isinstance(target, TermTarget):
                terms.add(target.id)
    return Mentions(frozenset(lessons), frozenset(terms), lexicon)
