"""What the search needs of a page: its text for the reader's browser, its terms for the index.

Entry points: `note_page(inputs, document, body)`, both as bytes, and `text_and_terms`, which
separates them; `script` and `as_json`, which write a file of the index.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

from coursebuild.core.model import Document
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.document_inputs import LessonLink
from coursebuild.core.pages.page_inputs import DocumentInputs, HighlightedFile, PageInputs
from coursebuild.core.text.characters import visible
from coursebuild.features.search.sections import Section, SectionReader
from coursebuild.features.search.words import count_terms

_EXCLUDED_KINDS = frozenset({"home", "notfound"})
"""Kinds of pages that nobody looks for: other pages have all of their content."""
LEAD_ONLY = frozenset({"level", "stub"})
"""Kinds of pages that are found by title and summary only: other pages have the rest."""
_TITLE, _HEADING, _TEXT, _CODE = 3, 2, 1, 0
"""The parts of a page, by the weight of a term in them."""
_WEIGHTS = tuple(
    tuple(f"{field << 2 | often:x}" for often in (0, 0, 1, 1, 2, 2, 2, 2, 2, 2, 3))
    for field in range(4)
)
"""The digit of a term by its field and how often it occurs; see `weigh_terms`."""
_FIELDS = {"text": _TEXT, "formula": _TEXT, "code": _CODE, "output": _CODE}


def note_page(inputs: PageInputs, page: PageContext | None, body: str) -> bytes:
    """Return the note of a page for the search; empty if it is not searched.

    Args:
        inputs: what is drawn.
        page: the document on it, where it has one.
        body: its HTML.
    """
    if inputs.head.kind in _EXCLUDED_KINDS or not (
        inputs.head.indexed or inputs.head.kind in LEAD_ONLY
    ):
        return b""
    head = inputs.values.get("lesson")
    name = head.id if isinstance(head, LessonLink) else ""
    sections = page_sections(inputs, None if page is None else page.document, body)
    terms = weigh_terms([name, inputs.head.title], sections)
    return visible(as_json(pack_sections(sections))).encode() + b"\0" + terms


def text_and_terms(note: bytes) -> tuple[bytes, bytes]:
    """Split a note into the page's text as a browser reads it, JSON, and the page's terms."""
    text, _, terms = note.partition(b"\0")
    return text, terms


def page_sections(inputs: PageInputs, document: Document | None, body: str) -> tuple[Section, ...]:
    """Return the sections of a page; see `note_page`."""
    head = inputs.values.get("lesson")
    lead: tuple[str, ...] = (inputs.head.description,)
    if isinstance(head, LessonLink):
        lead += (", ".join(head.aliases), *head.objectives)
    document_inputs = inputs.document_inputs or DocumentInputs()
    labels = {kind: callout.label for kind, callout in document_inputs.callouts.items()}
    reader = SectionReader(labels, document_inputs.blocks)
    for text in lead:
        reader.add("text", text)
    if document is not None:
        reader.document(document)
        return reader.end()
    for value in inputs.values.values():
        if isinstance(value, HighlightedFile):
            reader.add("code", value.text)
    if inputs.head.kind not in LEAD_ONLY:
        reader.html(body)
    return reader.end()


def as_json(value: object) -> str:
    """Write a value in as few characters as there can be."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


def script(kind: str, name: str, text: str) -> bytes:
    """Write a file of the index: a script that passes a value, given as JSON, to the search.

    It is a script because browsers load no other data from a disk.
    """
    return visible(f'coursebuildSearch.take("{kind}","{name}",{text})\n').encode()


def pack_sections(sections: Iterable[Section]) -> object:
    """Return the sections of a page as its file has them; kinds by their first letter."""
    return [
        [
            section.anchor,
            section.heading,
            section.level,
            [[piece.kind[0], piece.text] for piece in section.pieces],
            " ".join(section.names),
        ]
        for section in sections
    ]


def weigh_terms(titles: list[str], sections: Iterable[Section]) -> bytes:
    """Return the terms of a page with their weights, as sorted lines of a digit and a term.

    The digit is the field (0 to 3) times four, and how often the term occurs on the page: 0 for
    once, 1 up to three times, 2 up to nine, 3 for more.
    """
    fields: dict[int, list[str]] = {_CODE: [], _TEXT: [], _HEADING: [], _TITLE: titles}
    for section in sections:
        fields[_HEADING].append(section.heading)
        fields[_CODE] += section.names
        for piece in section.pieces:
            fields[_FIELDS[piece.kind]].append(piece.text)
    counts: dict[str, int] = {}
    best_fields: dict[str, int] = {}
    for field, texts in fields.items():
        for term, count in count_terms("\n".join(texts)).items():
            counts[term] = counts.get(term, 0) + count
            best_fields[term] = field
    lines = [_WEIGHTS[best_fields[term]][min(counts[term], 10)] + term for term in sorted(counts)]
    return "\n".join(lines).encode("utf-8", "replace")
