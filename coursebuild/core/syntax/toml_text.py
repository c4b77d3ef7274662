"""TOML, every value with its place.

`tomllib` decides whether the text is TOML; tree-sitter finds the places of keys, values and
headers. Headers and dotted keys may add to a table above, so tables grow until the end.
"""

from __future__ import annotations

import json
import re
import tomllib
from typing import Any

import tree_sitter
import tree_sitter_toml

from coursebuild.core.syntax import nodes
from coursebuild.core.text.diagnostics import Diagnostic, Fix, Parsed, diagnose
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Source

_LANGUAGE = tree_sitter.Language(tree_sitter_toml.language())
_NOT_ASCII = regex(r"[^\x00-\x7f]")
_ESCAPE = regex(r"\\(?:[ \t]*\n[ \t\n]*|u[0-9A-Fa-f]{4}|U[0-9A-Fa-f]{8}|x[0-9A-Fa-f]{2}|.)")


def parse_toml(
    text: Source | Excerpt, *, rule: str = "map-syntax"
) -> Parsed[nodes.ObjectNode | None]:
    """A file or the body of a fence as a table; no value, and one diagnostic, if it is not TOML.

    `rule` is that of this diagnostic. A caller that finds any must not publish the value.
    Never raises.
    """
    # As `tomllib` reads a file; a lone CR stays, since TOML refuses it.
    body = text.excerpt("\r\n") if isinstance(text, Source) else text
    try:
        tomllib.loads(text.text)
        reader = _Reader(body)
        return Parsed(reader.read_document(), tuple(reader.diagnostics))
    except RecursionError:
        diagnostic = diagnose(rule, body.span(0, 0), "tables, arrays or keys are nested too deeply")
    except ValueError as error:
        start, end, message, help = _describe_mistake(body.text, str(error))
        rule = "field-repeated" if message == _REPEATED else rule
        diagnostic = diagnose(rule, body.span(start, end), message, help=help)
    return Parsed(None, (diagnostic,))


