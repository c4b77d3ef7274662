"""Fences: code blocks of the text, of which other modules make scripts, quizzes and so on.

Info strings are `kind [name] [key=value | key="value with spaces" | flag]…`. In a quoted value a
backslash stands before a quote and a backslash. Mistakes are diagnostics at the word that is wrong;
the rest is still read.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any, Protocol

from markdown_it.common.utils import unescapeAll
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Block, CodeBlock, Inline, NumberBinding
from coursebuild.core.syntax.attributes import split_label
from coursebuild.core.syntax.nodes import ArrayNode, Node, StringNode
from coursebuild.core.syntax.spans import NO_TEXT, PositionedToken, trim
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Note,
    Parsed,
    diagnose,
    did_you_mean,
)
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span

_WORD = regex(r"""([^\s="]*)(?:(=)(?:"((?:\\["\\]|[^"])*)"|((?![“”„‟‘’‚‛«»'`])[^\s"]*)))?""")
_KIND = regex(r"\s*(\S*)")
_NOT_SPACE = regex(r"\S")
_REST = regex(r"\S*")
_PART = regex(r"(?:^|(?<=,))[^,]*")
_ESCAPE = regex(r"""\\(["\\])""")


class Word(Struct, frozen=True):
    """A word of an info string: `key`, or `key=value`."""

    span: Span
    key: str
    key_span: Span
    value_text: Excerpt | None
    """The value with its places; `None` for a word without `=`."""

    @property
    def value(self) -> str | None:
        return None if self.value_text is None else self.value_text.text

    @property
    def value_span(self) -> Span:
        """Where the value stands; the word itself when it has none."""
        return self.span if self.value_text is None else self.value_text.span()

    def parts(self) -> list[Excerpt]:
        """The parts of a value between its commas, without white space at their ends."""
        value = self.value_text
        if value is None:
            return []
        return [trim(value.slice(*match.span())) for match in _PART.finditer(value.text)]


class FenceKeys(Struct, frozen=True):
    """The name and the keys of an info string."""

    name: Word | None
    words: tuple[Word, ...]
    """The words whose keys the kind has, each key once."""

    def get(self, key: str) -> Word | None:
        """The word of a key, if it is given."""
        return next((word for word in self.words if word.key == key), None)

    def value(self, key: str) -> str | None:
        """The value of a key, if it is given."""
        word = self.get(key)
        return None if word is None else word.value

    def place(self, key: str) -> Span | None:
        """The span of the value of a key, if it is given."""
        word = self.get(key)
        return None if word is None else word.value_span


def kind_of(info: Excerpt) -> Excerpt:
    """The first word of an info string."""
    match = _KIND.match(info.text)
    return info.slice(*match.span(1)) if match else info


def split_words(info: Excerpt) -> Parsed[tuple[Word, ...]]:
    """The words after the kind, whatever their keys."""
    words: list[Word] = []
    diagnostics: list[Diagnostic] = []
    text, kind = info.text, kind_of(info).text
    at = len(text) - len(text.lstrip()) + len(kind)
    while start_match := _NOT_SPACE.search(text, at):
        at = start_match.start()
        match = _WORD.match(text, at)
        assert match is not None
        end = match.end()
        if end < len(text) and not text[end].isspace():
            rest = _REST.match(text, end)
            end = rest.end() if rest else end
            message = f"`{text[at:end]}` cannot be read"
            help = (
                'write `key=value`, `key="value with spaces"` or a flag, with spaces between them'
            )
            diagnostics.append(diagnose("fence-info", info.span(at, end), message, help=help))
        elif not match[1]:
            message = f"`{match[0]}` has no key before the `=`"
            diagnostics.append(diagnose("fence-info", info.span(at, end), message))
        else:
            value = info.slice(*match.span(match.lastindex or 0)) if match[2] else None
            if value is not None and match[3]:
                escapes = [(m.start(), m.start(1)) for m in _ESCAPE.finditer(value.text)]
                starts = [0, *(b for _, b in escapes)]
                rests = zip(starts, [*(a for a, _ in escapes), len(value.text)], strict=True)
                value = Excerpt.join([value.slice(a, b) for a, b in rests])
            key, span = info.span(*match.span(1)), info.span(*match.span())
            words.append(Word(span, match[1], key, value))
        at = end
    return Parsed(tuple(words), tuple(diagnostics))


class Fence(Struct, frozen=True):
    """A fenced code block."""

    span: Span
    """From the opening marks to the end of the closing ones."""
    head: Span
    """The opening line, from its marks to the end of the info string."""
    info: Excerpt
    """The info string as written, without white space at its ends."""
    body: Excerpt
    """The lines inside, each with its line end."""
    body_span: Span
    """Those lines in the source, from the start of the first to that of the closing line."""
    prefix: str
    is_closed: bool
    nested: bool
    """Whether it stands in a text of a quiz or lab, where no lines can be extracted or updated."""
    inner: Span | None
    """A line inside that was surely meant to begin another fence, which then closed this one."""
    label: Excerpt | None = None
    """The label in braces that ends the line, which is not part of the info string."""

    @property
    def kind(self) -> str:
        return kind_of(self.info).text.lower()

    def keys(
        self, *, values: Sequence[str] = (), flags: Sequence[str] = (), has_name: bool = False
    ) -> Parsed[FenceKeys]:
        """The keys after the kind: those in `values` take a value, `flags` none, those in both may.

        With `has_name` a first word without `=` is a name.
        """
        kind, split = self.kind, split_words(self.info)
        words, diagnostics = list(split.value), list(split.diagnostics)
        name = words.pop(0) if has_name and words and words[0].value is None else None
        keys = [*values, *flags]
        words_by_key: dict[str, Word] = {}
        needs_value = False
        for word in words:
            key, is_value, needs_value = word.key, needs_value, False
            if key not in keys and is_value:
                pass  # of the key before it, which lost its `=`
            elif key not in keys:
                message = f"`{kind}` has no key `{key}`" if keys else f"`{kind}` takes no keys"
                help = did_you_mean(key, keys, most=len(keys))
                diagnostics.append(diagnose("fence-key-unknown", word.key_span, message, help=help))
            elif key in words_by_key:
                notes = [Note("first given here", words_by_key[key].key_span)]
                message, help = f"`{key}` is given twice", "delete one of them"
                diagnostics.append(
                    diagnose("fence-key-repeated", word.key_span, message, help=help, notes=notes)
                )
            elif key not in values and word.value is not None:
                message, help = f"`{key}` takes no value", f"write `{key}` alone"
                diagnostics.append(diagnose("fence-key-value", word.span, message, help=help))
            elif word.value == "" or (key not in flags and word.value is None):
                needs_value = True
                message, help = f"`{key}` needs a value", f"write `{key}=…`"
                diagnostics.append(diagnose("fence-key-value", word.span, message, help=help))
            else:
                words_by_key[key] = word
        return Parsed(FenceKeys(name, tuple(words_by_key.values())), tuple(diagnostics))

    def code(self) -> CodeBlock:
        """The fence as an ordinary code block."""
        kind, info = kind_of(self.info).text, self.info.text
        return CodeBlock(self.span, unescapeAll(kind), unescapeAll(info), self.body)


def read_fence(token: PositionedToken, base: Excerpt, *, nested: bool) -> Fence:
    """The fence of a `fence` token of the text `base`."""
    info_start = token.start + len(token.markup)
    info_end = info_start + len(token.info)
    info, label = split_label(trim(base.slice(info_start, info_end)))
    is_closed, body = token.meta["closed"], token.text
    if body is NO_TEXT:
        body = base.slice(info_end + 1, info_end + 1)
    else:
        body = with_line_end(body)
    span = base.span(token.start, token.end)
    head = base.span(token.start, info_start + len(token.info.rstrip()))
    body_span, prefix = body.span(), ""
    if not nested:  # the whole lines between the marks, and what new ones need before them
        source = span.source
        start = source.line_start(head.line + 1)
        end = source.line_start(span.end_line if is_closed else span.end_line + 1)
        body_span, prefix = Span(source, start, max(start, end)), line_prefix(head)
    inner = None
    if (marks := token.markup) in body.text:
        opening = rf"^ {{0,3}}({re.escape(marks[0])}{{{len(marks)},}} *\w[^`\n]*)$"
        if (match := re.search(opening, body.text, re.MULTILINE)) is not None:
            inner = body.span(*match.span(1))
    return Fence(span, head, info, body, body_span, prefix, is_closed, nested, inner, label)


def with_line_end(text: Excerpt) -> Excerpt:
    """A text that ends with a line end, which stands for the end of its last line."""
    return text if text.text.endswith("\n") else replace(text, text=text.text + "\n")


def line_prefix(place: Span) -> str:
    """The prefix that further lines of a block need, such as `> `; `place` is its first line."""
    prefix = place.source.text[place.source.line_start(place.line) : place.start]
    prefix = re.sub(r"[^>\s]", " ", re.sub(r"\[\^[^\]]*\]", "    ", prefix))
    return prefix + " " if prefix.endswith(">") else prefix


class TextParser(Protocol):
    """Parses Markdown inside another language; the spans of nodes point into the lesson."""

    @property
    def has_decimal_comma(self) -> bool:
        """Whether numbers of the text may have a comma before their decimals."""
        ...

    def blocks(self, excerpt: Excerpt) -> Parsed[tuple[Block, ...]]:
        """The blocks of a text; math between the tags of HTML is math. Never raises."""
        ...

    def inlines(self, excerpt: Excerpt) -> Parsed[tuple[Inline, ...]]:
        """The inlines of a text of at most one paragraph; line ends are soft. Never raises."""
        ...


def with_units(
    numbers: Iterable[NumberBinding], units: Iterable[tuple[Node, str]]
) -> tuple[NumberBinding, ...]:
    """Bound numbers with the units that fields beside them say: to each in a node, its unit."""
    places = [(node.span, unit) for node, unit in units]
    return tuple(
        replace(b, unit=next((unit for span, unit in places if span.contains(b.span)), b.unit))
        for b in numbers
    )


class Prose(Struct, frozen=True):
    """The Markdown strings inside a quiz or a lab, each parsed once."""

    _content: dict[Node, tuple[Any, ...]]
    diagnostics: tuple[Diagnostic, ...]
    numbers: tuple[NumberBinding, ...]
    """The bound numbers that stand in place of plain ones."""

    @classmethod
    def read(cls, texts: Iterable[tuple[StringNode, str]], parser: TextParser) -> Prose:
        """Parse each text as blocks or inlines, but for blank ones."""
        numbers: list[NumberBinding] = []
        content: dict[Node, tuple[Any, ...]] = {}
        diagnostics: list[Diagnostic] = []
        for node, kind in texts:
            if node.value.strip():
                parse = parser.blocks if kind == "blocks" else parser.inlines
                parsed_text: Parsed[tuple[Any, ...]] = parse(node.excerpt)
                content[node] = parsed_text.value
                diagnostics += parsed_text.diagnostics
                if kind in ("number", "plain"):
                    numbers += (i for i in parsed_text.value if isinstance(i, NumberBinding))
        return cls(content, tuple(diagnostics), tuple(numbers))

    def blocks(self, node: Node | None) -> tuple[Block, ...]:
        """The blocks of a string; none for a field that is not given."""
        return () if node is None else self._content.get(node, ())

    def inlines(self, node: Node | None) -> tuple[Inline, ...]:
        """The inlines of a string; none for a field that is not given."""
        return () if node is None else self._content.get(node, ())

    def each_item(self, node: Node | None) -> tuple[tuple[Any, ...], ...]:
        """The blocks or inlines of each string of an array."""
        items = node.items if isinstance(node, ArrayNode) else ()
        return tuple(self._content.get(item, ()) for item in items)
