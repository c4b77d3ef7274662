r"""JSON in a fence, read strictly, every value with its place.

Entry points: `parse_json(body, place)`; `to_one_line`, a value without its layout.

1. One pass over the text gives the nodes. The grammar is RFC 8259 and nothing more; nesting is
   limited to `MAX_DEPTH`.
2. A mistake after which the meaning is still clear (a trailing or missing comma, a comment, `True`,
   a bad escape, a malformed number, a repeated key) is reported and reading goes on, so that all of
   them show in one run.
3. After any other mistake the rest cannot be trusted: that one is reported and there is no value.
"""

from __future__ import annotations

import re
from typing import NoReturn

from coursebuild.core.syntax.nodes import (
    ArrayNode,
    BoolNode,
    ErrorNode,
    Member,
    Node,
    NullNode,
    NumberNode,
    ObjectNode,
    StringNode,
    escaped_string,
    odd_character,
    tex_word,
)
from coursebuild.core.syntax.wording import shorten
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose
from coursebuild.core.text.source import Excerpt, Span

MAX_DEPTH = 64
"""How deep objects and arrays may nest: far more than a person writes, far less than the
interpreter's stack."""

_SPACE = re.compile(r"[ \t\n\r]*")
_TOKEN = re.compile(r'"(?:[^"\\\n]|\\.)*"|[][{},:]|[^][{},:\s]+')
_COMMENT = re.compile(r"//[^\n]*|#[^\n]*|/\*.*?(?:\*/|\Z)", re.DOTALL)
_WORD = re.compile(r"[^\W\d][\w$]*")
_SCALAR = re.compile(r"[^\W\d][\w$]*|[-+.0-9][-+.\w]*")
_NUMBER = re.compile(r"-?(?:0|[1-9][0-9]*)(\.[0-9]+)?([eE][+-]?[0-9]+)?")
_KEY = re.compile(r'"(?:[^"\\\n]|\\.)*"[ \t\n\r]*:')
_STRING = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
_ESCAPE = re.compile(
    r"\\u[Dd][89ABab][0-9A-Fa-f]{2}\\u[Dd][C-Fc-f][0-9A-Fa-f]{2}"
    r"|\\u[0-9A-Fa-f]{4}|\\.|[\x00-\x1f\ud800-\udfff]"
)
_ESCAPES = {'"': '"', "\\": "\\", "/": "/", "b": "\b", "f": "\f", "n": "\n", "r": "\r", "t": "\t"}
_CURLY = "“”„‟‘’‚‛«»"
_WORDS = {"True": "true", "TRUE": "true", "False": "false", "FALSE": "false"}
_WORDS |= dict.fromkeys(("None", "NULL", "Null", "nil", "undefined"), "null")
_NOT_FINITE = frozenset(("NaN", "nan", "Infinity", "inf", "Inf"))


def parse_json(body: Excerpt, place: Span) -> Parsed[Node | None]:
    """The value that `body` holds; `place` is what to point at when it holds none. Never raises.

    The value can be there along with diagnostics; a caller that finds any must not publish it.
    """
    if not body.text.strip(" \t\r\n"):
        message = "the block is empty: a JSON object is expected"
        help = 'write `{"field": value, …}`'
        return Parsed(None, (diagnose("json-syntax", place, message, help=help),))
    reader = _Reader(body)
    try:
        value = reader.document()
    except _LostError:
        value = None
    return Parsed(value, tuple(reader.diagnostics))


def to_one_line(node: Node) -> Excerpt:
    """A value on one line, each of its parts as it is written and with its place."""
    text, pieces = "", []
    for token in _TOKEN.finditer(node.body.text, node.start, node.end):
        pieces.append((len(text), node.body.offset(token.start())))
        text += f"{token[0]} " if token[0] in ",:" else token[0]
    return Excerpt(node.body.source, text, tuple(pieces))


class _LostError(Exception):
    """The rest of the text cannot be understood; what is wrong has been reported."""


