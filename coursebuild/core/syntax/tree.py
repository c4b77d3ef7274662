"""Block content: markdown-it's flat block tokens become `Block` nodes with spans."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial

from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.addresses import html_ids
from coursebuild.core.syntax.attributes import (
    LABEL,
    check_heading,
    read_attributes,
    split_label,
    split_source_mark,
)
from coursebuild.core.syntax.block_parser import TOO_DEEP, References, block_tokens
from coursebuild.core.syntax.callouts import read_head
from coursebuild.core.syntax.code_blocks import read_block
from coursebuild.core.syntax.fence import read_fence, with_line_end
from coursebuild.core.syntax.html import Balance, find_forbidden, find_media, tags
from coursebuild.core.syntax.inline_tree import read_inlines
from coursebuild.core.syntax.parsing_state import FootnoteText, ParsingState, T
from coursebuild.core.syntax.pipe_tables import read_table
from coursebuild.core.syntax.recording import (
    caption_start,
    check_code_above,
    check_missing_body,
    diagnose_wrong_body,
    is_caption,
    read_figure,
    record_fence,
    record_table,
)
from coursebuild.core.syntax.spans import PositionedToken, normalize, trim
from coursebuild.core.text.diagnostics import Parsed, diagnose
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span


class TextReader:
    """Reads one text; `nested` for a text of a quiz or lab."""

    def __init__(
        self, base: Excerpt, state: ParsingState, references: References, *, nested: bool
    ) -> None:
        self.base, self.state, self.nested = base, state, nested
        self.balance = Balance(state.report)
        self.texts = NestedTextParser(state)
        self.tokens = block_tokens(base, references)
        self.index = 0
        """That of the next token."""
        self.inlines = partial(
            read_inlines, state=state, references=references, balance=self.balance
        )
        for i, token in enumerate(self.tokens):
            if token.type in ("html_block", "inline") and "<" in token.content:
                for id in html_ids(_CODE_SPAN.sub("", token.content)):
                    self.state.anchors.reserve(id)  # links mean the id that its author wrote
            if token.type == "heading_open" and self.tokens[i + 1].content.endswith("}"):
                name = read_attributes(trim(token.text)).value.id
                if name is not None:
                    self.state.anchors.reserve(name.text[1:])
            elif token.type == "footnote_reference_open":
                label, at = token.content, token.start + 2
                label_span = self.base.span(at, at + len(label))
                read = partial(self._read_footnote, i + 1)
                self.state.notes.add(FootnoteText(label, label_span, self.span(token), read))
        deep_token = next((token for token in self.tokens if token.info == TOO_DEEP), None)
        if deep_token is not None:
            message = "quotations, lists or footnotes are nested too deeply here"
            place = self.span(deep_token).first_line()
            self.state.report(diagnose("nesting-deep", place, message))

    def _read_footnote(self, at: int) -> tuple[model.Block, ...]:
        self.index = at
        return self._read_blocks("footnote_reference_close")

    def read(self) -> tuple[model.Block, ...]:
        """The blocks of the text without its footnotes, which are read last."""
        blocks = self._read_blocks(None)
        self.balance.finish()
        return blocks

    # -- walking

    def _read_blocks(self, stop: str | None) -> tuple[model.Block, ...]:
        blocks: list[model.Block] = []
        self.balance.enter()
        while self.index < len(self.tokens):
            token = self.tokens[self.index]
            self.index += 1
            if token.type == stop:
                break
            block = _READERS[token.type](self, token)
            if isinstance(block, model.SourceMark):
                self._give(block, blocks)
            elif block is not None:
                self.state.diagnostics += check_code_above(blocks, block)
                blocks.append(block)
        self.balance.leave()
        return tuple(blocks)

    def span(self, token: PositionedToken) -> Span:
        """Where a token stands."""
        return self.base.span(token.start, token.end)

    # -- leaves

    def _read_paragraph(self, token: PositionedToken) -> model.Block | model.SourceMark:
        """A paragraph or what it is the caption of; its source alone, if it is nothing else."""
        self.index += 2
        content, mark = split_source_mark(trim(token.text))
        if mark is None:
            return self._read_content(content, token)
        if not content.text:
            return mark
        block = self._read_content(content, token)
        if isinstance(block, model.Paragraph):
            return replace(block, span=block.span.to(mark.span), source_mark=mark)
        blocks: list[model.Block] = [block]
        self._give(mark, blocks)
        return blocks[0]

    def _give(self, mark: model.SourceMark, blocks: list[model.Block]) -> None:
        """Give the last block the source of its numbers."""
        match blocks[-1:]:
            case [
                model.Paragraph()
                | model.ListBlock()
                | model.Table()
                | model.FeatureBlock() as block
            ]:
                blocks[-1] = replace(block, source_mark=mark)
            case _:
                message = "nothing above this source holds numbers that it could give"
                help = (
                    "it stands behind a paragraph, or below one, a list, a table, a quiz or a lab"
                )
                self.state.report(diagnose("binding-attribute", mark.span, message, help=help))

    def _read_content(self, content: Excerpt, token: PositionedToken) -> model.Block:
        span = content.span()
        if not self.nested and (caption := self._read_labelled_caption(content)) is not None:
            return caption
        children = self.inlines(content)
        if not self.nested and self._is_caption(content, children):
            recording = self._read_recording(children, span)
            if recording is not None:
                return recording
        if not self.nested and caption_start(content.text, self.state.words.figure):
            children, shows_image = read_figure(children, span, self.state)
            return model.Paragraph(span, children, token.hidden, shows_image)
        return model.Paragraph(span, children, token.hidden)

    def _read_labelled_caption(self, content: Excerpt) -> model.Block | None:
        """The block of a caption that ends with a label, or that stands above its table."""
        caption, braces = split_label(content)
        span, following, words = content.span(), self._peek(), self.state.words
        start = caption_start(caption.text, words.table)
        if start and following and following.type == "table_open":
            label = self.state.take_label(braces, "tab")
            inlines = self.inlines(trim(caption.slice(start)))
            self.index += 1
            table = self._read_table(following)
            mark = model.SourceMark(label.span, label.source) if label and label.source else None
            whole = span.to(table.span)
            return replace(table, span=whole, label=label, caption=inlines, source_mark=mark)
        if braces is None:
            return None
        if caption_start(caption.text, words.figure):
            label = self.state.take_label(braces, "fig")
            inlines, shows_image = read_figure(self.inlines(caption), span, self.state)
            if not shows_image:
                message = "no image stands in the paragraph of this label"
                self.state.reject_label(braces, message, "show one: `![…](file.svg)`")
            return model.Paragraph(span, inlines, False, shows_image, label=label)
        if not any(word in caption.text[:24] for word in (*words.table, *words.output)):
            return None
        inlines, recording = self.inlines(caption), None
        if self._is_caption(caption, inlines):
            recording = self._read_recording(inlines, caption.span())
        if recording is not None and isinstance(recording.body, model.Table):
            label = self.state.take_label(braces, "tab")
            return replace(recording, body=replace(recording.body, label=label))
        message, help = "no table follows the caption of this label", "put one directly below it"
        if recording is not None:
            message = "an output that is no table has no label"
            help = "write `{#lst:name}` on the first line of its script"
        self.state.reject_label(braces, message, help)
        return recording or model.Paragraph(span, inlines)

    def _is_caption(self, content: Excerpt, inlines: tuple[model.Inline, ...]) -> bool:
        """Whether a paragraph is the caption of an output: below a script, with a word for it."""
        words = self.state.words
        if self.state.script is None and not self.state.has_invalid_script:
            return False
        is_likely = any(name in content.text[:24] for name in words.output)
        return is_likely and is_caption(inlines, words)

    def _peek(self) -> PositionedToken | None:
        return self.tokens[self.index] if self.index < len(self.tokens) else None

    def _read_heading(self, token: PositionedToken) -> model.Heading:
        self.index += 2
        span = self.span(token)
        attributes = read_attributes(trim(token.text))
        self.state.diagnostics += attributes.diagnostics
        children = self.inlines(attributes.value.title, mentions=False)
        level = int(token.tag[1:])
        state, previous_level = self.state, None if self.nested else self.state.level
        state.diagnostics += check_heading(
            span, level, previous_level, children, lesson=state.lesson
        )
        if not self.nested:
            state.level = level
        classes, id = attributes.value.classes, attributes.value.id
        if id is None:
            anchor = state.anchors.make(model.plain_text(children))
            return model.Heading(span, level, children, anchor, False, classes)
        state.anchors.take(id.text[1:], id.span())
        return model.Heading(span, level, children, id.text[1:], True, classes)

    def _read_html(self, token: PositionedToken) -> model.HtmlBlock | model.HtmlFlow:
        """Raw HTML, read as inlines if it holds formulas or is nested."""
        html = token.text
        if self.nested or "$" in html.text:
            content = trim(html, " \t\n")
            children = self.inlines(content, html=True)
            if self.nested or any(isinstance(child, model.Math) for child in children):
                return model.HtmlFlow(content.span(), children)
        else:
            for tag in tags(html.text):
                self.balance.add(tag, html)
        text = html.text if html.text.endswith("\n") else html.text + "\n"
        return model.HtmlBlock(self.span(token), text, find_media(html), find_forbidden(html))

    def _read_math(self, token: PositionedToken) -> model.MathBlock:
        text = token.text
        start, end = text.text.index("$$") + 2, len(text.text)
        if token.info != "unclosed":
            end = text.text.rindex("$$")
        tex, numbers = self.state.read_formula(trim(text.slice(start, end), " \t\n"))
        if token.info == "unclosed":
            help = "close it with `$$` on a line below, with no empty line before it"
            place, message = text.span(start - 2, start), "display math is never closed"
            self.state.report(diagnose("math-unclosed", place, message, help=help))
        elif not tex.text:
            self.state.report(diagnose("math-syntax", self.span(token), "the formula is empty"))
        after = min(end + 2, len(text.text))
        mark = _SENTENCE_MARK.match(text.text, after)
        if mark is not None:  # it is shown with the formula, beside which it would stand alone
            tex, after = Excerpt.join([tex, text.slice(*mark.span(1))]), mark.end()
        braces = LABEL.match(text.text, after)
        label = self.state.take_label(text.slice(*braces.span(1)) if braces else None, "eq")
        return model.MathBlock(self.span(token), tex, numbers, label=label)

    # -- containers

    def _read_quote(self, token: PositionedToken) -> model.BlockQuote | model.Callout:
        span, first_token = self.span(token), self.tokens[self.index]
        if first_token.type == "paragraph_open":
            head = read_head(trim(first_token.text), self.state.callouts)
            if head is not None:
                self.state.diagnostics += head.diagnostics
                kind, place, folded = head.value.kind, head.value.kind_span, head.value.folded
                heading, braces = split_label(head.value.title)
                title, rest = self.inlines(heading), head.value.rest
                label = None if self.nested else self.state.take_callout_label(braces)
                if braces is not None and self.nested:
                    message = "a callout in a text of a quiz or lab has no label"
                    help = "label callouts of the lesson's text"
                    self.state.reject_label(braces, message, help)
                first_token.text = rest  # and what is below its head is a paragraph as any
                self.index += 0 if rest.text else 3
                blocks = self._read_blocks("blockquote_close")
                return model.Callout(span, kind, place, title, folded, blocks, label=label)
        return model.BlockQuote(span, self._read_blocks("blockquote_close"))

    def _read_list(self, token: PositionedToken) -> model.ListBlock:
        ordered = token.type == "ordered_list_open"
        items: list[model.ListItem] = []
        while (item := self.tokens[self.index]).type == "list_item_open":
            self.index += 1
            blocks = self._read_blocks("list_item_close")
            marker = self.base.span(item.start, item.start + len(item.info) + 1)
            span = marker.to(blocks[-1].span) if blocks else marker
            items.append(model.ListItem(span, blocks, item.meta.get("checked")))
        self.index += 1
        return model.ListBlock(
            self.span(token), tuple(items), int(token.attrs.get("start", 1)) if ordered else None
        )

    def _read_table(self, token: PositionedToken) -> model.Table:
        at, report = self.index - 1, self.state.report
        table, self.index = read_table(self.tokens, at, self.base, self.inlines, report)
        return replace(table, comma=self.state.has_decimal_comma)

    def _skip_footnote(self, token: PositionedToken) -> None:
        depth = 1
        while depth:
            kind = self.tokens[self.index].type
            depth += (kind == "footnote_reference_open") - (kind == "footnote_reference_close")
            self.index += 1

    # -- recorded output

    def _read_recording(
        self, caption: tuple[model.Inline, ...], span: Span
    ) -> model.Recording | None:
        match self._peek():
            case PositionedToken(type="table_open") as token:
                self.index += 1
                return record_table(caption, span, self._read_table(token), self.state)
            case PositionedToken(type="fence") as token:
                fence = read_fence(token, self.base, nested=False)
                recording = record_fence(caption, span, fence, self.state)
                self.index += recording is not None
                return recording
            case PositionedToken(type="code_block") as token:
                place = self.span(token).first_line()
                self.state.report(diagnose_wrong_body(place, "an indented block"))
            case token:
                following = None if token is None else self.span(token)
                state = self.state
                state.diagnostics += check_missing_body(caption, span, state.words, following)
        return None


_CODE_SPAN = regex(r"(?<!`)(`+)(?!`).*?(?<!`)\1(?!`)", re.DOTALL)
_SENTENCE_MARK = regex(r"[ \t]*([.,;:])")
_READERS: dict[
    str, Callable[[TextReader, PositionedToken], model.Block | model.SourceMark | None]
] = {
    "paragraph_open": TextReader._read_paragraph,
    "heading_open": TextReader._read_heading,
    "fence": lambda reader, token: read_block(
        read_fence(token, reader.base, nested=reader.nested), reader.state, reader.texts
    ),
    "code_block": lambda reader, token: model.CodeBlock(
        reader.span(token), "", "", with_line_end(token.text)
    ),
    "html_block": TextReader._read_html,
    "hr": lambda reader, token: model.ThematicBreak(reader.span(token)),
    "math_block": TextReader._read_math,
    "blockquote_open": TextReader._read_quote,
    "bullet_list_open": TextReader._read_list,
    "ordered_list_open": TextReader._read_list,
    "table_open": TextReader._read_table,
    "footnote_reference_open": TextReader._skip_footnote,
}


class NestedTextParser:
    """Parses Markdown inside quizzes, labs and io blocks, as a `TextParser`."""

    def __init__(self, state: ParsingState) -> None:
        self._state = state

    @property
    def has_decimal_comma(self) -> bool:
        """Whether the language of the text has a comma before decimals."""
        return self._state.has_decimal_comma

    def blocks(self, excerpt: Excerpt) -> Parsed[tuple[model.Block, ...]]:
        """The blocks of a text; HTML becomes an `HtmlFlow`."""
        base = normalize(excerpt)
        return self._read(
            excerpt, lambda: TextReader(base, self._state, self._references(), nested=True).read()
        )

    def inlines(self, excerpt: Excerpt) -> Parsed[tuple[model.Inline, ...]]:
        """The inlines of a text that is one paragraph at most."""
        content = trim(normalize(excerpt))

        def read() -> tuple[model.Inline, ...]:
            balance = Balance(self._state.report)
            inlines = read_inlines(content, self._state, self._references(), balance)
            balance.finish()
            return inlines

        return self._read(excerpt, read)

    def _read(self, excerpt: Excerpt, read: Callable[[], T]) -> Parsed[T]:
        state, start = self._state, excerpt.offset(0)
        outer = state.in_string
        state.in_string = outer or excerpt.source.text[start - 1 : start] == '"'
        try:
            return state.collect_diagnostics(read)
        finally:
            state.in_string = outer

    def _references(self) -> References:
        """A copy of the document's link definitions, as those in a text hold in it only."""
        return dict(self._state.references)
