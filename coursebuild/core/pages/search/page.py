"""A page as it is searched: its text for the reader's browser, and its terms for the index.

Entry points: `searched(inputs, document, body)`; its steps `page_text`, `packed` and `terms`;
`call`, a file of the index.
"""

from __future__ import annotations

import json

from coursebuild.core.model import Document
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.lesson import LessonHead
from coursebuild.core.pages.page_inputs import Highlighted, PageInputs, ShownBench, ShownDocument
from coursebuild.core.pages.search.sections import document_sections
from coursebuild.core.pages.search.values import PageText, Searched, Section, SectionPiece
from coursebuild.core.pages.search.words import TERMS, runs

_LEFT_OUT = frozenset({"home", "notfound", "search"})
"""Kinds of pages that nobody looks for: all that stands on them stands on others as well."""
_LEADS = frozenset({"level", "stub"})
"""Kinds of pages of which the title and the summary count: the rest is of other pages."""
TITLE, HEADING, TEXT, CODE = 3, 2, 1, 0
"""Where a term stands, by weight."""
_FIELDS = {"text": TEXT, "formula": TEXT, "code": CODE, "output": CODE}
_SHORT = {"text": "t", "formula": "f", "code": "c", "output": "o"}


class _Digits(dict[int, str]):
    """The digit of a term by how often it occurs, for one field; see `terms`."""

    def __init__(self, field: int) -> None:
        once, few, some, self._many = (f"{field << 2 | often:x}" for often in range(4))
        super().__init__(
            {1: once, **dict.fromkeys((2, 3), few), **dict.fromkeys(range(4, 10), some)}
        )

    def __missing__(self, times: int) -> str:
        return self._many


_DIGITS = {field: _Digits(field) for field in (CODE, TEXT, HEADING, TITLE)}
_FUNCTION = "coursebuildSearch.take"
"""What a file of the index calls: browsers load scripts from a disk, but no other data."""


def searched(inputs: PageInputs, document: Document | None, body: str) -> Searched | None:
    """What a page gives to the search; `None` where it is not searched. See `page_text`."""
    text = page_text(inputs, document, body)
    if text is None:
        return None
    return Searched(text.name, call("page", "", packed(text)), terms(text))


def page_text(inputs: PageInputs, document: Document | None, body: str) -> PageText | None:
    """What a page is found by; `None` where it is not searched.

    Args:
        inputs: what is drawn.
        document: of the page, with its prose, where it has one.
        body: as it was drawn.
    """
    if inputs.kind in _LEFT_OUT or not (inputs.indexed or inputs.kind in _LEADS):
        return None
    head = inputs.values.get("lesson")
    name = head.id if isinstance(head, LessonHead) else ""
    lead = (inputs.description, *(head.objectives if isinstance(head, LessonHead) else ()))
    if document is not None:
        known = inputs.shown or ShownDocument()
        labels = {kind: shown.label for kind, shown in known.callouts.items()}
        measured = {at: _scenario(shown) for at, shown in known.benches.items()}
        return PageText(inputs.title, name, document_sections(document, lead, labels, measured))
    code = [v.text for v in inputs.values.values() if isinstance(v, Highlighted)]
    pieces = [SectionPiece("text", text) for text in lead if text] + [
        SectionPiece("code", t) for t in code if t
    ]
    return PageText(inputs.title, name, (Section("", "", 0, tuple(pieces)), *_drawn(inputs, body)))


def _drawn(inputs: PageInputs, body: str) -> tuple[Section, ...]:
    """The sections of a page that was made from no document."""
    if inputs.kind in _LEADS:
        return ()
    from coursebuild.core.pages.search.sections import drawn_sections  # and a parser of HTML

    return drawn_sections(body)


def _scenario(shown: ShownBench) -> str:
    """What a shown report is about."""
    return "" if shown.report is None else shown.report.title or shown.report.name


def call(kind: str, name: str, value: object) -> bytes:
    """A file of the index: a script that hands over a value."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    return visible(f"{_FUNCTION}({json.dumps(kind)},{json.dumps(name)},{text})\n").encode()


def packed(text: PageText) -> object:
    """The sections of a page as its file has them."""
    return [
        [
            section.anchor,
            section.heading,
            section.level,
            [[_SHORT[piece.kind], piece.text] for piece in section.pieces],
            " ".join(section.also),
        ]
        for section in text.sections
    ]


def terms(text: PageText) -> bytes:
    """The terms of a page with their weight: lines of a hexadecimal digit and a term, sorted.

    The digit is the field (0 to 3) times four, and how often the term occurs on the page: 0 for
    once, 1 up to three times, 2 up to nine, 3 for more.
    """
    times: dict[str, int] = {}
    digits: dict[str, _Digits] = {}
    for field, said in sorted(_said(text).items()):
        digits_here = _DIGITS[field]
        for run, count in runs("\n".join(said)).items():
            for term in TERMS[run]:
                times[term] = times.get(term, 0) + count
                digits[term] = digits_here
    lines = [digits[term][times[term]] + term for term in sorted(times)]
    return "\n".join(lines).encode("utf-8", "replace")


def _said(text: PageText) -> dict[int, list[str]]:
    """What the page says, by field."""
    found: dict[int, list[str]] = {TITLE: [text.name, text.title], HEADING: [], TEXT: [], CODE: []}
    for section in text.sections:
        found[HEADING].append(section.heading)
        found[CODE] += section.also
        for piece in section.pieces:
            found[_FIELDS[piece.kind]].append(piece.text)
    return found