class _Reader:
    """Reads a text from its beginning to its end; `at` is the place of what comes next."""

    def __init__(self, body: Excerpt) -> None:
        self.body = body
        self.text = body.text
        self.at = 0
        self.diagnostics: list[Diagnostic] = []

    def document(self) -> Node:
        value = self.value(0)
        char = self.next()
        if char and char in "]}":
            self.report(self.at, self.at + 1, f"`{char}` closes nothing")
        elif char:
            line = self.text[self.at :].split("\n", 1)[0]
            self.report(self.at, self.at + len(line), "text after the end of the JSON value")
        return value

    def next(self) -> str:
        """The next character that is neither white space nor a mistaken comment or space."""
        while True:
            self.at = at = _SPACE.match(self.text, self.at).end()  # type: ignore[union-attr]  # it matches nothing too
            char = self.text[at : at + 1]
            if comment := _COMMENT.match(self.text, at):
                first_line = comment[0].split("\n", 1)[0]
                self.report(at, at + len(first_line), "JSON has no comments", "remove it")
                self.at = comment.end()
            elif odd := odd_character(char):
                help = "replace it by a plain space, or remove it"
                self.report(at, at + 1, f"{odd} is not white space in JSON", help)
                self.at += 1
            else:
                return char

    # ----------------------------------------------------------------------- objects and arrays

    def value(self, depth: int) -> Node:
        char, start = self.next(), self.at
        if char == '"':
            return self.string()
        if char and char in "{[":
            if depth == MAX_DEPTH:
                message = f"objects and arrays nest more than {MAX_DEPTH} deep"
                self.report(start, start + 1, message)
                raise _LostError
            self.at += 1
            return self.object(start, depth) if char == "{" else self.array(start, depth)
        scalar = _SCALAR.match(self.text, start)
        if scalar is None:
            self.expected("a value")
        self.at = scalar.end()
        return self.scalar(start, scalar[0])

    def object(self, start: int, depth: int) -> ObjectNode:
        members: list[Member] = []
        known: dict[str, StringNode] = {}
        done = self.next() == "}"
        while not done:
            if self.next() != '"':
                self.expected("a key in double quotes", opened=start)
            key = self.string()
            first = known.setdefault(key.value, key)
            if first is not key:
                message = f"`{shorten(key.value)}` is given twice"
                notes = (Note("the first one is here", first.span),)
                self.diagnostics.append(diagnose("field-repeated", key.span, message, notes=notes))
            self.colon(key)
            members.append(Member(key, self.value(depth + 1)))
            done = self.separator(start, "}")
        self.at += 1
        return ObjectNode(self.body, start, self.at, (start, start + 1), tuple(members))

    def array(self, start: int, depth: int) -> ArrayNode:
        items: list[Node] = []
        done = self.next() == "]"
        while not done:
            if not self.next():
                self.unclosed(start)
            items.append(self.value(depth + 1))
            done = self.separator(start, "]")
        self.at += 1
        return ArrayNode(self.body, start, self.at, (start, start + 1), tuple(items))

    def colon(self, key: StringNode) -> None:
        char = self.next()
        if char == "=":
            self.report(self.at, self.at + 1, "`=` where JSON has `:`", "write `:`")
        elif char != ":":
            self.expected(f"`:` after the key `{shorten(key.value)}`")
        self.at += 1

    def separator(self, opened: int, closer: str) -> bool:
        """After a value: whether it was the last one; otherwise past the comma."""
        end = self.at
        char, comma = self.next(), self.at
        if char == ",":
            self.at += 1
            while self.next() == ",":
                message = "two commas with no value between them"
                self.report(self.at, self.at + 1, message, "remove one")
                self.at += 1
            if self.next() == closer:
                self.report(comma, comma + 1, f"a comma before `{closer}`", "remove the comma")
        elif char != closer:
            key = _KEY.match(self.text, self.at)
            if not (key if closer == "}" else char and char in '"{[-0123456789'):
                self.expected(f"`,` or `{closer}`", opened=opened)
            self.report(end, end, "a comma is missing here", "put `,` between the two values")
        return self.next() == closer

    # ---------------------------------------------------------------------------------- scalars

    def scalar(self, start: int, written: str) -> Node:
        """A number or word; `ErrorNode` for one that is not JSON."""
        end = self.at
        if written in ("true", "false"):
            return BoolNode(self.body, start, end, written == "true")
        if written == "null":
            return NullNode(self.body, start, end)
        number = _NUMBER.fullmatch(written)
        if number is not None and (number[1] or number[2]):
            return NumberNode(self.body, start, end, float(written))
        if number is not None:
            try:
                return NumberNode(self.body, start, end, int(written))
            except ValueError:  # the interpreter converts no more than some thousand digits
                message, help = f"a number of {end - start} digits is too long", ""
        elif written in _WORDS:
            message, help = f"`{written}` is not JSON", f"write `{_WORDS[written]}`"
        elif written.lstrip("+-") in _NOT_FINITE:
            message, help = f"JSON has no `{written}`", "write a finite number"
        elif written[0] in "+-.0123456789":
            message, help = f"`{shorten(written)}` is not a number of JSON", _number_help(written)
        else:
            self.at = start
            self.expected("a value")
        self.report(start, end, message, help)
        return ErrorNode(self.body, start, end)

    def string(self) -> StringNode:
        match = _STRING.match(self.text, self.at)
        if match is None:
            line = self.text[self.at :].split("\n", 1)[0].rstrip()
            help = 'close it with `"`; a line end inside a string is written `\\n`'
            message = "the string is not closed on its line"
            self.report(self.at, self.at + len(line), message, help)
            raise _LostError
        self.at = match.end()
        content = match.span(1)
        escapes = _ESCAPE.finditer(self.text, *content)
        return escaped_string(
            self.body, match.span(), content, escapes, self.escape, _double, self.diagnostics
        )

    def escape(self, match: re.Match[str]) -> str:
        """What an escape stands for, or a control character; a mistake is reported."""
        written = match[0]
        if len(written) == 12:
            high, low = int(written[2:6], 16), int(written[8:], 16)
            return chr(0x10000 + ((high - 0xD800) << 10) + low - 0xDC00)
        if written[0] == "\\" and written[1] in _ESCAPES:
            return _ESCAPES[written[1]]
        code = int(written[2:], 16) if len(written) == 6 else ord(written[0])
        if len(written) == 6 and not 0xD800 <= code < 0xE000:
            return chr(code)
        message, help = _escape_mistake(self.text, match, code)
        self.report(match.start(), match.end(), message, help)
        return "\ufffd"

    # --------------------------------------------------------------------------------- mistakes

    def report(
        self, start: int, end: int, message: str, help: str = "", notes: tuple[Note, ...] = ()
    ) -> None:
        span = self.body.span(start, end)
        self.diagnostics.append(diagnose("json-syntax", span, message, help=help, notes=notes))

    def unclosed(self, opened: int) -> NoReturn:
        self.report(opened, opened + 1, f"`{self.text[opened]}` is never closed")
        raise _LostError

    def expected(self, what: str, *, opened: int | None = None) -> NoReturn:
        """Report what stands here in the place of something else; never returns."""
        text, at = self.text, self.at
        if at >= len(text):
            if opened is not None:
                self.unclosed(opened)
            last = max(len(text.rstrip()), 1)
            self.report(last - 1, last, f"the JSON ends where {what} is expected")
            raise _LostError
        word = _WORD.match(text, at)
        found = word[0] if word else text[at]
        notes: tuple[Note, ...] = ()
        if opened is not None and found in "]}":
            notes = (Note(f"`{text[opened]}` is opened here", self.body.span(opened, opened + 1)),)
        name = "a string" if found == '"' else f"`{shorten(found)}`"
        help = _help(found, what)
        self.report(at, at + len(found), f"expected {what}, found {name}", help, notes)
        raise _LostError


