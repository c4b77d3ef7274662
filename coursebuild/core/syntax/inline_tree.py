"""Inline content: one pass over markdown-it's flat tokens makes `Inline` nodes with spans."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from markdown_it.common.utils import normalizeReference
from markdown_it.helpers import parseLinkDestination
from markdown_it.token import Token
from msgspec import Struct, field

from coursebuild.core import model
from coursebuild.core.syntax.attributes import (
    check_unread_attributes,
    collapse_spaces,
    read_meaning,
    read_term,
    term_id,
)
from coursebuild.core.syntax.block_parser import References
from coursebuild.core.syntax.html import LITERAL, Balance, find_forbidden, find_media, tags
from coursebuild.core.syntax.inline_parser import inline_tokens
from coursebuild.core.syntax.link_targets import (
    TextPiece,
    check_link_text,
    check_scheme,
    classify,
    link_mentions,
    may_mention,
    named_lesson,
    text_inlines,
)
from coursebuild.core.syntax.other_tools import check_marks
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.syntax.spans import PositionedToken
from coursebuild.core.text.diagnostics import diagnose
from coursebuild.core.text.numbers import find_unread
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span

MAX_DEPTH = 60
"""How deep emphasis may nest; deeper marks are dropped."""

_NUMBERS = ("number_binding", "number_given")
_UNCLOSED = "display math is never closed"
_CONTROL = regex("[\x01-\x08\x0b\x0e-\x1f\x7f-\x9f\u202a-\u202e]")
_DEFINITION_HEAD = regex(r"\[(?:\\.|[^\[\]\\])*\]:\s*", re.DOTALL)


class _Frame(Struct):
    """An open inline, and the nodes in it so far."""

    token: PositionedToken | None
    nodes: list[model.Inline] = field(default_factory=list)


def read_inlines(
    content: Excerpt,
    state: ParsingState,
    references: References,
    balance: Balance,
    *,
    mentions: bool = True,
    html: bool = False,
) -> tuple[model.Inline, ...]:
    """The inlines of a block's content.

    In `html` only tags, entities and formulas are read, and its elements may be closed in
    another block.
    """
    tokens = inline_tokens(content.text, {"references": references}, html=html)
    reader = _TokenReader(content, state, references, balance, mentions)
    if html:
        return reader.read(tokens, html=True)
    balance.enter()
    inlines = reader.read(tokens)
    balance.leave()
    return inlines


class _TokenReader:
    """Reads the tokens of one block, with a stack of open emphasis, links and terms."""

    def __init__(
        self,
        content: Excerpt,
        state: ParsingState,
        references: References,
        balance: Balance,
        mentions: bool,
    ) -> None:
        self.content, self.state, self.references = content, state, references
        self.balance = balance
        self.report = state.report
        self.stack = [_Frame(None)]
        self.pieces: list[TextPiece] = []
        self.texts: list[tuple[int, str]] = []
        self.open_links = 0 if mentions and may_mention(content.text, state.words) else 1
        """How many links and terms are open; one more if mentions are not wanted."""
        self.open_literals = 0
        """How many elements of HTML are open in which every character stands for itself."""

    def read(
        self, tokens: Iterable[PositionedToken], *, html: bool = False
    ) -> tuple[model.Inline, ...]:
        for token in tokens:
            kind = token.type
            if kind in ("text", "text_special"):
                text = token.content
                if text:
                    literal = kind == "text" or text == token.markup
                    self.pieces.append(TextPiece(text, token.start, token.end, literal))
                    opening = self.stack[-1].token
                    is_address = opening is not None and opening.markup == "autolink"
                    if literal and not self.open_literals and not is_address:
                        self.texts.append((token.start, text))
            elif kind == "softbreak":
                self.pieces.append(TextPiece("\n", token.start, token.end, False))
            elif kind == "math_unclosed":
                place, message = self.content.span(token.start, token.end), _UNCLOSED
                help = "close it with `$$` in the same paragraph, or write `\\$` for a dollar sign"
                self.report(diagnose("math-unclosed", place, message, help=help))
                self.pieces.append(TextPiece(token.content, token.start, token.end))
            elif token.nesting == 1:
                self._open(token)
            elif token.nesting == -1:
                self._close(token)
            else:
                self._add_leaf(token)
        self._flush()
        for start, text in self.texts:
            if (character := _CONTROL.search(text)) is not None:
                message = f"the text contains the control character U+{ord(character[0]):04X}"
                place = self.content.span(start + character.start(), start + character.end())
                help = "delete it, or write the character that was meant"
                self.report(diagnose("control-character", place, message, help=help))
            if (at := text.find("<!--")) >= 0:
                message, at = "this comment is never closed", start + at
                place = self.content.span(at, at + 4)
                help = "close it with `-->` in the same paragraph, or write `\\<` for the character"
                self.report(diagnose("html-unbalanced", place, message, help=help))
        if not html:
            for start, text in self.texts:
                self.state.diagnostics += check_marks(self.content, start, text)
                self.state.diagnostics += check_unread_attributes(self.content, start, text)
        return tuple(self.stack[0].nodes)

    def _flush(self) -> None:
        pieces = self.pieces
        if not pieces:
            return
        self.pieces = []
        nodes = self.stack[-1].nodes
        if not self.open_links and not self.open_literals:
            nodes += link_mentions(pieces, self.content, self.state.words)
        else:
            nodes += text_inlines(pieces, self.content)

    # -- containers

    def _open(self, token: PositionedToken) -> None:
        self._flush()
        is_link = token.type == "link_open"
        flat = len(self.stack) > MAX_DEPTH and not is_link and token.type != "term_open"
        self.stack.append(_Frame(token, self.stack[-1].nodes if flat else []))
        self.balance.enter()
        self.open_links += is_link or token.type == "term_open"

    def _close(self, token: PositionedToken) -> None:
        self._flush()
        frame = self.stack.pop()
        self.balance.leave()
        siblings = self.stack[-1].nodes
        if frame.nodes is siblings:
            return
        opening, children = frame.token, tuple(frame.nodes)
        assert opening is not None
        node: model.Inline | None
        match token.type:
            case "link_close":
                node = self._close_link(opening, token, children)
            case "term_close":
                node = self._close_term(opening, token, children)
            case "strong_close":
                node = model.Strong(self.content.span(opening.start - 1, token.end + 1), children)
            case "em_close":
                node = model.Emphasis(self.content.span(opening.start, token.end), children)
            case _:
                node = model.Strikethrough(self.content.span(opening.start, token.end), children)
        self.open_links -= token.type in ("link_close", "term_close")
        siblings.extend(children if node is None else (node,))

    def _close_term(
        self, opening: PositionedToken, closing: PositionedToken, children: tuple[model.Inline, ...]
    ) -> model.Term | None:
        assert closing.map is not None
        span = self.content.span(opening.start, closing.end)
        report = self.report
        given_name = read_term(self.content.slice(*closing.map), report)
        if given_name is None:
            return None
        name = given_name or collapse_spaces(model.plain_text(children))
        if not term_id(name):
            report(diagnose("term-attribute", span, "the term has no letters and no digits"))
            return None
        return model.Term(span, children, name, term_id(name), bool(given_name))

    def _close_link(
        self, opening: PositionedToken, closing: PositionedToken, children: tuple[model.Inline, ...]
    ) -> model.Link | None:
        url = str(opening.attrs["href"])
        span = self.content.span(opening.start, closing.end)
        destination = self.content.span(opening.start + 1, closing.end - 1)
        if opening.markup != "autolink":
            destination = self._find_destination(opening.start, closing.start, closing.end)
        diagnostic = check_scheme(url, destination)
        if diagnostic is not None:
            self.report(diagnostic)
            return None
        title, target = str(opening.attrs.get("title", "")), classify(url)
        if (diagnostic := check_link_text(target, children, span)) is not None:
            self.report(diagnostic)
        is_of_lesson = isinstance(target, model.LessonTarget)
        lesson = named_lesson(children, self.state.words) if is_of_lesson else ""
        bare = not children
        return model.Link(
            span, target, destination, title, children, bare=bare, lesson_in_text=lesson
        )

    def _find_destination(self, start: int, label_end: int, end: int) -> Span:
        """The span of the destination of a link or image: in itself, or in its definition."""
        text = self.content.text
        if end > label_end + 1 and text[label_end + 1] == "(":
            at = label_end + 2
            while text[at] in " \t\n":
                at += 1
            return _find_address(self.content, at) or self.content.span(start, end)
        label = text[start + 1 : label_end]
        if end > label_end + 3:
            label = text[label_end + 2 : end - 1]
        definition = self.references.get(normalizeReference(label))
        if definition is None:
            return self.content.span(start, end)
        definition_text: Excerpt = definition["place"]
        head = _DEFINITION_HEAD.match(definition_text.text)
        address = None if head is None else _find_address(definition_text, head.end())
        return address or definition_text.span()

    # -- leaves

    def _add_leaf(self, token: PositionedToken) -> None:
        self._flush()
        span = self.content.span(token.start, token.end)
        node: model.Inline | None = None
        match token.type:
            case "math":
                node = self._read_math(token, span)
            case "code_inline":
                node = model.CodeSpan(span, token.content, token.info == "code")
            case type if type in _NUMBERS:
                node = self._read_number(token)
            case "html_inline":
                node = self._read_html(token, span)
            case "image":
                node = self._read_image(token, span)
            case "hardbreak":
                node = model.HardBreak(span)
            case "footnote_ref":
                node = self.state.notes.refer(token.content, span)
                if node is None:
                    self.pieces.append(TextPiece(f"[^{token.content}]", token.start, token.end))
            case "citation":
                node = model.Citation(span, tuple(self._read_works(token)))
            case _:
                raise AssertionError(f"no inline for token {token.type}")
        if node is not None:
            self.stack[-1].nodes.append(node)

    def _read_math(self, token: PositionedToken, span: Span) -> model.Math:
        assert token.map is not None
        if not token.content.strip():
            self.report(diagnose("math-syntax", span, "the formula is empty"))
        tex, display = self.content.slice(*token.map), token.info == "display"
        tex, numbers = self.state.read_formula(tex)
        if token.meta["braces"] is None:
            return model.Math(span, tex, display, numbers=numbers)
        braces = self.content.slice(*token.meta["braces"])
        if not display:
            comma = self.state.has_decimal_comma
            meaning = read_meaning(braces, tex, numbers, self.report, comma=comma)
            return model.Math(span, tex, display, None, *meaning, numbers)
        label = self.state.take_label(braces, "eq")
        return model.Math(span, tex, display, label, numbers=numbers)

    def _read_number(self, token: PositionedToken, shift: int = 0) -> model.NumberBinding:
        """The number of a token that counts from `shift`."""
        assert token.map is not None
        span = self.content.span(shift + token.start, shift + token.end)
        start, end = shift + token.map[0], shift + token.map[1]
        if end - start == len(token.content) + 2:
            start, end = start + 1, end - 1
        place = self.content.span(start, end)
        is_given = token.type == "number_given"
        if is_given and (unread := find_unread(token.content)) is not None:
            span_of_number = self.content.span(start + unread[0], start + unread[1])
            message = f"`{span_of_number.text}` cannot be read as a number"
            help = "write it as `0.5`, `1e-5` or `3 × 10⁻⁵`, and a range as `3–5`"
            self.report(diagnose("number-form", span_of_number, message, help=help))
        return model.NumberBinding(
            span,
            token.content,
            place,
            script=None if is_given else token.info or None,
            source=collapse_spaces(token.info) if is_given else None,
            comma=self.state.has_decimal_comma,
            words="" if is_given else collapse_spaces(token.meta["words"]),
            in_string=self.state.in_string,
        )

    def _read_html(self, token: PositionedToken, span: Span) -> model.RawInline:
        html = self.content.slice(token.start, token.end)
        for tag in tags(html.text):
            self.balance.add(tag, html)
            step = 0 if tag.is_complete else -1 if tag.is_end_tag else 1
            if tag.name == "a":
                self.open_links = max(0, self.open_links + step)
            elif tag.name in LITERAL:
                self.open_literals = max(0, self.open_literals + step)
        return model.RawInline(span, html.text, find_media(html), find_forbidden(html))

    def _read_image(self, token: PositionedToken, span: Span) -> model.Image:
        url, shift = str(token.attrs["src"]), token.start + len("![")
        numbers: list[model.NumberBinding] = []
        for child in token.children or ():
            if isinstance(child, PositionedToken) and child.type in _NUMBERS:
                numbers.append(self._read_number(child, shift))
            elif isinstance(child, PositionedToken) and child.type == "math" and child.map:
                tex = self.content.slice(*(shift + at for at in child.map))
                formula, numbers_of_formula = self.state.read_formula(tex)
                child.content = formula.text
                numbers += numbers_of_formula
        alt = alt_text(token.children or [])
        label_end = token.start + 2 + len(token.content)
        place = self._find_destination(token.start + 1, label_end, token.end)
        diagnostic = check_scheme(url, place, image=True)
        if diagnostic is not None:
            self.report(diagnostic)
            url = ""
        if not alt.strip():
            help = "say in the brackets what it shows, for readers who cannot see it"
            message = "the image has no alternative text"
            self.report(diagnose("image-alt", span, message, help=help))
        return model.Image(span, url, alt, str(token.attrs.get("title", "")), place, (*numbers,))

    def _read_works(self, token: PositionedToken) -> Iterator[model.CitedWork]:
        at = token.start + 1
        for part in token.content.split(";"):
            before, _, rest = part.partition("@")
            key, _, locator = rest.partition(",")
            start = at + len(before) + 1
            span = self.content.span(start, start + len(key.rstrip()))
            yield model.CitedWork(
                span, key.strip(), collapse_spaces(before), collapse_spaces(locator)
            )
            at += len(part) + 1


def _find_address(text: Excerpt, start: int) -> Span | None:
    """The address that begins at an offset, without angle brackets; `None` if there is none."""
    destination = parseLinkDestination(text.text, start, len(text.text))
    bracket = text.text.startswith("<", start)
    return text.span(start + bracket, destination.pos - bracket) if destination.ok else None


def alt_text(tokens: list[Token]) -> str:
    """The plain text of an image's description."""
    parts: list[str] = []
    for token in tokens:
        if token.type == "softbreak" or token.type == "hardbreak":
            parts.append("\n")
        elif token.children:
            parts.append(alt_text(token.children))
        elif token.type == "footnote_ref":
            parts.append(f"[^{token.content}]")
        elif token.type != "image":
            parts.append(token.content)
    return "".join(parts)
