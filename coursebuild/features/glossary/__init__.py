"""The terms of a document with their definitions, and the page of all terms of the course.

A definition is the sentence with the term and the next one, as HTML. If they continue in a
displayed formula, the formula is part of it. Links lose their addresses, since the glossary is
another page; those without a text become the names of what they lead to, such as "Figure 4.2.3",
which depend on other documents and are filled in when the page is drawn.

A sentence ends at a full stop, a question or exclamation mark, with closing marks, before white
space; not after an initial or a usual abbreviation, and not before a small letter. The marks of
Chinese and Japanese need no white space.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Iterator
from itertools import groupby

from markupsafe import Markup
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import Feature, Library, Mathml, PageKind, Parsed, model, regex, urls
from coursebuild.core.pages import document_inputs, typography
from coursebuild.core.pages.library import links
from coursebuild.core.pages.markup import HtmlWriter
from coursebuild.core.pages.numbering import UNNAMED, fill_in, name_outside


class DefinitionPart(Struct, frozen=True):
    """A part of a definition, as HTML; `display` means a displayed formula."""

    html: Markup
    display: bool = False


class DefinedTerm(Struct, frozen=True):
    """A term with its definition."""

    id: str
    name: str
    title: Markup
    """The name as HTML."""
    definition: tuple[DefinitionPart, ...]
    targets: tuple[model.Target, ...] = ()
    """Where links without a text lead, in their order; each is `UNNAMED` there."""


class DocumentTerms(Struct, frozen=True):
    """The terms of a document, in the order of its text."""

    terms: tuple[DefinedTerm, ...]


class _ExcerptWriter(HtmlWriter):
    def __init__(self, mathml: Mathml) -> None:
        self._mathml = mathml

    def math(self, tex: str) -> Markup:
        mathml = self._mathml(tex, False)
        return Markup(typography.split_formula(mathml)) if mathml else super().math(tex)

    def display(self, tex: str, start: int) -> Markup:
        return Markup(self._mathml(tex, True)) or super().display(tex, start)


def document_terms(document: model.Document, mathml: Mathml) -> Parsed[DocumentTerms | None]:
    """Return the terms of a document; a formula that is not typeset remains TeX."""
    if "]{" not in document.source.text:
        return Parsed(None)
    writer = _ExcerptWriter(mathml)
    targets: list[model.Target] = []
    terms: list[DefinedTerm] = []

    def reference(target: model.Target) -> str:
        targets.append(target)
        return UNNAMED

    def html(inlines: tuple[model.Inline, ...]) -> Markup:
        return writer.inlines(model.without_links(inlines, reference))

    for siblings in model.sibling_groups(document):
        for number, block in enumerate(siblings):
            if not isinstance(block, model.Paragraph):
                continue
            for term in model.walk_inlines(block.children):
                if not isinstance(term, model.Term):
                    continue
                targets.clear()
                following = siblings[number + 1] if number + 1 < len(siblings) else None
                title = Markup.escape(term.name) if term.renamed else html(term.children)
                definition = definition_of(block.children, term)
                pieces = tuple(_split_definition(definition, following, html, writer))
                terms.append(DefinedTerm(term.id, term.name, title, pieces, tuple(targets)))
    return Parsed(DocumentTerms(tuple(terms)) if terms else None)


def _split_definition(
    definition: tuple[model.Inline, ...],
    following: model.Block | None,
    html: Callable[[tuple[model.Inline, ...]], Markup],
    writer: _ExcerptWriter,
) -> Iterator[DefinitionPart]:
    line: list[model.Inline] = []
    for inline in definition:
        if isinstance(inline, model.Math) and inline.display:
            yield DefinitionPart(html(tuple(line)).strip())
            yield DefinitionPart(writer.display(inline.tex.text, 0), display=True)
            line = []
        else:
            line.append(inline)
    if line:
        yield DefinitionPart(html(tuple(line)).strip())
    if isinstance(following, model.MathBlock) and following.tex.text and runs_on(definition):
        yield DefinitionPart(writer.display(following.tex.text, 0), display=True)


_END = regex(r"[.!?…؟।]+[\"'”’»)\]]*\s+|[。！？]+[」』）”’]*\s*")
_COMPLETE = regex(r"[.!?…؟।。！？][\"'”’»」』）)\]]*\s*$")
_LAST_WORD = regex(r"[^\s(\[“‘\"']*$")
_ABBREVIATIONS = frozenset(
    "approx. ca. cf. ch. e.g. eq. eqs. fig. figs. i.e. p. pp. ref. refs. resp. sec. viz. vs."
    " d.h. z.b. bzw. vgl. abb. gl. p.ej. u.a.".split()
)
_OBJECT = "\ufffc"
"""A character in place of content that is not text."""


def definition_of(inlines: tuple[model.Inline, ...], term: model.Term) -> tuple[model.Inline, ...]:
    """Return the sentence of a term and the next one, unless that defines another term."""
    texts = [_plain_text(inline) for inline in inlines]
    index = next(n for n, inline in enumerate(inlines) if term in model.walk_inlines((inline,)))
    term_start = sum(map(len, texts[:index]))
    text = "".join(texts)
    ends = [0]
    for mark in _END.finditer(text):
        end = mark.end()
        word = _LAST_WORD.search(text[: mark.start() + 1])
        is_short = word is not None and (
            word[0].lower() in _ABBREVIATIONS or (len(word[0]) == 2 and word[0][0].isalpha())
        )
        goes_on = text[end : end + 1].islower() or (is_short and mark[0][0] == ".")
        if mark[0][0] in "。！？" or not goes_on:
            ends.append(end)
    ends.append(len(text))
    start = max(end for end in ends if end <= term_start)
    stop, *later = (end for end in ends if end > term_start)
    sentence = tuple(_slice(inlines, texts, start, stop))
    following = tuple(_slice(inlines, texts, stop, later[0])) if later else ()
    has_term = any(isinstance(inline, model.Term) for inline in model.walk_inlines(following))
    return sentence if has_term else sentence + following


def runs_on(definition: tuple[model.Inline, ...]) -> bool:
    """Whether a definition continues after its paragraph."""
    return _COMPLETE.search("".join(map(_plain_text, definition))) is None


def _plain_text(inline: model.Inline) -> str:
    """Return the text of an inline that matters for the ends of sentences."""
    match inline:
        case model.Text():
            return inline.text
        case model.SoftBreak() | model.HardBreak():
            return " "
        case model.FootnoteRef() | model.RawInline():
            return ""
        case model.CodeSpan() | model.NumberBinding():
            return _OBJECT
        case _:
            parts = model.walk_inlines((inline,))
            texts = [part.text for part in parts if isinstance(part, model.Text)]
            return _OBJECT + (texts[-1][-1:] if texts else "")


def _slice(
    inlines: tuple[model.Inline, ...], texts: list[str], start: int, stop: int
) -> Iterator[model.Inline]:
    """Yield the inlines between two offsets of their text."""
    offset = 0
    for inline, text in zip(inlines, texts, strict=True):
        first, last = max(start - offset, 0), min(stop - offset, len(text))
        if isinstance(inline, model.Text):
            if first < last:
                yield model.Text(inline.span, inline.text[first:last])
        elif first < last or (not text and start < offset < stop):
            yield inline
        offset += len(text)


class TermEntry(Struct, frozen=True):
    """An entry of the glossary."""

    term: DefinedTerm
    place: document_inputs.OwnerLink
    """The lesson or page that defines it."""
    uses: document_inputs.OwnerLinks
    """The other lessons and pages that link to it, in the order of the course."""


def glossary_values(library: Library) -> dict[str, object]:
    """Return the values for the template: the entries, grouped by letters."""
    place = urls.Place("glossary/index.html")
    users: dict[str, list[model.Owner]] = {}
    for owner, document in library.course.owned_documents:
        targets = links(library.course, document)
        for id in {target.id for target in targets if isinstance(target, model.TermTarget)}:
            users.setdefault(id, []).append(owner)
    entries: dict[str, TermEntry] = {}  # of a term, for its first definition
    for owner, document_terms in library.summaries("glossary"):
        for term in document_terms.terms:
            if term.id not in entries:
                names = (name_outside(library, owner, target) for target in term.targets)
                title = fill_in(term.title, names)
                pieces = tuple(replace(p, html=fill_in(p.html, names)) for p in term.definition)
                term = replace(term, title=title, definition=pieces, targets=())
                term_users = [user for user in users.get(term.id, ()) if user is not owner]
                link = document_inputs.owner_link(place, owner, f"term:{term.id}")
                entries[term.id] = TermEntry(
                    term, link, document_inputs.owner_links(place, term_users)
                )
    sorted_entries = sorted(entries.values(), key=lambda entry: sort_key(entry.term.name))
    groups = groupby(sorted_entries, key=lambda entry: initial(entry.term.name))
    return {
        "letters": tuple((letter, tuple(group)) for letter, group in groups),
        "symbols": document_inputs.added_page(library, place, "symbols"),
    }


def sort_key(name: str) -> tuple[object, ...]:
    """Sort digits and signs before Latin letters and others; marks and case count last."""
    plain = _without_accents(name)
    first = plain[:1]
    is_latin = first.isascii() or unicodedata.name(first, "").startswith("LATIN")
    return (first.isalpha() + (first.isalpha() and not is_latin), plain, name)


def initial(name: str) -> str:
    """Return the letter under which a name is listed; empty for digits and signs."""
    first = _without_accents(name)[:1]
    return first.upper()[:1] if first.isalpha() else ""


def _without_accents(name: str) -> str:
    parts = unicodedata.normalize("NFKD", name.casefold())
    letters = "".join(char for char in parts if not unicodedata.combining(char))
    return letters.lstrip("$\\{[(\"'“‘ ")


FEATURE = Feature(
    name="glossary",
    summary=document_terms,
    pages=(
        PageKind(
            name="glossary",
            values=glossary_values,
            exists=lambda library: any(library.summaries("glossary")),
            order=20,
        ),
    ),
)
