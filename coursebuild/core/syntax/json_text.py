"""JSON in a fence, read strictly (RFC 8259), every value with its place.

Of commas, escapes and repeated keys all mistakes are reported. Any other makes the rest unreliable:
it is reported, and there is no value.
"""

from __future__ import annotations

import contextlib
import json
import re
from typing import NoReturn

from coursebuild.core.syntax import nodes
from coursebuild.core.text.diagnostics import Diagnostic, Edit, Fix, Note, Parsed, diagnose, write
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span

MAX_DEPTH = 64
"""How deep objects and arrays may nest: far more than a person writes, far less than the
interpreter's stack."""

_SPACE = regex(r"[ \t\n\r]*")
_TOKEN = regex(r'"(?:[^"\\\n]|\\.)*"|[][{},:]|[^][{},:\s]+')
_WORD = regex(r"[^\W\d][\w$]*|[-+.\d][-+.\w]*|//|/\*|\S")
_NUMBER = regex(r"-?(?:0|[1-9][0-9]*)(\.[0-9]+)?([eE][+-]?[0-9]+)?")
_KEY = regex(r'"(?:[^"\\\n]|\\.)*"[ \t\n\r]*:')
_STRING = regex(r'"((?:[^"\\\n]|\\.)*)"')
_ESCAPE = regex(
    r"\\u[Dd][89ABab][0-9A-Fa-f]{2}\\u[Dd][C-Fc-f][0-9A-Fa-f]{2}"
    r"|\\u[0-9A-Fa-f]{4}|\\.|[\x00-\x1f\ud800-\udfff]"
)
_SURROGATE = regex(r"[\ud800-\udfff]")
_CURLY_QUOTES = "“”„‟‘’‚‛«»"


def parse_json(body: Excerpt, place: Span) -> Parsed[nodes.Node | None]:
    """The value in `body`; `place` is what to point at if there is none. Never raises.

    There may be a value and diagnostics; a caller that finds any must not publish it.
    """
    if not body.text.strip(" \t\r\n"):
        message = "the block is empty: a JSON object is expected"
        help = 'write `{"field": value, …}`'
        return Parsed(None, (diagnose("json-syntax", place, message, help=help),))
    reader = _Reader(body)
    try:
        value = reader.read_document()
    except _UnreadableError:
        value = None
    return Parsed(value, tuple(reader.diagnostics))


def to_one_line(node: nodes.Node) -> Excerpt:
    """A value on one line, each of its tokens as written and with its place."""
    text, pieces = "", []
    for token in _TOKEN.finditer(node.body.text, node.start, node.end):
        pieces.append((len(text), node.body.offset(token.start())))
        text += f"{token[0]} " if token[0] in ",:" else token[0]
    return Excerpt(node.body.source, text, tuple(pieces))


class _UnreadableError(Exception):
    """The rest of the text cannot be understood; what is wrong has been reported."""


