"""TOML, every value with its place.

Entry point: `parse_toml(source)`.

1. `tomllib` says whether the text is TOML. What is wrong otherwise is told by `toml_mistakes`.
2. tree-sitter says where keys, values and headers stand. Of these come the nodes that JSON gives
   too. Headers and dotted keys may add to a table that stands above, so tables grow until the end.
"""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_right
from typing import TypeAlias

import tree_sitter
import tree_sitter_toml
from msgspec import Struct, field

from coursebuild.core.syntax.escapes import escaped_string
from coursebuild.core.syntax.nodes import (
    ArrayNode,
    BoolNode,
    DateNode,
    Member,
    Node,
    NumberNode,
    ObjectNode,
    StringNode,
)
from coursebuild.core.syntax.toml_mistakes import (
    double_backslash,
    mistake_of,
    nesting_mistake,
    place_of,
)
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose
from coursebuild.core.text.patterns import pattern
from coursebuild.core.text.source import Excerpt, Source

_LANGUAGE = tree_sitter.Language(tree_sitter_toml.language())
_WIDE = pattern(r"[^\x00-\x7f]")
_ESCAPE = pattern(r"\\(?:[ \t]*\n[ \t\n]*|u[0-9A-Fa-f]{4}|U[0-9A-Fa-f]{8}|x[0-9A-Fa-f]{2}|.)")
_ESCAPES = {"b": "\b", "t": "\t", "n": "\n", "f": "\f", "r": "\r", "e": "\x1b"}


def parse_toml(source: Source, *, rule: str = "map-syntax") -> Parsed[ObjectNode | None]:
    """The file as a table; no value, and one diagnostic, when it is not TOML. Never raises.

    `rule` is what that diagnostic is called. The value can be there along with diagnostics; a
    caller that finds any must not publish it.
    """
    body = _body(source)
    try:
        tomllib.loads(body.text)
        reader = _Reader(body)
        root = _node(body, reader.document())
        assert isinstance(root, ObjectNode)
        return Parsed(root, tuple(reader.diagnostics))
    except RecursionError:
        mistake = nesting_mistake(body.text)
    except ValueError as error:
        if repeated := _repeated_key(body, str(error)):
            return Parsed(None, (repeated,))
        mistake = mistake_of(body.text, str(error))
    span = body.span(mistake.start, mistake.end)
    return Parsed(None, (diagnose(rule, span, mistake.message, help=mistake.help),))


def _body(source: Source) -> Excerpt:
    """The text with CRLF made LF, as `tomllib` reads it; a lone CR stays, since TOML refuses it."""
    lines: list[tuple[str, int]] = []
    at = 0
    for line in source.text.split("\r\n"):
        lines.append((line, at))
        at += len(line) + 2
    return Excerpt.of_lines(source, lines)


def _repeated_key(body: Excerpt, message: str) -> Diagnostic | None:
    """The diagnostic for a key or table that is given twice, if that is what `tomllib` says."""
    if not message.startswith(("Cannot", "Duplicate")):
        return None
    at = place_of(body.text, message)
    end = body.text.find("\n", at)
    reader = _Reader(body.slice(0, end if end >= 0 else len(body.text)))
    if reader.root.has_error:
        return None
    try:
        reader.document(at)
    except _RepeatedError as error:
        notes = (Note("the first one is here", error.first.span),)
        words = f"`{error.key.value}` is given twice"
        return diagnose("field-repeated", error.key.span, words, notes=notes)
    return None


class _RepeatedError(Exception):
    """A key that stands already."""

    def __init__(self, key: StringNode, first: StringNode) -> None:
        super().__init__(key.value)
        self.key = key
        self.first = first


class _Table(Struct):
    """A table to which more may be added."""

    start: int
    end: int
    mark: tuple[int, int]
    members: dict[str, tuple[StringNode, _Item]] = field(default_factory=dict)


class _Tables(Struct):
    """The tables that share a `[[header]]`."""

    start: int
    end: int
    mark_end: int
    items: list[_Table]


_Item: TypeAlias = _Table | _Tables | Node


def _node(body: Excerpt, item: _Item) -> Node:
    """A table, when nothing can be added any more."""
    if isinstance(item, _Table):
        members = tuple(Member(key, _node(body, inner)) for key, inner in item.members.values())
        return ObjectNode(body, item.start, item.end, *item.mark, members)
    if isinstance(item, _Tables):
        items = tuple(_node(body, table) for table in item.items)
        return ArrayNode(body, item.start, item.end, item.mark_end, items)
    return item


