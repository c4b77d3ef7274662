r"""JSON in a fence, read strictly, every value with its place.

Entry point: `parse_json(body, place)`.

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

from msgspec import Struct, field

from coursebuild.diagnostics import Diagnostic, Note, Parsed, diagnose
from coursebuild.patterns import pattern
from coursebuild.source import Excerpt, Span
from coursebuild.syntax.escapes import odd_character
from coursebuild.syntax.json_string import read_string
from coursebuild.syntax.nodes import (
    ArrayNode,
    BoolNode,
    BrokenNode,
    Member,
    Node,
    NullNode,
    NumberNode,
    ObjectNode,
    StringNode,
)
from coursebuild.syntax.wording import short

MAX_DEPTH = 64
"""How deep objects and arrays may nest: far more than a person writes, far less than the
interpreter's stack."""

_SPACE = pattern(r"[ \t\n\r]*")
_NUMBER = pattern(r"-?(?:0|[1-9][0-9]*)(\.[0-9]+)?([eE][+-]?[0-9]+)?(?![\w.+-])")
_PLAIN_KEY = pattern(r'"([^"\\\x00-\x1f\ud800-\udfff]*)"[ \t\n\r]*:[ \t\n\r]*(?=["{\[\-0-9tfn])')
"""A key with its colon, in which nothing is unusual; a value follows."""
_PLAIN_NEXT = pattern(r'[ \t\n\r]*(?:,[ \t\n\r]*(?=["{\[\-0-9tfn])|([\]}]))')
"""What stands between two values or after the last one, where nothing is unusual."""
_NUMBER_LIKE = pattern(r"[-+.\w]+")
_WORD = pattern(r"[^\W\d][\w$]*")
_KEY = pattern(r'"(?:[^"\\\n]|\\.)*"[ \t\n\r]*:')
_COMMENT = pattern(r"//[^\n]*|#[^\n]*|/\*.*?(?:\*/|\Z)", re.DOTALL)
_CURLY = "“”„‟‘’‚‛«»"
_WORDS = {"True": "true", "TRUE": "true", "False": "false", "FALSE": "false"}
_WORDS |= dict.fromkeys(("None", "NULL", "Null", "nil", "undefined"), "null")
_NOT_FINITE = frozenset(("NaN", "nan", "Infinity", "inf", "Inf"))


def parse_json(body: Excerpt, place: Span) -> Parsed[Node | None]:
    """The value that `body` holds; `place` is what to point at when it holds none. Never raises.

    The value can be there along with diagnostics; a caller that finds any must not publish it.
    """
    reader = _Reader(body)
    try:
        value = reader.document(place)
    except _LostError:
        value = None
    return Parsed(value, tuple(reader.faults))


class _LostError(Exception):
    """The rest of the text cannot be understood; what is wrong has been reported."""


