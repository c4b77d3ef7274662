"""What the search needs of a page: its text for the reader's browser, its terms for the index.

The blocks of a document, or its HTML where a page shows none, are walked in order; a heading begins
a section, which is what is searched. Formulas become lines of plain text, and are also found by
their commands. Answers of quizzes are left out: a search must not give them away.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from html import unescape
from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild.api import Document, PageContext, PageInputs, model, regex
from coursebuild.core.model.inlines import CodeSpan
from coursebuild.core.pages.context import DocumentInputs, HighlightedFile
from coursebuild.core.pages.document_inputs import LessonLink
from coursebuild.core.pages.html_xml import HtmlContent, parse_html
from coursebuild.core.registry import kind_of_block
from coursebuild.core.text.characters import visible
from coursebuild.features.search.words import count_terms, plain_formula


class SectionPiece(Struct, frozen=True):
    """A paragraph, a listing, a formula, an output."""

    kind: Literal["text", "code", "formula", "output"]
    text: str


class Section(Struct, frozen=True):
    """A heading with the content up to the next heading."""

    anchor: str
    """The anchor of its heading; empty before the first heading."""
    heading: str
    level: int
    """The level of its heading, from 1; 0 where there is none."""
    pieces: tuple[SectionPiece, ...]
    names: tuple[str, ...] = ()
    """Names that it is found by and that are not shown: of TeX commands, of files."""
    symbols: tuple[str, ...] = ()
    """Symbols that it says the meaning of."""


_TAG = regex(r"<!--.*?-->|<(script|style)\b.*?</\1>|<[^>]*>", re.DOTALL | re.IGNORECASE)


_HEADINGS = {f"h{level}": level for level in range(1, 7)}
_SKIPPED_ELEMENTS = frozenset(
    ("script", "style", "nav", "svg", "pre", "template", "button", "select")
)
"""Elements that are not searched; code comes from the page's inputs."""
_LINES = frozenset(
    "p li dt dd td th tr table ul ol dl div section article figure figcaption summary main".split()
)


Reference: TypeAlias = Callable[[model.Target], str]
"""The text of a link that has none, from its target."""


def _unnamed(target: model.Target) -> str:
    return ""


class SectionReader:
    """Collects the sections of a page."""

    def __init__(
        self,
        labels: Mapping[str, str] = {},
        block_values: Mapping[int, Struct] = {},
        reference: Reference = _unnamed,
    ) -> None:
        """`labels` are those of callouts by their kind; `block_values` go by the block's offset."""
        self._reference = reference
        self._labels = labels
        self._block_values = block_values
        self._sections: list[Section] = []
        self._text = ""
        """The text of HTML since its last line."""
        self._begin("", "", 0)

    def _begin(self, anchor: str, heading: str, level: int) -> None:
        self._head = anchor, heading, level
        self._pieces: list[SectionPiece] = []
        self._names: dict[str, None] = {}
        self._symbols: list[str] = []

    def end(self) -> tuple[Section, ...]:
        """End the section, unless it has neither heading nor content, and return all sections."""
        if any(self._head) or self._pieces:
            names, symbols = tuple(self._names), tuple(self._symbols)
            self._sections.append(Section(*self._head, tuple(self._pieces), names, symbols))
        return tuple(self._sections)

    def add(self, kind: Literal["text", "code", "formula", "output"], text: str) -> None:
        """Add a piece to the section, unless it is empty."""
        text = text.strip("\n").rstrip() if kind in ("code", "output") else _line(text)
        if text:
            self._pieces.append(SectionPiece(kind, text))

    def add_name(self, name: str) -> None:
        """Add a name by which the section is found too."""
        self._names[name] = None

    def values(self, block: model.FeatureBlock) -> Struct | None:
        """Return the result of `FenceKind.values` for a block."""
        return self._block_values.get(block.span.start)

    def document(self, document: model.Document) -> None:
        """Read a full document, not its summary."""
        self.blocks(document.blocks)
        for footnote in document.footnotes:
            self.blocks(footnote.blocks)

    def blocks(self, blocks: Iterable[model.Block]) -> None:
        """Read blocks in order."""
        for block in blocks:
            self._block(block)

    def _block(self, block: model.Block) -> None:
        match block:
            case model.Paragraph() | model.HtmlFlow():
                self.add("text", self.text(block.children))
            case model.Heading():
                heading = _line(self.text(block.children))
                self.end()
                self._begin(block.anchor, heading, block.level)
            case model.ListBlock() | model.BlockQuote():
                self.blocks(model.child_blocks(block))
            case model.Callout():
                label = self._labels.get(block.kind, block.kind)
                self.add("text", f"{label}: {self.text(block.title)}" if block.title else label)
                self.blocks(block.blocks)
            case model.MathBlock():
                self.add("formula", self._formula(block.tex.text))
            case model.Table():
                self.add("text", self.text(block.caption))
                for row in (block.header, *block.rows):
                    self.add("text", " | ".join(self.text(cell.children) for cell in row))
            case model.HtmlBlock():
                self.add("text", unescape(_TAG.sub(" ", block.html)))
            case model.ThematicBreak():
                pass
            case model.CodeBlock() | model.PlainCode() | model.ScriptPart() | model.Mjcf():
                self.add("code", block.code.text)
            case model.Script():
                self._names[block.path] = None
                self.add("code", block.code.text)
            case model.Recording():
                if isinstance(block.body, model.Table):
                    self._block(block.body)
                else:
                    self.add("output", block.body.text)
            case model.FeatureBlock():
                kind_of_block(block).index(self, block)

    def _formula(self, tex: str) -> str:
        text, names = plain_formula(tex)
        self._names |= dict.fromkeys(names)
        return text

    def text(self, inlines: Iterable[model.Inline]) -> str:
        """Return the text of inlines, as the search has it."""
        return "".join(map(self._inline, model.walk_inlines(inlines, numbers=False)))

    def _inline(self, inline: model.Inline) -> str:
        match inline:
            case model.Text() | CodeSpan() | model.NumberBinding():
                return inline.text
            case model.Math():
                text = self._formula(inline.tex.text)
                if inline.meaning is not None:
                    self._names[inline.meaning.text] = None
                    self._symbols.append(text)
                return text
            case model.SoftBreak() | model.HardBreak():
                return " "
            case model.Image():
                return inline.alt
            case model.Link(children=()):
                return self._reference(inline.target)
            case model.RawInline():
                return " " if inline.html.lower().startswith("<br") else ""
            case _:
                return ""

    # --- HTML

    def html(self, body: str) -> None:
        """Read the body of a page: headings begin sections, other blocks begin lines."""
        self._elements(parse_html(body))
        self._end_line()

    def _elements(self, content: Iterable[HtmlContent]) -> None:
        for child in content:
            if isinstance(child, str):
                self._text += child
            elif child.name in _HEADINGS:
                self._end_line()
                self._elements(child.children)
                heading, self._text = _line(self._text), ""
                if child.name != "h1":  # the page's title
                    self.end()
                    id = child.attributes.get("id", "")
                    self._begin(id, heading, _HEADINGS[child.name])
            elif child.name in _LINES:
                self._end_line()
                self._elements(child.children)
                self._end_line()
            elif child.name not in _SKIPPED_ELEMENTS:
                self._elements(child.children)

    def _end_line(self) -> None:
        self.add("text", self._text)
        self._text = ""