class _Reader:
    """Reads a text from its beginning to its end; `offset` is that of the next character."""

    def __init__(self, body: Excerpt) -> None:
        self.body = body
        self.text = body.text
        self.offset = 0
        self.diagnostics: list[Diagnostic] = []

    def read_document(self) -> nodes.Node:
        value = self.read_value(0)
        if self.peek():
            self.fail_expecting("the end of the JSON")
        return value

    def peek(self) -> str:
        """Skip white space; return the next character. Odd spaces are reported."""
        while True:
            self.offset = at = _SPACE.match(self.text, self.offset).end()  # type: ignore[union-attr]  # it matches nothing too
            odd = nodes.odd_character(self.text[at : at + 1])
            if not odd:
                return self.text[at : at + 1]
            help = Fix("replace it by a plain space, or remove it", " ", safe=True)
            self.report(at, at + 1, f"{odd} is not white space in JSON", help)
            self.offset += 1

    # ----------------------------------------------------------------------- objects and arrays

    def read_value(self, depth: int) -> nodes.Node:
        char, start = self.peek(), self.offset
        if char == '"':
            return self.read_string()
        if char and char in "{[":
            if depth == MAX_DEPTH:
                message = f"objects and arrays nest more than {MAX_DEPTH} deep"
                self.report(start, start + 1, message)
                raise _UnreadableError
            self.offset += 1
            return self.read_object(start, depth) if char == "{" else self.read_array(start, depth)
        return self.read_scalar()

    def read_object(self, start: int, depth: int) -> nodes.ObjectNode:
        members: dict[str, nodes.Member] = {}
        is_done = self.peek() == "}"
        while not is_done:
            if self.peek() != '"':
                self.fail_expecting("a key in double quotes", opening=start)
            key = self.read_string()
            if first := members.get(key.value):
                message = f"`{nodes.shorten(key.value)}` is given twice"
                notes = (Note("the first one is here", first.key.span),)
                self.diagnostics.append(diagnose("field-repeated", key.span, message, notes=notes))
            if self.peek() != ":":
                self.fail_expecting(f"`:` after the key `{nodes.shorten(key.value)}`")
            self.offset += 1
            members.setdefault(key.value, nodes.Member(key, self.read_value(depth + 1)))
            is_done = self.read_separator(start, "}")
        self.offset += 1
        return nodes.ObjectNode(self.body, start, self.offset, (start, start + 1), members)

    def read_array(self, start: int, depth: int) -> nodes.ArrayNode:
        items: list[nodes.Node] = []
        is_done = self.peek() == "]"
        while not is_done:
            items.append(self.read_value(depth + 1))
            is_done = self.read_separator(start, "]")
        self.offset += 1
        return nodes.ArrayNode(self.body, start, self.offset, (start, start + 1), items)

    def read_separator(self, opening: int, closer: str) -> bool:
        """Read what follows a value, the comma included; whether it was the last value."""
        end = self.offset
        char, comma = self.peek(), self.offset
        if char == ",":
            self.offset += 1
            if self.peek() == closer:
                self.report(comma, comma + 1, f"there is a comma before `{closer}`", _COMMA_HELP)
        elif char != closer:
            key = _KEY.match(self.text, self.offset)
            if not (key if closer == "}" else char and char in '"{[-0123456789'):
                self.fail_expecting(f"`,` or `{closer}`", opening=opening)
            help = Fix("put `,` between the two values", ",", safe=True)
            self.report(end, end, "a comma is missing here", help)
        return self.peek() == closer

    # ---------------------------------------------------------------------------------- scalars

    def read_scalar(self) -> nodes.Node:
        """A number or word."""
        start, word = self.offset, self.word()
        self.offset += len(word)
        place = self.body, start, self.offset
        if word in ("true", "false"):
            return nodes.BoolNode(*place, word == "true")
        if word == "null":
            return nodes.NullNode(*place)
        number = _NUMBER.fullmatch(word)
        with contextlib.suppress(ValueError):  # Python converts no more than some thousand digits
            if number is not None:
                is_float = number[1] or number[2]
                return nodes.NumberNode(*place, float(word) if is_float else int(word))
        self.offset = start
        self.fail_expecting("a value")

    def read_string(self) -> nodes.StringNode:
        match = _STRING.match(self.text, self.offset)
        if match is None:
            line = self.text[self.offset :].split("\n", 1)[0].rstrip()
            help = 'close it with `"`; a line end inside a string is written `\\n`'
            message = "the string is not closed on its line"
            self.report(self.offset, self.offset + len(line), message, help)
            raise _UnreadableError
        self.offset = match.end()
        escapes = _ESCAPE.finditer(self.text, *match.span(1))
        replacements = ((escape, self.decode_escape(escape)) for escape in escapes)
        value = nodes.replace_escapes(self.body, match.span(1), replacements)
        self.diagnostics += nodes.check_tex_escapes(value, _backslash_help)
        return nodes.StringNode(self.body, *match.span(), value)

    def decode_escape(self, match: re.Match[str]) -> str:
        """The character that an escape stands for; a wrong one is reported."""
        escape, char = match[0], ""
        with contextlib.suppress(ValueError):
            char = json.loads(f'"{escape}"')
        if char and not _SURROGATE.match(char):
            return char
        message = f"`{escape}` is not an escape of JSON"
        help = _backslash_help(nodes.tex_word(self.text, match.start() + 1))
        if char:
            name = f"`{escape}`" if len(escape) > 1 else f"U+{ord(char):04X}"
            message, help = f"{name} is half of a character", "write the character itself"
        elif len(escape) == 1:
            message = f"the control character U+{ord(escape):04X} inside a string"
            help = Fix(f"write `\\u{ord(escape):04x}`, or remove it", "")
        self.report(match.start(), match.end(), message, help)
        return "\ufffd"

    # --------------------------------------------------------------------------------- mistakes

    def report(
        self, start: int, end: int, message: str, help: str = "", notes: tuple[Note, ...] = ()
    ) -> None:
        span = self.body.span(start, end)
        self.diagnostics.append(diagnose("json-syntax", span, message, help=help, notes=notes))

    def help_with(self, word: str, expected: str) -> str:
        """How to mend a word where something else was expected; may be empty."""
        if word in _CURLY_QUOTES or word in "'`":
            help = 'JSON strings stand between double quotes: `"…"`'
            return Fix(help, edits=self.straight_quotes(), safe=True)
        if word == ";":
            return Fix("JSON separates values by `,`", ",", safe=True)
        if word in ("//", "/*", "#"):
            return "JSON has no comments: remove it"
        if expected.startswith("`,`") and (word[0].isalnum() or word == "\\"):
            return 'a double quote inside a string is written `\\"`'
        if expected == "a key in double quotes" and word[0].isalpha():
            return write(f'"{nodes.shorten(word)}"')
        if expected == "a value" and word[0].isalpha():
            return "text stands between double quotes; other words are `true`, `false`, `null`"
        if expected == "a value" and word[0] in "+-.0123456789":
            return "a number has digits on both sides of its point, and no `+` or `0` before them"
        return ""

    def word(self) -> str:
        """The word or sign that stands here; empty at the end."""
        match = _WORD.match(self.text, self.offset)
        return match[0] if match else ""

    def straight_quotes(self) -> tuple[Edit, ...]:
        """The edits that give each string from here on the quotes of JSON."""
        matches = (m for m in _QUOTED.finditer(self.text, self.offset) if m[0][0] != '"')
        places = (at for match in matches for at in (match.start(), match.end() - 1))
        return tuple(Edit(self.body.span(at, at + 1), '"') for at in places)

    def fail_expecting(self, noun: str, *, opening: int | None = None) -> NoReturn:
        """Report that something else stands here than `noun`, and give up."""
        text, at = self.text, self.offset
        if at >= len(text):
            at = max(len(text.rstrip()), 1) - 1 if opening is None else opening
            message = f"the JSON ends where {noun} is expected"
            message = message if opening is None else f"`{text[opening]}` is never closed"
            self.report(at, at + 1, message)
            raise _UnreadableError
        word, notes = self.word(), tuple[Note, ...]()
        if opening is not None and word in "]}:":
            place = self.body.span(opening, opening + 1)
            notes = (Note(f"`{text[opening]}` is opened here", place),)
        name = "a string" if word == '"' else f"`{nodes.shorten(word)}`"
        help = self.help_with(word, noun)
        self.report(at, at + len(word), f"expected {noun}, found {name}", help, notes)
        raise _UnreadableError


_COMMA_HELP = Fix("remove the comma", "", safe=True)
_QUOTED = regex(
    r"""
    "(?:[^"\\\n]|\\.)*"
    | (?: [“”„‟«»] [^"\\\n]*? [“”„‟«»] | (?P<mark>['‘`]) [^"\\\n]*? (?(mark)['’`]) ) (?=\s*[,:\]}])
    """,
    re.VERBOSE,
)
"""A string, also one between the quotes of Python or of a word processor."""


def _backslash_help(command: str) -> str:
    help = f"to write a backslash, double it: `\\\\{command}`"
    return Fix(help, "\\\\", "\\", safe=True)