class _Reader(Struct):
    body: Excerpt
    faults: list[Diagnostic] = field(default_factory=list)

    def fault(
        self,
        start: int,
        end: int,
        message: str,
        help: str = "",
        *,
        rule: str = "json-syntax",
        notes: tuple[Note, ...] = (),
    ) -> None:
        span = self.body.span(start, max(start, end))
        self.faults.append(diagnose(rule, span, message, help=help, notes=notes))

    def document(self, place: Span) -> Node:
        at = self.skip(0)
        text = self.body.text
        if at >= len(text):
            help = 'write `{"field": value, …}`'
            self.faults.append(
                diagnose(
                    "json-syntax", place, "the block is empty: a JSON object is expected", help=help
                )
            )
            raise _LostError
        value = self.value(at, 0)
        at = self.skip(value.end)
        if at < len(text):
            stop = text.find("\n", at)
            end = len(text) if stop < 0 else stop
            if text[at] in "]}":
                self.fault(at, at + 1, f"`{text[at]}` closes nothing")
            else:
                self.fault(at, end, "text after the end of the JSON value")
        return value

    def skip(self, at: int) -> int:
        """The next place that is neither white space nor a mistaken comment or space."""
        text = self.body.text
        while True:
            at = _SPACE.match(text, at).end()  # type: ignore[union-attr]  # it matches nothing too
            char = text[at : at + 1]
            if not char or char in '",:{}[]-0123456789tfn':
                return at
            comment = _COMMENT.match(text, at)
            if comment:
                first_line = comment[0].split("\n", 1)[0]
                self.fault(at, at + len(first_line), "JSON has no comments", "remove it")
                at = comment.end()
            elif odd := odd_character(char):
                help = "replace it by a plain space, or remove it"
                self.fault(at, at + 1, f"{odd} is not white space in JSON", help)
                at += 1
            else:
                return at

    def value(self, at: int, depth: int) -> Node:
        text = self.body.text
        char = text[at : at + 1]
        if char == '"':
            return self.string(at)
        if char in ("{", "["):
            if depth == MAX_DEPTH:
                self.fault(at, at + 1, f"objects and arrays nest more than {MAX_DEPTH} deep")
                raise _LostError
            return self.object(at, depth) if char == "{" else self.array(at, depth)
        number = _NUMBER.match(text, at)
        if number:
            return self.number(number)
        word = _WORD.match(text, at)
        if word:
            return self.word(word)
        if char and char in "+-.0123456789":
            return self.malformed_number(at)
        self.expected("a value", at)

    def object(self, at: int, depth: int) -> ObjectNode:
        text = self.body.text
        members: list[Member] = []
        known: dict[str, StringNode] = {}
        here = self.skip(at + 1)
        done = text[here : here + 1] == "}"
        while not done:
            key, place = self.key(here, at)
            first = known.setdefault(key.value, key)
            if first is not key:
                notes = (Note("the first one is here", first.span),)
                message = f"`{short(key.value)}` is given twice"
                self.fault(key.start, key.end, message, rule="field-repeated", notes=notes)
            value = self.value(self.colon(key) if place is None else place, depth + 1)
            members.append(Member(key, value))
            here, done = self.separator(value.end, at, "}")
        return ObjectNode(self.body, at, here + 1, at, at + 1, tuple(members))

    def key(self, here: int, opened: int) -> tuple[StringNode, int | None]:
        """The key at a place, and the place of its value where nothing is unusual before that."""
        text = self.body.text
        plain = _PLAIN_KEY.match(text, here)
        if plain is not None:
            node = StringNode(self.body, here, plain.end(1) + 1, plain[1], ((0, here + 1),))
            return node, plain.end()
        if text[here : here + 1] != '"':
            self.expected("a key in double quotes", here, opened=opened)
        return self.string(here), None

    def array(self, at: int, depth: int) -> ArrayNode:
        items: list[Node] = []
        here = self.skip(at + 1)
        done = self.body.text[here : here + 1] == "]"
        while not done:
            if here >= len(self.body.text):
                self.unclosed(at)
            item = self.value(here, depth + 1)
            items.append(item)
            here, done = self.separator(item.end, at, "]")
        return ArrayNode(self.body, at, here + 1, at + 1, tuple(items))

    def colon(self, key: StringNode) -> int:
        """The place of the value that belongs to a key."""
        text = self.body.text
        here = self.skip(key.end)
        if text[here : here + 1] == ":":
            return self.skip(here + 1)
        if text[here : here + 1] == "=":
            self.fault(here, here + 1, "`=` where JSON has `:`", "write `:`")
            return self.skip(here + 1)
        self.expected(f"`:` after the key `{short(key.value)}`", here)

    def separator(self, end: int, opened: int, closer: str) -> tuple[int, bool]:
        """After a value: the place of the next one, or that of the closing bracket and `True`."""
        text = self.body.text
        plain = _PLAIN_NEXT.match(text, end)
        if plain is not None and (plain[1] is None or plain[1] == closer):
            return (plain.end(), False) if plain[1] is None else (plain.start(1), True)
        here = self.skip(end)
        char = text[here : here + 1]
        if char == closer:
            return here, True
        if char == ",":
            comma = here
            here = self.skip(here + 1)
            while text[here : here + 1] == ",":
                self.fault(here, here + 1, "two commas with no value between them", "remove one")
                here = self.skip(here + 1)
            if text[here : here + 1] == closer:
                self.fault(comma, comma + 1, f"a comma before `{closer}`", "remove the comma")
                return here, True
            return here, False
        if _KEY.match(text, here) if closer == "}" else char and char in '"{[-0123456789':
            self.fault(end, end, "a comma is missing here", "put `,` between the two values")
            return here, False
        self.expected(f"`,` or `{closer}`", here, opened=opened)

    def string(self, at: int) -> StringNode:
        node = read_string(self.body, at, self.faults)
        if node is None:
            raise _LostError
        return node

    def number(self, match: re.Match[str]) -> Node:
        start, end = match.span()
        if match[1] or match[2]:
            return NumberNode(self.body, start, end, float(match[0]))
        try:
            return NumberNode(self.body, start, end, int(match[0]))
        except ValueError:  # the interpreter converts no more than some thousand digits
            self.fault(start, end, f"a number of {end - start} digits is too long")
            return BrokenNode(self.body, start, end)

    def malformed_number(self, at: int) -> Node:
        match = _NUMBER_LIKE.match(self.body.text, at)
        end = match.end() if match else at + 1
        written = self.body.text[at:end]
        if written.lstrip("+-") in _NOT_FINITE:
            self.fault(at, end, f"JSON has no `{short(written)}`", "write a finite number")
        else:
            self.fault(
                at, end, f"`{short(written)}` is not a number of JSON", _number_help(written)
            )
        return BrokenNode(self.body, at, end)

    def word(self, match: re.Match[str]) -> Node:
        start, end = match.span()
        word = match[0]
        if word in ("true", "false"):
            return BoolNode(self.body, start, end, word == "true")
        if word == "null":
            return NullNode(self.body, start, end)
        if word in _WORDS:
            self.fault(start, end, f"`{word}` is not JSON", f"write `{_WORDS[word]}`")
            return BrokenNode(self.body, start, end)
        if word in _NOT_FINITE:
            self.fault(start, end, f"JSON has no `{word}`", "write a finite number")
            return BrokenNode(self.body, start, end)
        self.expected("a value", start)

    def unclosed(self, opened: int) -> NoReturn:
        self.fault(opened, opened + 1, f"`{self.body.text[opened]}` is never closed")
        raise _LostError

    def expected(self, what: str, at: int, *, opened: int | None = None) -> NoReturn:
        """Report what stands at `at` in the place of something else; never returns."""
        text = self.body.text
        if at >= len(text):
            if opened is not None:
                self.unclosed(opened)
            last = len(text.rstrip())
            self.fault(max(last - 1, 0), last, f"the JSON ends where {what} is expected")
            raise _LostError
        word = _WORD.match(text, at)
        end = word.end() if word else at + 1
        notes: tuple[Note, ...] = ()
        if opened is not None and text[at] in "]}":
            notes = (Note(f"`{text[opened]}` is opened here", self.body.span(opened, opened + 1)),)
        found = "a string" if text[at] == '"' else f"`{short(text[at:end])}`"
        self.fault(at, end, f"expected {what}, found {found}", _help(text, at, what), notes=notes)
        raise _LostError