def _escape_mistake(text: str, match: re.Match[str], code: int) -> tuple[str, str]:
    """What is wrong with an escape or a character inside a string, and how to mend it."""
    written = match[0]
    if 0xD800 <= code < 0xE000:
        name = f"`{written}`" if len(written) > 1 else f"U+{code:04X}"
        return f"{name} is half of a character", "write the character itself"
    if written == "\t":
        return "a tab inside a string", "write `\\t`, or a space"
    if len(written) == 1:
        message = f"the control character U+{code:04X} inside a string"
        return message, f"write `\\u{code:04x}`, or remove it"
    word = tex_word(text, match.start() + 1)
    if written != "\\u":
        return f"`{written}` is not an escape of JSON", _double(word)
    help = _double(word) if len(word) > 1 else "write four hexadecimal digits after `\\u`"
    return "`\\u` is not followed by four hexadecimal digits", help


def _double(command: str) -> str:
    return f"to write a backslash, double it: `\\\\{command}`"


def _help(found: str, what: str) -> str:
    """How to mend what was found in the place of something else; may be empty."""
    char = found[0]
    letter = char.isalpha() or char == "_"
    if char in _CURLY:
        return 'JSON knows only the straight quote `"`; replace the curly ones of this block'
    if char in "'`":
        return 'JSON strings stand between double quotes: `"…"`'
    if char == ";":
        return "JSON separates values by `,`"
    if char == "(":
        return "a list stands between `[` and `]`"
    if what.startswith("`,`") and (char.isalnum() or char == "\\"):
        return 'a double quote inside a string is written `\\"`'
    if what == "a key in double quotes" and letter:
        return f'write `"{shorten(found)}"`'
    if what == "a value" and letter:
        return "text stands between double quotes"
    return ""


def _number_help(written: str) -> str:
    """How a malformed number is written in JSON, where that is clear."""
    for read in (lambda: int(written, 0), lambda: int(written), lambda: float(written)):
        try:
            value = read()
        except ValueError:
            continue
        return "" if "n" in str(value) else f"write `{shorten(str(value))}`"  # inf, nan
    return ""