class _Reader:
    """Makes nodes of the syntax tree of a text that is TOML."""

    def __init__(self, body: Excerpt) -> None:
        self.body = body
        self.text = body.text
        encoded = body.text.encode("utf-8", "surrogatepass")
        self.root = tree_sitter.Parser(_LANGUAGE).parse(encoded).root_node
        # tree-sitter counts bytes; these are the characters of more than one, where they end.
        self.wide_ends: list[int] = []
        self.surplus = [0]
        for match in _WIDE.finditer(body.text):
            self.surplus.append(
                self.surplus[-1] + len(match[0].encode("utf-8", "surrogatepass")) - 1
            )
            self.wide_ends.append(match.end() + self.surplus[-1])
        self.diagnostics: list[Diagnostic] = []

    def document(self, wrong: int | None = None) -> _Table:
        """The whole text. Raises `_RepeatedError` for the statement that ends at `wrong`."""
        root = _Table(0, len(self.text), (0, 0))
        for statement in self.root.named_children:
            if statement.type == "pair":
                self.pair(root, statement, wrong)
            elif statement.type != "comment":
                self.table(root, statement, wrong)
        return root

    def offset(self, byte: int) -> int:
        """The character that begins at a byte."""
        return byte - self.surplus[bisect_right(self.wide_ends, byte)]

    def span(self, node: tree_sitter.Node) -> tuple[int, int]:
        return self.offset(node.start_byte), self.offset(node.end_byte)

    # ------------------------------------------------------------------------------- statements

    def table(self, root: _Table, statement: tree_sitter.Node, wrong: int | None) -> None:
        """`[name]` or `[[name]]` and the pairs below it."""
        _, name, closing, *rest = statement.children
        pairs = [child for child in rest if child.type == "pair"]
        lowest = pairs[-1].named_children[1] if pairs else closing
        start, end = self.offset(statement.start_byte), self.offset(lowest.end_byte)
        mark = (start, self.offset(closing.end_byte))
        keys = self.keys(name)
        if wrong is not None and start < wrong <= mark[1]:
            self.blame(root, keys)
        *outer, last = keys
        parent = self.inner(root, outer, end)
        known = parent.members.get(last.value)
        table = _Table(start, end, mark)
        if statement.type == "table_array_element":
            if known is None:
                known = (last, _Tables(start, end, mark[1], []))
                parent.members[last.value] = known
            assert isinstance(known[1], _Tables)
            known[1].items.append(table)
            known[1].end = end
        elif known is None:
            parent.members[last.value] = (last, table)
        else:  # a table inside it has a header above
            table = self.inner(parent, [last], end)
            table.mark = mark
        for pair in pairs:
            self.pair(table, pair, wrong)

    def pair(self, table: _Table, pair: tree_sitter.Node, wrong: int | None = None) -> None:
        """`key = value` in a table."""
        name, written = pair.named_children[:2]
        keys = self.keys(name)
        end = self.offset(written.end_byte)
        value = self.value(written)
        if wrong == end:
            self.blame(table, keys)
        *outer, last = keys
        table = self.inner(table, outer, end)
        if last.value in table.members:
            raise _RepeatedError(last, table.members[last.value][0])
        table.members[last.value] = (last, value)

    def inner(self, table: _Table, keys: list[StringNode], end: int) -> _Table:
        """The table to which keys lead, made where it is missing; it reaches to `end`."""
        for key in keys:
            new = _Table(key.start, key.end, (key.start, key.end))
            first, item = table.members.setdefault(key.value, (key, new))
            if isinstance(item, _Tables):
                item.end = max(item.end, end)
                item = item.items[-1]
            if not isinstance(item, _Table):
                raise _RepeatedError(key, first)
            item.end = max(item.end, end)
            table = item
        return table

    def blame(self, table: _Table, keys: list[StringNode]) -> None:
        """Raise for the last of the keys that is known already."""
        found: _RepeatedError | None = None
        item: _Item = table
        for key in keys:
            if isinstance(item, _Tables):
                item = item.items[-1]
            if not isinstance(item, _Table) or key.value not in item.members:
                break
            first, item = item.members[key.value]
            found = _RepeatedError(key, first)
        if found is not None:
            raise found

    # ------------------------------------------------------------------------------------ values

    def keys(self, node: tree_sitter.Node) -> list[StringNode]:
        """The parts of a key; the grammar nests them to the left."""
        parts: list[tree_sitter.Node] = []
        while node.type == "dotted_key":
            node, last = node.named_children
            parts.append(last)
        return [self.key(part) for part in (node, *reversed(parts))]

    def key(self, node: tree_sitter.Node) -> StringNode:
        if node.type == "quoted_key":
            return self.string(node)
        start, end = self.span(node)
        return StringNode(self.body, start, end, self.text[start:end], ((0, start),))

    def value(self, node: tree_sitter.Node) -> Node:
        start, end = self.span(node)
        match node.type:
            case "string":
                return self.string(node)
            case "array":
                inner = (child for child in node.named_children if child.type != "comment")
                items = tuple(self.value(child) for child in inner)
                return ArrayNode(self.body, start, end, start + 1, items)
            case "inline_table":
                table = _Table(start, end, (start, start + 1))
                for pair in node.named_children:
                    self.pair(table, pair)
                return _node(self.body, table)
            case "boolean":
                return BoolNode(self.body, start, end, self.text[start:end] == "true")
            case "integer" | "float":
                number = tomllib.loads("x = " + self.text[start:end])["x"]
                return NumberNode(self.body, start, end, number)
            case _:
                return DateNode(self.body, start, end)

    def string(self, node: tree_sitter.Node) -> StringNode:
        start, end = self.span(node)
        quote = self.text[start]
        width = 3 if end - start >= 6 and self.text.startswith(quote * 3, start) else 1
        content = (start + width, end - width)
        if width == 3 and self.text[content[0]] == "\n":  # a line end here is no part of the text
            content = (content[0] + 1, content[1])
        escapes = _ESCAPE.finditer(self.text, *content) if quote == '"' else ()
        return escaped_string(
            self.body,
            (start, end),
            content,
            escapes,
            _meaning,
            double_backslash,
            self.diagnostics,
        )


def _meaning(escape: re.Match[str]) -> str:
    """What an escape stands for."""
    letter = escape[0][1]
    if letter in "uUx":
        return chr(int(escape[0][2:], 16))
    if letter in " \t\n":  # the string goes on in the next line
        return ""
    return _ESCAPES.get(letter, letter)
