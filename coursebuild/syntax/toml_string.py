r"""One TOML string of any of the four kinds: its value, and where each character of it stands.

Entry point: `read_string(body, at, faults, multiline=…)`.
"""

from __future__ import annotations

import re

from coursebuild.diagnostics import Diagnostic, diagnose
from coursebuild.source import Excerpt
from coursebuild.syntax.escapes import tex_escapes, tex_word
from coursebuild.syntax.nodes import StringNode
from coursebuild.syntax.toml_fault import FaultError

_PLAIN = re.compile(r'[^"\\\n]*')
_PLAIN_LINES = re.compile(r'[^"\\]*(?:"(?!"")[^"\\]*)*')
_LINE_END = re.compile(r"\\[ \t]*\n[ \t\n]*")
_CODE = re.compile(r"\\(?:u[0-9A-Fa-f]{4}|U[0-9A-Fa-f]{8}|x[0-9A-Fa-f]{2})")
_ESCAPES = {
    "b": "\b",
    "t": "\t",
    "n": "\n",
    "f": "\f",
    "r": "\r",
    "e": "\x1b",
    '"': '"',
    "\\": "\\",
}


def read_string(body: Excerpt, at: int, faults: list[Diagnostic], *, multiline: bool) -> StringNode:
    """The string whose opening quote stands at `at`.

    A backslash that was surely meant for TeX is added to `faults`. Raises `FaultError` for a string
    that is not closed or has an escape that TOML does not know.
    """
    text = body.text
    quote = text[at]
    long = multiline and text.startswith(quote * 3, at)
    if quote == "'":
        return _literal(body, at, long)
    plain = None if long else _PLAIN.match(text, at + 1)
    if plain is not None and text.startswith('"', plain.end()):  # as nearly all are
        return StringNode(body, at, plain.end() + 1, plain[0], ((0, at + 1),))
    return _Basic(body, at, long, faults).read()


def _opening(text: str, at: int, long: bool) -> int:
    """Where the content begins: a line end right after three quotes is none of it."""
    start = at + (3 if long else 1)
    return start + 1 if long and text.startswith("\n", start) else start


def _closing(text: str, at: int, quote: str) -> int:
    """The end of a long string that closes at `at`: two more quotes may belong to it."""
    end = at + 3
    while end < at + 5 and text.startswith(quote, end):
        end += 1
    return end


def _unclosed(text: str, at: int, long: bool) -> FaultError:
    stop = text.find("\n", at)
    end = len(text) if stop < 0 else stop
    if long:
        return FaultError(at, at + 3, f"`{text[at : at + 3]}` is never closed")
    help = f"close it with `{text[at]}`; text of several lines stands between three quotes"
    return FaultError(at, end, "the string is not closed on its line", help)


def _literal(body: Excerpt, at: int, long: bool) -> StringNode:
    text = body.text
    start = _opening(text, at, long)
    stop = text.find("'''" if long else "'", start)
    if stop < 0 or (not long and "\n" in text[start:stop]):
        raise _unclosed(text, at, long)
    end = _closing(text, stop, "'") if long else stop + 1
    stop = end - (3 if long else 1)
    return StringNode(body, at, end, text[start:stop], ((0, start),))


class _Basic:
    """A string in double quotes, where a backslash begins an escape."""

    def __init__(self, body: Excerpt, at: int, long: bool, faults: list[Diagnostic]) -> None:
        self.body = body
        self.text = body.text
        self.opened = at
        self.long = long
        self.faults = faults
        self.parts: list[str] = []
        self.length = 0
        self.runs: list[tuple[int, int]] = []
        self.controls: list[tuple[int, str]] = []

    def read(self) -> StringNode:
        start = here = _opening(self.text, self.opened, self.long)
        plain = _PLAIN_LINES if self.long else _PLAIN
        while True:
            match = plain.match(self.text, here)
            stop = match.end() if match else here
            char = self.text[stop : stop + 1]
            if char == '"':
                end = _closing(self.text, stop, '"') if self.long else stop + 1
                self._add(self.text[here : end - (3 if self.long else 1)], here)
                return self._finish(start, end)
            if char != "\\":
                raise _unclosed(self.text, self.opened, self.long)
            self._add(self.text[here:stop], here)
            here = self._escape(stop)

    def _add(self, part: str, place: int) -> None:
        if part:
            self.runs.append((self.length, place))
            self.parts.append(part)
            self.length += len(part)

    def _escape(self, at: int) -> int:
        line_end = _LINE_END.match(self.text, at) if self.long else None
        if line_end is not None:
            return line_end.end()
        letter = self.text[at + 1 : at + 2]
        if letter and letter in _ESCAPES:
            if letter in "bfnrt":
                self.controls.append((self.length, letter))
            self._add(_ESCAPES[letter], at)
            return at + 2
        code = _CODE.match(self.text, at)
        number = int(code[0][2:], 16) if code is not None else -1
        if code is None or 0xD800 <= number < 0xE000 or number > 0x10FFFF:
            raise self._bad_escape(at, code)
        self._add(chr(number), at)
        return code.end()

    def _bad_escape(self, at: int, code: re.Match[str] | None) -> FaultError:
        if code is not None:
            return FaultError(
                at, code.end(), f"`{code[0]}` is no character", "write the character itself"
            )
        word = tex_word(self.text, at + 1)
        end = at + (1 if self.text[at + 1 : at + 2] in ("", "\n") else 2)
        return FaultError(at, end, f"`{self.text[at:end]}` is not an escape of TOML", _double(word))

    def _finish(self, start: int, end: int) -> StringNode:
        value = "".join(self.parts)
        node = StringNode(self.body, self.opened, end, value, tuple(self.runs) or ((0, start),))
        places = dict(self.runs)  # an escape is a run of its own
        for at, command in tex_escapes(value, self.controls):
            span = self.body.span(places[at], places[at] + 1 + len(command))
            message = f"`\\{command[0]}` of `\\{command}` is read as a control character"
            self.faults.append(diagnose("field-value", span, message, help=_double(command)))
        return node


def _double(command: str) -> str:
    return f"double the backslash: `\\\\{command}`, or put the text between single quotes"
