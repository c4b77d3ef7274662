"""Inline content: markdown-it's inline tokens become `Inline` nodes with spans.

Entry point: `InlineReader.read`. There is one pass over the flat tokens, with a stack of open
emphasis, strong, strikethrough, links and terms:

1. Texts and soft line ends are gathered; when something else comes, they become `Text`, `SoftBreak`
   and mentions (`mention`).
2. An opening token puts a frame on the stack, its closing token makes the node from what was
   gathered since.
3. Mistakes are reported on the way: attributes, schemes, images without text, footnotes that are
   not written, open formulas.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from markdown_it.common.utils import normalizeReference
from markdown_it.helpers import parseLinkDestination
from markdown_it.token import Token
from msgspec import Struct, field

from coursebuild.core.model import (
    CodeSpan,
    Emphasis,
    FootnoteRef,
    HardBreak,
    Image,
    Inline,
    Link,
    Math,
    NumberBinding,
    RawInline,
    Strikethrough,
    Strong,
    Term,
    plain_text,
)
from coursebuild.core.syntax.attributes import collapse_spaces, read_label, read_meaning, read_term
from coursebuild.core.syntax.headings import term_id
from coursebuild.core.syntax.html import LITERAL, Balance, find_media, tags
from coursebuild.core.syntax.inline_parser import inline_tokens
from coursebuild.core.syntax.links import (
    TextPiece,
    check_scheme,
    classify,
    link_mentions,
    may_mention,
    text_inlines,
)
from coursebuild.core.syntax.markdown import References
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.syntax.safe_html import find_forbidden
from coursebuild.core.syntax.spans import PositionedToken
from coursebuild.core.syntax.unread_markup import unread_markup
from coursebuild.core.text.diagnostics import diagnose
from coursebuild.core.text.source import Excerpt, Span

MAX_DEPTH = 60
"""Emphasis inside emphasis; what is deeper loses its marks."""

_BRACES = re.compile(r"\{[^}\n]{0,60}\}?")
_DEFINED = re.compile(r"\[(?:\\.|[^\[\]\\])*\]:\s*", re.DOTALL)


class _Frame(Struct):
    """An inline that is open."""

    token: PositionedToken | None
    nodes: list[Inline] = field(default_factory=list)


class InlineReader:
    """Reads the inline content of one text."""

    def __init__(self, references: References, session: ParsingState, balance: Balance) -> None:
        self.references = references
        self.session = session
        self.balance = balance
        self.report = session.report

    def read(
        self, content: Excerpt, *, mentions: bool = True, html: bool = False
    ) -> tuple[Inline, ...]:
        """The inlines of a block's content.

        `mentions` says whether "Lesson 2.2" becomes a link. In `html` only tags, entities and
        formulas are read, and its elements may be closed in another block.
        """
        tokens = inline_tokens(content.text, {"references": self.references}, html=html)
        one = _Pass(self, content, mentions)
        if html:
            return one.read(tokens)
        self.balance.enter()
        inlines = one.read(tokens)
        self.balance.leave()
        return inlines


class _Pass:
    """One pass over the tokens of one content."""

    def __init__(self, reader: InlineReader, content: Excerpt, mentions: bool) -> None:
        self.reader = reader
        self.content = content
        self.stack = [_Frame(None)]
        self.run: list[TextPiece] = []
        self.texts: list[tuple[int, str]] = []
        self.links = 0 if mentions and may_mention(content.text) else 1
        """Open links, of Markdown and of HTML; one more where mentions are not wanted."""
        self.code = 0
        """Open elements of HTML in which every character stands for itself."""

    def read(self, tokens: Iterable[PositionedToken]) -> tuple[Inline, ...]:
        for token in tokens:
            kind = token.type
            if kind in ("text", "text_special"):
                text = token.content
                if text:
                    literal = kind == "text" or text == token.markup
                    self.run.append(TextPiece(text, token.start, token.end, literal))
                    if literal and not self.code:
                        self.texts.append((token.start, text))
            elif kind == "softbreak":
                self.run.append(TextPiece("\n", token.start, token.end, False))
            elif kind == "math_unclosed":
                self._unclosed_math(token)
            elif token.nesting == 1:
                self._open(token)
            elif token.nesting == -1:
                self._close(token)
            else:
                self._leaf(token)
        self._flush()
        for unread in unread_markup(self.content, self.texts):
            self.reader.report(unread)
        return tuple(self.stack[0].nodes)

    # -- texts

    def _flush(self) -> None:
        run = self.run
        if not run:
            return
        self.run = []
        nodes = self.stack[-1].nodes
        if not self.links and not self.code:
            nodes += link_mentions(run, self.content)
        else:
            nodes += text_inlines(run, self.content)

    def _unclosed_math(self, token: PositionedToken) -> None:
        span = self.content.span(token.start, token.end)
        help = "close it with `$$` in the same paragraph, or write `\\$` for a dollar sign"
        self.reader.report(
            diagnose("math-unclosed", span, "display math is never closed", help=help)
        )
        self.run.append(TextPiece(token.content, token.start, token.end))

    # -- containers

    def _open(self, token: PositionedToken) -> None:
        self._flush()
        is_link = token.type == "link_open"
        flat = len(self.stack) > MAX_DEPTH and not is_link and token.type != "term_open"
        self.stack.append(_Frame(token, self.stack[-1].nodes if flat else []))
        self.reader.balance.enter()
        self.links += is_link or token.type == "term_open"

    def _close(self, token: PositionedToken) -> None:
        self._flush()
        frame = self.stack.pop()
        self.reader.balance.leave()
        into = self.stack[-1].nodes
        if frame.nodes is into:
            return
        opened, children = frame.token, tuple(frame.nodes)
        assert opened is not None
        node: Inline | None
        match token.type:
            case "link_close":
                node = self._link(opened, token, children)
            case "term_close":
                node = self._term(opened, token, children)
            case "strong_close":
                node = Strong(self.content.span(opened.start - 1, token.end + 1), children)
            case "em_close":
                node = Emphasis(self.content.span(opened.start, token.end), children)
            case _:
                node = Strikethrough(self.content.span(opened.start, token.end), children)
        self.links -= token.type in ("link_close", "term_close")
        into.extend(children if node is None else (node,))

    def _term(
        self, opened: PositionedToken, closed: PositionedToken, children: tuple[Inline, ...]
    ) -> Term | None:
        assert closed.map is not None
        span = self.content.span(opened.start, closed.end)
        report = self.reader.report
        given = read_term(self.content.slice(*closed.map), report)
        if given is None:
            return None
        name = given or collapse_spaces(plain_text(children))
        if not term_id(name):
            report(diagnose("term-attribute", span, "the term has no letters and no digits"))
            return None
        return Term(span, children, name, term_id(name), bool(given))

    def _link(
        self, opened: PositionedToken, closed: PositionedToken, children: tuple[Inline, ...]
    ) -> Link | None:
        url = str(opened.attrs["href"])
        span = self.content.span(opened.start, closed.end)
        destination = self.content.span(opened.start + 1, closed.end - 1)
        if opened.markup != "autolink":
            destination = self._destination(opened.start, closed.start, closed.end)
        wrong = check_scheme(url, destination)
        if wrong is not None:
            self.reader.report(wrong)
            return None
        title = str(opened.attrs.get("title", ""))
        return Link(span, classify(url), destination, title, children)

    def _destination(self, start: int, label_end: int, end: int) -> Span:
        """Where the destination of a link or image is written: in it, or in a definition."""
        text = self.content.text
        if end > label_end + 1 and text[label_end + 1] == "(":
            at = label_end + 2
            while text[at] in " \t\n":
                at += 1
            return _address(self.content, at) or self.content.span(start, end)
        label = text[start + 1 : label_end]
        if end > label_end + 3:
            label = text[label_end + 2 : end - 1]
        definition = self.reader.references.get(normalizeReference(label))
        if definition is None:
            return self.content.span(start, end)
        place: Excerpt = definition["place"]
        head = _DEFINED.match(place.text)
        found = None if head is None else _address(place, head.end())
        return found or place.span()

    # -- leaves

    def _leaf(self, token: PositionedToken) -> None:
        self._flush()
        span = self.content.span(token.start, token.end)
        node: Inline | None = None
        match token.type:
            case "math":
                node = self._math(token, span)
            case "code_inline":
                node = CodeSpan(span, token.content)
            case "number_binding" | "number_given" | "number_unbound":
                node = self._number(token, span)
            case "html_inline":
                node = self._html(token, span)
            case "image":
                node = self._image(token, span)
            case "hardbreak":
                node = HardBreak(span)
            case "footnote_ref":
                node = self._footnote(token, span)
            case _:
                raise AssertionError(f"no inline for token {token.type}")
        if node is not None:
            self.stack[-1].nodes.append(node)

    def _math(self, token: PositionedToken, span: Span) -> Math:
        assert token.map is not None
        if not token.content.strip():
            self.reader.report(diagnose("math-syntax", span, "the formula is empty"))
        tex, display = self.content.slice(*token.map), token.info == "display"
        if token.meta["braces"] is None:
            return Math(span, tex, display)
        braces, report = self.content.slice(*token.meta["braces"]), self.reader.report
        if not display:
            return Math(span, tex, display, None, *read_meaning(braces, report))
        label = read_label(braces, report)
        if label is not None:
            self.reader.session.anchors.take(label.id, label.span)
        return Math(span, tex, display, label)

    def _number(self, token: PositionedToken, span: Span) -> CodeSpan | NumberBinding:
        assert token.map is not None
        if token.type == "number_unbound":
            braces = _BRACES.match(self.content.text, token.end)
            assert braces is not None
            place = self.content.span(braces.start(), braces.end())
            message = f"`{braces[0]}` does not say where the number is from"
            help = 'write `{out}`, `{out=examples/x.py}`, `{given}` or `{given="its source"}`'
            self.reader.report(diagnose("binding-attribute", place, message, help=help))
            return CodeSpan(span, token.content)
        start, end = token.map
        if end - start == len(token.content) + 2:
            start, end = start + 1, end - 1
        place = self.content.span(start, end)
        if token.type == "number_given":
            return NumberBinding(span, token.content, place, None, collapse_spaces(token.info))
        return NumberBinding(span, token.content, place, token.info or None)

    def _html(self, token: PositionedToken, span: Span) -> RawInline:
        html = self.content.slice(token.start, token.end)
        for tag in tags(html.text):
            self.reader.balance.add(tag, html)
            step = 0 if tag.is_complete else -1 if tag.is_end_tag else 1
            if tag.name == "a":
                self.links = max(0, self.links + step)
            elif tag.name in LITERAL:
                self.code = max(0, self.code + step)
        return RawInline(span, html.text, find_media(html), find_forbidden(html))

    def _image(self, token: PositionedToken, span: Span) -> Image:
        url, alt = str(token.attrs["src"]), alt_text(token.children or [])
        label_end = token.start + 2 + len(token.content)
        place = self._destination(token.start + 1, label_end, token.end)
        wrong = check_scheme(url, place, image=True)
        if wrong is not None:
            self.reader.report(wrong)
            url = ""
        if not alt.strip():
            help = "say in the brackets what it shows, for readers who cannot see it"
            message = "the image has no text alternative"
            self.reader.report(diagnose("image-alt", span, message, help=help))
        return Image(span, url, alt, str(token.attrs.get("title", "")), place)

    def _footnote(self, token: PositionedToken, span: Span) -> FootnoteRef | None:
        reference = self.reader.session.notes.refer(token.content, span)
        if reference is None:
            self.run.append(TextPiece(f"[^{token.content}]", token.start, token.end))
        return reference


def _address(text: Excerpt, at: int) -> Span | None:
    """The address of a link that begins at an offset of a text, without angle brackets."""
    found = parseLinkDestination(text.text, at, len(text.text))
    angle = text.text.startswith("<", at)
    return text.span(at + angle, found.pos - angle) if found.ok else None


def alt_text(tokens: list[Token]) -> str:
    """The text of an image's description without marks."""
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