def toml_string(text: str) -> str:
    """A basic string of TOML, which takes the escapes of JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


class _Reader:
    """Makes nodes of the syntax tree of a text that is TOML."""

    def __init__(self, body: Excerpt) -> None:
        self.body = body
        self.text = body.text
        # Only strings and comments hold other characters than ASCII. With one byte for each of
        # these, offsets in the tree are offsets in the text.
        plain = _NOT_ASCII.sub("x", body.text).encode()
        self.root = tree_sitter.Parser(_LANGUAGE).parse(plain).root_node
        self.diagnostics: list[Diagnostic] = []

    def read_document(self) -> nodes.ObjectNode:
        """The table of the whole text."""
        root = nodes.ObjectNode(self.body, 0, len(self.text), (0, 0), {})
        for statement in self.root.named_children:
            if statement.type == "pair":
                self.read_pair(root, statement)
            elif statement.type != "comment":
                self.read_table(root, statement)
        return root

    # ------------------------------------------------------------------------------- statements

    def read_table(self, root: nodes.ObjectNode, statement: tree_sitter.Node) -> None:
        """Read `[name]` or `[[name]]`, and the pairs below it."""
        _, name, closing, *rest = statement.children
        pairs = [child for child in rest if child.type == "pair"]
        start, end = statement.start_byte, closing.end_byte
        opening = (start, end)
        if pairs:
            end = pairs[-1].named_children[1].end_byte
        *outer, last = self.read_key_path(name)
        parent = self.open_table(root, outer, end)
        table = nodes.ObjectNode(self.body, start, end, opening, {})
        if statement.type == "table_array_element":
            array = self.add(parent, last, nodes.ArrayNode(self.body, start, end, opening, []))
            if isinstance(array, nodes.ArrayNode):
                array.items.append(table)
                array.end = end
        elif self.add(parent, last, table) is not table:  # that of a table inside it stands above
            table = self.open_table(parent, [last], end)
            table.opening = opening
        for pair in pairs:
            self.read_pair(table, pair)

    def read_pair(self, table: nodes.ObjectNode, pair: tree_sitter.Node) -> None:
        """Read `key = value` in a table."""
        name, value_node = pair.named_children[:2]
        value = self.read_value(value_node)
        *outer, last = self.read_key_path(name)
        self.add(self.open_table(table, outer, value.end), last, value)

    def open_table(
        self, table: nodes.ObjectNode, keys: list[nodes.StringNode], end: int
    ) -> nodes.ObjectNode:
        """Return the table to which keys lead, made if need be and extended to `end`."""
        for key in keys:
            new = nodes.ObjectNode(self.body, key.start, key.end, (key.start, key.end), {})
            item = self.add(table, key, new)
            if isinstance(item, nodes.ArrayNode) and item.items:
                item.end = max(item.end, end)
                item = item.items[-1]
            table = item if isinstance(item, nodes.ObjectNode) else new
            table.end = max(table.end, end)
        return table

    def add(self, table: nodes.ObjectNode, key: nodes.StringNode, value: nodes.Node) -> nodes.Node:
        """Give a key its value, unless it has one above; return that which it has."""
        return table.members.setdefault(key.value, nodes.Member(key, value)).value

    # ------------------------------------------------------------------------------------ values

    def read_key_path(self, node: tree_sitter.Node) -> list[nodes.StringNode]:
        """The parts of a key; the grammar nests them to the left."""
        parts: list[tree_sitter.Node] = []
        while node.type == "dotted_key":
            node, last = node.named_children
            parts.append(last)
        keys = []
        for part in (node, *reversed(parts)):
            if part.type == "quoted_key":
                keys.append(self.read_string(part))
            else:
                place = part.byte_range
                keys.append(nodes.StringNode(self.body, *place, self.body.slice(*place)))
        return keys

    def read_value(self, node: tree_sitter.Node) -> nodes.Node:
        start, end = node.byte_range
        match node.type:
            case "string":
                return self.read_string(node)
            case "array":
                inner = (child for child in node.named_children if child.type != "comment")
                items = [self.read_value(child) for child in inner]
                return nodes.ArrayNode(self.body, start, end, (start, start + 1), items)
            case "inline_table":
                table = nodes.ObjectNode(self.body, start, end, (start, start + 1), {})
                for pair in node.named_children:
                    self.read_pair(table, pair)
                return table
            case "boolean":
                return nodes.BoolNode(self.body, start, end, self.text[start:end] == "true")
            case "integer" | "float":
                return nodes.NumberNode(self.body, start, end, _value_of(self.text[start:end]))
            case _:
                return nodes.DateNode(self.body, start, end)

    def read_string(self, node: tree_sitter.Node) -> nodes.StringNode:
        start, end = node.byte_range
        quote = self.text[start]
        width = 3 if end - start >= 6 and self.text.startswith(quote * 3, start) else 1
        content = (start + width, end - width)
        if width == 3 and self.text[content[0]] == "\n":  # a line end here is no part of the text
            content = (content[0] + 1, content[1])
        escapes = _ESCAPE.finditer(self.text, *content) if quote == '"' else ()
        replacements = ((escape, _value_of(f'"""{escape[0]}"""')) for escape in escapes)
        value = nodes.replace_escapes(self.body, content, replacements)
        self.diagnostics += nodes.check_tex_escapes(value, double_backslash)
        return nodes.StringNode(self.body, start, end, value)


def _value_of(text: str) -> Any:
    return tomllib.loads(f"x = {text}")["x"]


_PLACE = regex(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")
_SCALAR = regex(r"[^\n,\]}#]*")
_WORD = regex(r"[\w.+-]+|\S")
_CURLY_QUOTES = tuple("“”„‟‘’‚‛«»")
_TRIPLES = ('"""', "'''")
_REPEATED = "this is given twice"
_QUOTES_HELP = "TOML knows only the straight quotes `\"` and `'`"
_WORDS_HELP = "the only words without quotes are `true` and `false`"
_NUMBERS_HELP = "a number has no leading zeros, and digits on both sides of its point"