def _line(text: str) -> str:
    return " ".join(text.split())


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
    """Return the note of a page with this HTML for the search; empty if it is not searched."""
    if inputs.head.kind in _EXCLUDED_KINDS or not (
        inputs.head.indexed or inputs.head.kind in LEAD_ONLY
    ):
        return b""
    head = inputs.values.get("lesson")
    name = head.id if isinstance(head, LessonLink) else ""
    if page is None:
        sections = page_sections(inputs, None, body)
    else:
        sections = page_sections(inputs, page.document, body, page.reference)
    # Sections as the page's file has them; kinds of pieces by their first letter
    rows = [
        [
            section.anchor,
            section.heading,
            section.level,
            [[piece.kind[0], piece.text] for piece in section.pieces],
            " ".join(section.names),
        ]
        for section in sections
    ]
    terms = weigh_terms([name, inputs.head.title], sections)
    return visible(as_json(rows)).encode() + b"\0" + terms


def text_and_terms(note: bytes) -> tuple[bytes, bytes]:
    """Split a note into the page's text as a browser reads it, JSON, and the page's terms."""
    text, _, terms = note.partition(b"\0")
    return text, terms


def page_sections(
    inputs: PageInputs, document: Document | None, body: str, reference: Reference = _unnamed
) -> tuple[Section, ...]:
    """Return the sections of a page; see `note_page`."""
    head = inputs.values.get("lesson")
    lead: tuple[str, ...] = (inputs.head.description,)
    if isinstance(head, LessonLink):
        lead += (", ".join(head.aliases), *head.objectives)
    document_inputs = inputs.document_inputs or DocumentInputs()
    labels = {kind: callout.label for kind, callout in document_inputs.callouts.items()}
    reader = SectionReader(labels, document_inputs.blocks, reference)
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


def weigh_terms(titles: list[str], sections: Iterable[Section]) -> bytes:
    """Return the terms of a page with their weights, as sorted lines of a digit and a term.

    The digit is the field (0 to 3) times four, and how often the term occurs on the page: 0 for
    once, 1 up to three times, 2 up to nine, 3 for more.
    """
    fields: dict[int, list[str]] = {_CODE: [], _TEXT: [], _HEADING: [], _TITLE: titles}
    for section in sections:
        fields[_HEADING] += section.heading, *section.symbols
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
