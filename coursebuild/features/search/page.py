"""A page as it is searched: its text for the reader's browser, and its terms for the index.

Entry points: `note_page(inputs, document, body)`, both as bytes, and `text_and_terms`, which takes
them apart; `call`, a file of the index.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

from coursebuild.core.model import Document
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.lesson import LessonLink
from coursebuild.core.pages.page_inputs import DocumentInputs, HighlightedFile, PageInputs
from coursebuild.features.search.sections import (
    Section,
    SectionPiece,
    document_sections,
    drawn_sections,
)
from coursebuild.features.search.words import count_terms

_LEFT_OUT = frozenset({"home", "notfound"})
"""Kinds of pages that nobody looks for: all that stands on them stands on others as well."""
_LEADS = frozenset({"level", "stub"})
"""Kinds of pages of which the title and the summary count: the rest is of other pages."""
_TITLE, _HEADING, _TEXT, _CODE = 3, 2, 1, 0
"""Where a term stands, by weight."""
_WEIGHTS = tuple(
    tuple(f"{field << 2 | often:x}" for often in (0, 0, 1, 1, 2, 2, 2, 2, 2, 2, 3))
    for field in range(4)
)
"""The digit of a term by its field and how often it occurs; see `terms`."""
_FIELDS = {"text": _TEXT, "formula": _TEXT, "code": _CODE, "output": _CODE}


def note_page(inputs: PageInputs, page: PageContext | None, body: str) -> bytes:
    """What a page gives to the search; nothing where it is not searched.

    Args:
        inputs: what is drawn.
        page: the document on it, where it has one.
        body: its HTML.
    """
    if inputs.head.kind in _LEFT_OUT or not (inputs.head.indexed or inputs.head.kind in _LEADS):
        return b""
    head = inputs.values.get("lesson")
    name = head.id if isinstance(head, LessonLink) else ""
    sections = page_sections(inputs, None if page is None else page.document, body)
    return call("page", "", packed(sections)) + b"\0" + terms([name, inputs.head.title], sections)


def text_and_terms(note: bytes) -> tuple[bytes, bytes]:
    """The file that a browser loads to show what it found, and the page's terms."""
    text, _, terms = note.partition(b"\0")
    return text, terms


def page_sections(inputs: PageInputs, document: Document | None, body: str) -> tuple[Section, ...]:
    """What stands on a page; see `note_page`."""
    head = inputs.values.get("lesson")
    lead: tuple[str, ...] = (inputs.head.description,)
    if isinstance(head, LessonLink):
        lead += (", ".join(head.aliases), *head.objectives)
    if document is not None:
        known = inputs.document_inputs or DocumentInputs()
        labels = {kind: shown.label for kind, shown in known.callouts.items()}
        return document_sections(document, lead, labels, known.blocks)
    code = [v.text for v in inputs.values.values() if isinstance(v, HighlightedFile)]
    pieces = [SectionPiece("text", text) for text in lead if text]
    pieces += [SectionPiece("code", text) for text in code if text]
    drawn = () if inputs.head.kind in _LEADS else drawn_sections(body)
    return (Section("", "", 0, tuple(pieces)), *drawn)


def call(kind: str, name: str, value: object) -> bytes:
    """A file of the index: a script that hands over a value.

    Browsers load scripts from a disk, but no other data.
    """
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    return visible(f'coursebuildSearch.take("{kind}","{name}",{text})\n').encode()


def packed(sections: Iterable[Section]) -> object:
    """The sections of a page as its file has them; kinds by their first letter."""
    return [
        [
            section.anchor,
            section.heading,
            section.level,
            [[piece.kind[0], piece.text] for piece in section.pieces],
            " ".join(section.also),
        ]
        for section in sections
    ]


def terms(titles: list[str], sections: Iterable[Section]) -> bytes:
    """The terms of a page with their weight: lines of a hexadecimal digit and a term, sorted.

    The digit is the field (0 to 3) times four, and how often the term occurs on the page: 0 for
    once, 1 up to three times, 2 up to nine, 3 for more.
    """
    fields: dict[int, list[str]] = {_CODE: [], _TEXT: [], _HEADING: [], _TITLE: titles}
    for section in sections:
        fields[_HEADING].append(section.heading)
        fields[_CODE] += section.also
        for piece in section.pieces:
            fields[_FIELDS[piece.kind]].append(piece.text)
    times: dict[str, int] = {}
    best: dict[str, int] = {}
    for field, texts in fields.items():
        for term, count in count_terms("\n".join(texts)).items():
            times[term] = times.get(term, 0) + count
            best[term] = field
    lines = [_WEIGHTS[best[term]][min(times[term], 10)] + term for term in sorted(times)]
    return "\n".join(lines).encode("utf-8", "replace")
