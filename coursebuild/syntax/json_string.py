r"""One JSON string: its value, and where each character of it stands.

Entry point: `read_string(body, at, faults)`.

Escapes that JSON does not have, control characters and halves of surrogate pairs are reported, each
at its place, and reading goes on; a string that is not closed on its line ends the reading, since
nobody can say where it was meant to end.
"""

from __future__ import annotations

from coursebuild.diagnostics import Diagnostic, diagnose
from coursebuild.patterns import pattern
from coursebuild.source import Excerpt
from coursebuild.syntax.escapes import tex_escapes, tex_word
from coursebuild.syntax.nodes import StringNode

_PLAIN = pattern(r'[^"\\\x00-\x1f\ud800-\udfff]*')
_HEX = pattern(r"[0-9A-Fa-f]{4}")
_ESCAPES = {'"': '"', "\\": "\\", "/": "/", "b": "\b", "f": "\f", "n": "\n", "r": "\r", "t": "\t"}


def read_string(body: Excerpt, at: int, faults: list[Diagnostic]) -> StringNode | None:
    """The string whose opening quote stands at `at`; `None` when it is not closed.

    Mistakes are added to `faults`.
    """
    text = body.text
    end = _plain_end(text, at + 1)
    if text[end : end + 1] == '"':
        return StringNode(body, at, end + 1, text[at + 1 : end], ((0, at + 1),))
    return _StringReader(body, at, faults).read()


def _plain_end(text: str, at: int) -> int:
    match = _PLAIN.match(text, at)
    return match.end() if match else at


class _StringReader:
    """Reads a string that has something in it besides plain characters."""

    def __init__(self, body: Excerpt, at: int, faults: list[Diagnostic]) -> None:
        self.body = body
        self.text = body.text
        self.opened = at
        self.faults = faults
        self.parts: list[str] = []
        self.length = 0
        self.runs: list[tuple[int, int]] = []
        self.controls: list[tuple[int, str]] = []

    def read(self) -> StringNode | None:
        here = self.opened + 1
        while True:
            end = _plain_end(self.text, here)
            self._add(self.text[here:end], here)
            char = self.text[end : end + 1]
            if char == '"':
                return self._finish(end + 1)
            if char in ("", "\n"):
                self._unclosed(end)
                return None
            here = self._escape(end) if char == "\\" else self._control(end)

    def _add(self, part: str, place: int) -> None:
        if part:
            self.runs.append((self.length, place))
            self.parts.append(part)
            self.length += len(part)

    def _finish(self, end: int) -> StringNode:
        value = "".join(self.parts)
        runs = tuple(self.runs) or ((0, self.opened + 1),)
        node = StringNode(self.body, self.opened, end, value, runs)
        places = dict(runs)  # an escape is a run of its own
        for at, command in tex_escapes(value, self.controls):
            place = places[at]
            message = f"`\\{command[0]}` of `\\{command}` is read as a control character"
            self._fault("field-value", place, place + 1 + len(command), message, _double(command))
        return node

    def _escape(self, at: int) -> int:
        letter = self.text[at + 1 : at + 2]
        if letter in _ESCAPES and letter:
            if letter in "bfnrt":
                self.controls.append((self.length, letter))
            self._add(_ESCAPES[letter], at)
            return at + 2
        if letter == "u":
            return self._unicode(at)
        word = tex_word(self.text, at + 1)
        end = at + (2 if letter not in ("", "\n") else 1)
        help = _double(word) if word else "to write a backslash, double it: `\\\\`"
        self._fault("json-syntax", at, end, f"`{self.text[at:end]}` is not an escape of JSON", help)
        self._add("\\", at)
        return at + 1

    def _unicode(self, at: int) -> int:
        digits = _HEX.match(self.text, at + 2)
        if digits is None:
            word = tex_word(self.text, at + 1)
            help = _double(word) if len(word) > 1 else "write four hexadecimal digits after `\\u`"
            self._fault(
                "json-syntax", at, at + 2, "`\\u` is not followed by four hexadecimal digits", help
            )
            self._add("\\", at)
            return at + 1
        code = int(digits[0], 16)
        if 0xD800 <= code < 0xDC00 and self.text.startswith("\\u", at + 6):
            low = _HEX.match(self.text, at + 8)
            if low is not None and 0xDC00 <= int(low[0], 16) < 0xE000:
                self._add(chr(0x10000 + ((code - 0xD800) << 10) + int(low[0], 16) - 0xDC00), at)
                return at + 12
        if 0xD800 <= code < 0xE000:
            message = f"`{self.text[at : at + 6]}` is half of a character"
            self._fault("json-syntax", at, at + 6, message, "write the character itself")
            self._add("\ufffd", at)
        else:
            self._add(chr(code), at)
        return at + 6

    def _control(self, at: int) -> int:
        char = self.text[at]
        if 0xD800 <= ord(char) < 0xE000:
            message, help = (
                f"U+{ord(char):04X} is half of a character",
                "write the character itself",
            )
        elif char == "\t":
            message, help = "a tab inside a string", "write `\\t`, or a space"
        else:
            message = f"the control character U+{ord(char):04X} inside a string"
            help = f"write `\\u{ord(char):04x}`, or remove it"
        self._fault("json-syntax", at, at + 1, message, help)
        self._add(" ", at)
        return at + 1

    def _unclosed(self, end: int) -> None:
        help = 'close it with `"`; a line end inside a string is written `\\n`'
        last = len(self.text[self.opened : end].rstrip()) + self.opened
        self._fault("json-syntax", self.opened, last, "the string is not closed on its line", help)

    def _fault(self, rule: str, start: int, end: int, message: str, help: str) -> None:
        self.faults.append(diagnose(rule, self.body.span(start, end), message, help=help))


def _double(command: str) -> str:
    return f"to write a backslash, double it: `\\\\{command}`"
