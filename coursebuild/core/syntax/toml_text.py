"""TOML, every value with its place.

Entry points: `parse_toml(source)`; `toml_string`, a string as TOML has it.

1. `tomllib` says whether the text is TOML. What is wrong otherwise is told by `toml_mistakes`.
2. tree-sitter says where keys, values and headers stand. Of these come the nodes that JSON gives
   too. Headers and dotted keys may add to a table that stands above, so tables grow until the end.
"""

from __future__ import annotations

import json
import re
import tomllib
from typing import TypeAlias

import tree_sitter
import tree_sitter_toml
from msgspec import Struct, field

from coursebuild.core.syntax.nodes import (
    ArrayNode,
    BoolNode,
    DateNode,
    Member,
    Node,
    NumberNode,
    ObjectNode,
    StringNode,
    build_string,
)
from coursebuild.core.syntax.toml_mistakes import diagnose_syntax, double_backslash, error_offset
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose
from coursebuild.core.text.source import Excerpt, Source

_LANGUAGE = tree_sitter.Language(tree_sitter_toml.language())
_WIDE = re.compile(r"[^\x00-\x7f]")
_ESCAPE = re.compile(r"\\(?:[ \t]*\n[ \t\n]*|u[0-9A-Fa-f]{4}|U[0-9A-Fa-f]{8}|x[0-9A-Fa-f]{2}|.)")
_ESCAPES = {"b": "\b", "t": "\t", "n": "\n", "f": "\f", "r": "\r", "e": "\x1b"}


def parse_toml(source: Source, *, rule: str = "map-syntax") -> Parsed[ObjectNode | None]:
    """The file as a table; no value, and one diagnostic, when it is not TOML. Never raises.

    `rule` is what that diagnostic is called. The value can be there along with diagnostics; a
    caller that finds any must not publish it.
    """
    body = source.excerpt("\r\n")  # as `tomllib` reads it; a lone CR stays, since TOML refuses it
    try:
        tomllib.loads(source.text)
        reader = _Reader(body)
        root = _node(body, reader.document())
        assert isinstance(root, ObjectNode)
        return Parsed(root, tuple(reader.diagnostics))
    except RecursionError:
        wrong = diagnose(rule, body.span(0, 0), "tables, arrays or keys nest too deep")
    except ValueError as error:
        wrong = _repeated_key(body, str(error)) or diagnose_syntax(body, str(error), rule)
    return Parsed(None, (wrong,))


