"""Block content: markdown-it's block tokens become `Block` nodes with spans.

Entry points: `TextReader` (one text into blocks), `Texts` (the `TextParser` that quizzes and labs
get).

1. `prepare` makes the tokens and notes the explicit ids and the footnotes in them, which must be
   known before the first reference.
2. `blocks` walks the flat tokens once, a method for each kind of block; containers call back for
   what they hold.
3. A paragraph looks at what follows it: `Output:` and the block below it are one `Recording`.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from coursebuild.core import model
from coursebuild.core.syntax.attributes import LABEL, read_label
from coursebuild.core.syntax.callout import Head, read_head
from coursebuild.core.syntax.dispatch import read_block
from coursebuild.core.syntax.fence import INDENTED_FENCE, is_known_kind, read_fence
from coursebuild.core.syntax.headings import Attributes, check_heading, read_attributes
from coursebuild.core.syntax.html import Balance, find_media, tags
from coursebuild.core.syntax.inlines import InlineReader
from coursebuild.core.syntax.markdown import TOO_DEEP, References, block_tokens
from coursebuild.core.syntax.parsing_state import FootnoteText, ParsingState
from coursebuild.core.syntax.recording import (
    FIGURE,
    check_missing_body,
    check_near_caption,
    diagnose_missing_caption,
    diagnose_wrong_body,
    is_caption,
    read_figure,
    record_fence,
    record_table,
)
from coursebuild.core.syntax.safe_html import find_forbidden
from coursebuild.core.syntax.spans import PositionedToken, locate, normalize, trim
from coursebuild.core.syntax.tables import read_table
from coursebuild.core.text.diagnostics import Parsed, diagnose
from coursebuild.core.text.source import Excerpt, Span


class TextReader:
    """Reads one text; `nested` for a text of a quiz or lab."""

    def __init__(
        self, base: Excerpt, session: ParsingState, references: References, *, nested: bool
    ) -> None:
        self.base, self.session, self.nested = base, session, nested
        self.balance = Balance(session.report)
        self.texts = Texts(session)
        self.tokens = block_tokens(base, references)
        self.at = 0
        self.inlines = InlineReader(references, session, self.balance)
        self._prepare()

    def _prepare(self) -> None:
        for i, token in enumerate(self.tokens):
            if token.type == "heading_open" and self.tokens[i + 1].content.endswith("}"):
                name = read_attributes(self._content(token)).value.id
                if name is not None:
                    self.session.anchors.reserve(name.text[1:])
            elif token.type == "footnote_reference_open":
                label, at = token.content, token.start + 2
                label_span = self.base.span(at, at + len(label))
                read = self._later(i + 1)
                self.session.notes.add(FootnoteText(label, label_span, self._span(token), read))
        deep = next((token for token in self.tokens if token.info == TOO_DEEP), None)
        if deep is not None:
            message = "quotes, lists or footnotes nest too deep here"
            place = self._span(deep).first_line()
            self.session.report(diagnose("nesting-deep", place, message))

    def _later(self, at: int) -> Callable[[], tuple[model.Block, ...]]:
        """Reads the footnote whose first token has the index `at`."""

        def read() -> tuple[model.Block, ...]:
            self.at = at
            return self._blocks("footnote_reference_close")

        return read

    def read(self) -> tuple[model.Block, ...]:
        """The blocks of the text, its footnotes left for later."""
        blocks = self._blocks(None)
        self.balance.finish()
        return blocks

    # -- walking

    def _blocks(self, stop: str | None) -> tuple[model.Block, ...]:
        """The blocks up to a closing token, which is passed."""
        out: list[model.Block] = []
        self.balance.enter()
        while self.at < len(self.tokens):
            token = self.tokens[self.at]
            self.at += 1
            if token.type == stop:
                break
            block = _READERS[token.type](self, token)
            if block is not None:
                out.append(block)
        self.balance.leave()
        return tuple(out)

    def _span(self, token: PositionedToken) -> Span:
        return self.base.span(token.start, token.end)

    def _content(self, token: PositionedToken) -> Excerpt:
        """The content of a block, without white space at its ends."""
        return trim(locate(self.base, token.rows))

    # -- leaves

    def _paragraph(self, token: PositionedToken) -> model.Block:
        self.at += 2
        content = self._content(token)
        children = self.inlines.read(content)
        span = content.span()
        if not self.nested and "Output" in content.text[:16] and is_caption(children):
            recording = self._recording(children, span)
            if recording is not None:
                return recording
        elif not self.nested and (kind := self._next_kind()) is not None:
            self.session.diagnostics += check_near_caption(children, span, kind)
        if not self.nested and content.text.startswith(FIGURE):
            children, shown = read_figure(children, span, self.session.figures)
            return model.Paragraph(span, children, token.hidden, shown)
        return model.Paragraph(span, children, token.hidden)

    def _next(self) -> PositionedToken | None:
        return self.tokens[self.at] if self.at < len(self.tokens) else None

    def _next_kind(self) -> str | None:
        """The kind of the fence that follows, if one does."""
        token = self._next()
        if token is None or token.type != "fence":
            return None
        return (token.info.split() or [""])[0]

    def _heading(self, token: PositionedToken) -> model.Heading:
        self.at += 2
        span = self._span(token)
        attributes = read_attributes(self._content(token))
        self.session.diagnostics += attributes.diagnostics
        children = self.inlines.read(attributes.value.title, mentions=False)
        level = int(token.tag[1:])
        session, above = self.session, None if self.nested else self.session.level
        session.diagnostics += check_heading(span, level, above, children, lesson=session.lesson)
        if not self.nested:
            session.level = level
        return model.Heading(
            span,
            level,
            children,
            *self._anchor(attributes.value, children),
            attributes.value.classes,
        )

    def _anchor(
        self, attributes: Attributes, children: tuple[model.Inline, ...]
    ) -> tuple[str, bool]:
        anchors = self.session.anchors
        if attributes.id is not None:
            anchors.take(attributes.id.text[1:], attributes.id.span())
            return attributes.id.text[1:], True
        return anchors.make(model.plain_text(children)), False

    def _fence(self, token: PositionedToken) -> model.Block:
        fence = read_fence(token, self.base, nested=self.nested)
        block = read_block(fence, self.session, self.texts)
        if isinstance(block, model.Script) and not block.norun and self._next_kind() == "text":
            below = self.tokens[self.at]
            if below.info.split() == ["text"]:  # its keys are told as what they are
                self.session.report(diagnose_missing_caption(self._span(below)))
        return block

    def _code(self, token: PositionedToken) -> model.CodeBlock:
        code = locate(self.base, token.rows)
        self._fence_inside(code)
        return model.CodeBlock(
            self._span(token), "", "", Excerpt(code.source, code.text + "\n", code.pieces)
        )

    def _fence_inside(self, code: Excerpt) -> None:
        """Tell of a fence that is indented, by which its block became text that is shown."""
        opening = INDENTED_FENCE.match(code.text)
        if opening is None:
            return
        closed = re.search(rf"^{opening[1]}\s*\Z", code.text.rstrip(), re.MULTILINE) is not None
        if closed and not is_known_kind(opening[2]):
            return
        message = "this fence is indented by a tab or four blanks, so its block is shown as text"
        help = "take the white space before it away"
        place = code.span(opening.start(1), opening.end())
        self.session.report(diagnose("fence-indented", place, message, help=help))
        self.session.closes_indented = not closed

    def _html(self, token: PositionedToken) -> model.HtmlBlock | model.HtmlFlow:
        """Raw HTML, kept as it is unless it holds formulas."""
        html = locate(self.base, token.rows)
        if self.nested or "$" in html.text:
            content = trim(html, " \t\n")
            children = self.inlines.read(content, html=True)
            if self.nested or any(isinstance(child, model.Math) for child in children):
                return model.HtmlFlow(content.span(), children)
        else:
            for tag in tags(html.text):
                self.balance.add(tag, html)
        text = html.text if html.text.endswith("\n") else html.text + "\n"
        return model.HtmlBlock(self._span(token), text, find_media(html), find_forbidden(html))

    def _rule(self, token: PositionedToken) -> model.ThematicBreak:
        return model.ThematicBreak(self._span(token))

    def _math(self, token: PositionedToken) -> model.MathBlock:
        text = locate(self.base, token.rows)
        start, end = text.text.index("$$") + 2, len(text.text)
        if token.info != "unclosed":
            end = text.text.rindex("$$")
        tex = trim(text.slice(start, end), " \t\n")
        if token.info == "unclosed":
            help = "close it with `$$` on a line below, with no empty line before it"
            place, message = text.span(start - 2, start), "display math is never closed"
            self.session.report(diagnose("math-unclosed", place, message, help=help))
        elif not tex.text:
            self.session.report(diagnose("math-syntax", self._span(token), "the formula is empty"))
        return model.MathBlock(self._span(token), tex, self._label(text, end + 2))

    def _label(self, text: Excerpt, at: int) -> model.Label | None:
        """The label of the formula that ends before an offset."""
        braces = LABEL.match(text.text, at)
        label = read_label(text.slice(*braces.span(1)), self.session.report) if braces else None
        if label is not None:
            self.session.anchors.take(label.id, label.span)
        return label

    # -- containers

    def _quote(self, token: PositionedToken) -> model.BlockQuote | model.Callout:
        span, opened = self._span(token), self.tokens[self.at]
        if opened.type == "paragraph_open":
            head = read_head(self._content(opened), self.session.callouts)
            if head is not None:
                self.session.diagnostics += head.diagnostics
                return self._callout(span, head.value)
        return model.BlockQuote(span, self._blocks("blockquote_close"))

    def _callout(self, span: Span, head: Head) -> model.Callout:
        title = self.inlines.read(head.title)
        self.at += 3
        first: tuple[model.Block, ...] = ()
        if head.rest.text:
            first = (model.Paragraph(head.rest.span(), self.inlines.read(head.rest)),)
        blocks = (*first, *self._blocks("blockquote_close"))
        return model.Callout(span, head.kind, head.kind_span, title, head.folded, blocks)

    def _list(self, token: PositionedToken) -> model.ListBlock:
        ordered = token.type == "ordered_list_open"
        items: list[model.ListItem] = []
        while (item := self.tokens[self.at]).type == "list_item_open":
            self.at += 1
            items.append(self._item(item))
        self.at += 1
        return model.ListBlock(
            self._span(token), tuple(items), int(token.attrs.get("start", 1)) if ordered else None
        )

    def _item(self, token: PositionedToken) -> model.ListItem:
        blocks = self._blocks("list_item_close")
        marker = self.base.span(token.start, token.start + len(token.info) + 1)
        span = marker.to(blocks[-1].span) if blocks else marker
        return model.ListItem(span, blocks, token.meta.get("checked"))

    def _table(self, token: PositionedToken) -> model.Table:
        table, self.at = self._read_table(self.at - 1)
        return table

    def _read_table(self, at: int) -> tuple[model.Table, int]:
        return read_table(self.tokens, at, self.base, self.inlines.read, self.session.report)

    def _footnote(self, token: PositionedToken) -> None:
        """Pass over a footnote: it is read later."""
        depth = 1
        while depth:
            kind = self.tokens[self.at].type
            depth += (kind == "footnote_reference_open") - (kind == "footnote_reference_close")
            self.at += 1

    # -- recorded output

    def _recording(self, caption: tuple[model.Inline, ...], span: Span) -> model.Recording | None:
        """The recording whose caption was just read, if what follows is its body."""
        match self._next():
            case PositionedToken(type="table_open"):
                table, self.at = self._read_table(self.at)
                return record_table(caption, span, table, self.session)
            case PositionedToken(type="fence") as token:
                fence = read_fence(token, self.base, nested=False)
                recording = record_fence(caption, span, fence, self.session)
                self.at += recording is not None
                return recording
            case PositionedToken(type="code_block") as token:
                place = self._span(token).first_line()
                self.session.report(diagnose_wrong_body(place, "an indented block"))
            case _:
                self.session.diagnostics += check_missing_body(caption, span)
        return None


_READERS: dict[str, Callable[[TextReader, PositionedToken], model.Block | None]] = {
    "paragraph_open": TextReader._paragraph,
    "heading_open": TextReader._heading,
    "fence": TextReader._fence,
    "code_block": TextReader._code,
    "html_block": TextReader._html,
    "hr": TextReader._rule,
    "math_block": TextReader._math,
    "blockquote_open": TextReader._quote,
    "bullet_list_open": TextReader._list,
    "ordered_list_open": TextReader._list,
    "table_open": TextReader._table,
    "footnote_reference_open": TextReader._footnote,
}


class Texts:
    """Markdown inside quizzes, labs and io blocks (a `TextParser`)."""

    def __init__(self, session: ParsingState) -> None:
        self._session = session

    def blocks(self, excerpt: Excerpt) -> Parsed[tuple[model.Block, ...]]:
        """The blocks of a text; HTML becomes an `HtmlFlow`."""
        base = normalize(excerpt)
        return self._session.collect_diagnostics(
            lambda: TextReader(base, self._session, self._references(), nested=True).read()
        )

    def inlines(self, excerpt: Excerpt) -> Parsed[tuple[model.Inline, ...]]:
        """The inlines of a text that is one paragraph at most."""
        content = trim(normalize(excerpt))
        return self._session.collect_diagnostics(lambda: self._read_inlines(content))

    def _read_inlines(self, content: Excerpt) -> tuple[model.Inline, ...]:
        balance = Balance(self._session.report)
        reader = InlineReader(self._references(), self._session, balance)
        inlines = reader.read(content)
        balance.finish()
        return inlines

    def _references(self) -> References:
        """The document's link definitions; those that a text adds are its own."""
        return dict(self._session.references)