def double_backslash(command: str) -> str:
    """How to write a command of TeX in a string."""
    help = f"double the backslash: `\\\\{command}`, or put the text between single quotes"
    return Fix(help, "\\\\", "\\", safe=True)


_Mistake = tuple[int, int, str, str]
"""Its start and end in the text, the message and the help."""


def _describe_mistake(text: str, message: str) -> _Mistake:
    at, place = len(text), _PLACE.search(message)  # the end of the text, if it names no place
    if place is not None and place[1] is not None:
        starts = [0, *(match.end() for match in re.finditer("\n", text))]
        at = min(starts[min(int(place[1]), len(starts)) - 1] + int(place[2]) - 1, len(text))
    char, words = text[at : at + 1], _PLACE.sub("", message).replace("'", "`")
    if odd := "a lone carriage return" if char == "\r" else nodes.odd_character(char):
        help: str = Fix("replace it by a plain space, or remove it", " ", safe=char != "\r")
        help = help if at else Fix("remove it", "", safe=True)
        return at, at + 1, f"{odd} is not allowed here in TOML", help
    if words.startswith(("Cannot", "Duplicate")):
        start = text.rfind("\n", 0, at) + 1
        line = text[start:].split("\n", 1)[0]
        help = "if there are several, each header has two brackets, as in `[[level]]`"
        return start, start + len(line), _REPEATED, help if line.startswith("[") else ""
    openings = [text.rfind(quotes) for quotes in _TRIPLES if text.count(quotes) % 2]
    if openings and words.startswith(("Unterminated", 'Expected "')):
        opening = max(openings)
        return opening, opening + 3, f"`{text[opening : opening + 3]}` is never closed", ""
    if words.startswith("Illegal") and char == "\n":
        help = "text of several lines stands between three quotes"
        return at, at, "the string is not closed on its line", help
    if re.match("Unescaped|Escaped|Invalid hex", words):
        start = text.rindex("\\", 0, at)
        help = double_backslash(nodes.tex_word(text, start + 1))
        return start, start + 2, f"`{text[start : start + 2]}` is not an escape of TOML", help
    before = re.search(r"[\w.+:-]*\Z", text[:at])
    is_inside = before is not None and before[0] and char.strip(",#") and not char.isspace()
    if words.startswith(("Invalid value", "Invalid date")):
        return _wrong_value(text, at)
    if before is not None and is_inside and words.startswith(("Expected newline", "Unclosed")):
        return _wrong_value(text, before.start())
    help = Fix("TOML writes `key = value`", " =", safe=True) if char == ":" else ""
    help = _QUOTES_HELP if char in _CURLY_QUOTES else help
    help = "values in brackets have commas between them" if words[:8] == "Unclosed" else help
    word = _WORD.match(text, at)
    end, name = (at, "the end of the line") if word is None else (word.end(), f"`{word[0]}`")
    return at, end, f"{words[:1].lower()}{words[1:]}, found {name}", help


def _wrong_value(text: str, start: int) -> _Mistake:
    scalar = _SCALAR.match(text, start)
    value = scalar[0].rstrip() if scalar else ""
    if not value:
        return start, start, "a value is missing", 'an empty text is written `""`'
    help = ""
    if value.lower() in ("true", "false", "null", "none", "nil"):
        help = _WORDS_HELP
    elif value[0] in _CURLY_QUOTES:
        help = _QUOTES_HELP
    elif re.fullmatch(r"[+-]?[0-9]*\.?[0-9]*", value):
        help = _NUMBERS_HELP
    elif '"' not in value and "'" not in value:
        new = None if "\\" in value or "#" in value else f'"{value}"'
        help = Fix(f'text needs quotes: `"{nodes.shorten(value)}"`', new, safe=True)
    message = f"`{nodes.shorten(value)}` is not a valid TOML value"
    return start, start + len(value), message, help