def toml_string(text: str) -> str:
    """A basic string of TOML, which takes the escapes of JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _repeated_key(body: Excerpt, message: str) -> Diagnostic | None:
    """The diagnostic for a key or table that is given twice, if that is what `tomllib` says."""
    if not message.startswith(("Cannot", "Duplicate")):
        return None
    end = body.text.find("\n", error_offset(body.text, message))
    reader = _Reader(body.slice(0, end if end >= 0 else len(body.text)))
    if reader.root.has_error:
        return None
    reader.document()
    if reader.known is None:
        return None
    key, first = reader.known
    notes = (Note("the first one is here", first.span),)
    message = f"`{key.value}` is given twice"
    before, header = (one.source.line_text(one.line).strip() for one in (first.span, key.span))
    single = before.startswith("[") and re.match(r"\[[^\[]+\.", header)
    help = f"if there are several, write each header with two brackets: `[{header}]`"
    return diagnose("field-repeated", key.span, message, notes=notes, help=help if single else "")


class _TableParts(Struct):
    """A table to which more may be added, or the tables that share a `[[header]]`."""

    start: int
    end: int
    mark: tuple[int, int]
    members: dict[str, tuple[StringNode, _Item]] = field(default_factory=dict)
    tables: list[_TableParts] = field(default_factory=list)


_Item: TypeAlias = _TableParts | Node


def _node(body: Excerpt, item: _Item) -> Node:
    """A table, when nothing can be added any more."""
    if not isinstance(item, _TableParts):
        return item
    if item.tables:
        tables = tuple(_node(body, table) for table in item.tables)
        return ArrayNode(body, item.start, item.end, item.mark, tables)
    members = tuple(Member(key, _node(body, inner)) for key, inner in item.members.values())
    return ObjectNode(body, item.start, item.end, item.mark, members)


class _Reader:
    """Makes nodes of the syntax tree of a text that is TOML but for keys that are repeated."""

    def __init__(self, body: Excerpt) -> None:
        self.body = body
        self.text = body.text
        # Only strings and comments have other characters; with one byte for each, a byte of the
        # tree is a character of the text.
        plain = _WIDE.sub("x", body.text).encode()
        self.root = tree_sitter.Parser(_LANGUAGE).parse(plain).root_node
        self.known: tuple[StringNode, StringNode] | None = None
        """The last key of the last statement that stood before, and where it stands first."""
        self.diagnostics: list[Diagnostic] = []

    def document(self) -> _TableParts:
        """The whole text."""
        root = _TableParts(0, len(self.text), (0, 0))
        for statement in self.root.named_children:
            if statement.type == "pair":
                self.pair(root, statement)
            elif statement.type != "comment":
                self.table(root, statement)
        return root

    # ------------------------------------------------------------------------------- statements

    def table(self, root: _TableParts, statement: tree_sitter.Node) -> None:
        """`[name]` or `[[name]]` and the pairs below it."""
        _, name, closing, *rest = statement.children
        pairs = [child for child in rest if child.type == "pair"]
        start, end = statement.start_byte, closing.end_byte
        mark = (start, end)
        if pairs:
            end = pairs[-1].named_children[1].end_byte
        self.known = None
        *outer, last = self.keys(name)
        parent = self.inner(root, outer, end)
        table = _TableParts(start, end, mark)
        first, item = parent.members.setdefault(last.value, (last, table))
        if first is not last:
            self.known = (last, first)
        if statement.type == "table_array_element":
            if first is last:
                item = _TableParts(start, end, mark)
                parent.members[last.value] = (last, item)
            if isinstance(item, _TableParts):
                item.tables.append(table)
                item.end = end
        elif first is not last:  # a table inside it has a header above
            table = self.inner(parent, [last], end)
            table.mark = mark
        for pair in pairs:
            self.pair(table, pair)

    def pair(self, table: _TableParts, pair: tree_sitter.Node) -> None:
        """`key = value` in a table."""
        name, written = pair.named_children[:2]
        self.known = None
        value = self.value(written)
        *outer, last = self.keys(name)
        table = self.inner(table, outer, written.end_byte)
        first, _ = table.members.setdefault(last.value, (last, value))
        if first is not last:
            self.known = (last, first)

    def inner(self, table: _TableParts, keys: list[StringNode], end: int) -> _TableParts:
        """The table to which keys lead, made where it is missing; it reaches to `end`."""
        for key in keys:
            new = _TableParts(key.start, key.end, (key.start, key.end))
            first, item = table.members.setdefault(key.value, (key, new))
            if first is not key:
                self.known = (key, first)
            table = item if isinstance(item, _TableParts) else new
            table.end = max(table.end, end)
            if table.tables:
                table = table.tables[-1]
                table.end = max(table.end, end)
        return table

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
        start, end = node.byte_range
        return StringNode(self.body, start, end, self.body.slice(start, end))

    def value(self, node: tree_sitter.Node) -> Node:
        start, end = node.byte_range
        match node.type:
            case "string":
                return self.string(node)
            case "array":
                inner = (child for child in node.named_children if child.type != "comment")
                items = tuple(self.value(child) for child in inner)
                return ArrayNode(self.body, start, end, (start, start + 1), items)
            case "inline_table":
                table = _TableParts(start, end, (start, start + 1))
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
        toml_string = start, end = node.byte_range
        quote = self.text[start]
        width = 3 if end - start >= 6 and self.text.startswith(quote * 3, start) else 1
        content = (start + width, end - width)
        if width == 3 and self.text[content[0]] == "\n":  # a line end here is no part of the text
            content = (content[0] + 1, content[1])
        escapes = _ESCAPE.finditer(self.text, *content) if quote == '"' else ()
        return build_string(
            self.body, toml_string, content, escapes, _meaning, double_backslash, self.diagnostics
        )


def _meaning(escape: re.Match[str]) -> str:
    """What an escape stands for."""
    letter = escape[0][1]
    if letter in "uUx":
        return chr(int(escape[0][2:], 16))
    if letter in " \t\n":  # the string goes on in the next line
        return ""
    return _ESCAPES.get(letter, letter)