def _help(text: str, at: int, what: str) -> str:
    char = text[at]
    if char in _CURLY:
        return 'JSON knows only the straight quote `"`; replace the curly ones of this block'
    if char == "'":
        return 'JSON strings stand between double quotes: `"…"`'
    if char == "`":
        return 'JSON strings stand between double quotes: `"…"`'
    if char == ";":
        return "JSON separates values by `,`"
    if char == "(":
        return "a list stands between `[` and `]`"
    if what.startswith("`,`") and (char.isalnum() or char == "\\"):
        return 'a double quote inside a string is written `\\"`'
    if what == "a key in double quotes" and (char.isalpha() or char == "_"):
        return f'write `"{short(_WORD.match(text, at)[0])}"`'  # type: ignore[index]  # a letter is a word
    if what == "a value" and (char.isalpha() or char == "_"):
        return "text stands between double quotes"
    return ""


def _number_help(written: str) -> str:
    """How a malformed number is written in JSON, where that is clear."""
    if "_" in written and written.replace("_", "").isdigit():
        return f"write `{written.replace('_', '')}`"
    if re.fullmatch(r"[-+]?0[xXoObB]\w+", written):
        return "JSON has decimal numbers only"
    plain = re.fullmatch(r"([-+]?)([0-9]*)(?:\.([0-9]*))?([eE][+-]?[0-9]+)?", written)
    if plain is None or not (plain[2] or plain[3]):
        return ""
    sign = "-" if plain[1] == "-" else ""
    fraction = f".{plain[3]}" if plain[3] else ""
    return f"write `{short(sign + (plain[2].lstrip('0') or '0') + fraction + (plain[4] or ''))}`"
