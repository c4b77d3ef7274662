"""JavaScript as tokens, as far as the code of labs needs it.

Entry point: `tokenize(code)`.

What is not known here (regular expressions, `#`, letters outside ASCII in names) is refused by
`UntranslatableError` instead of being guessed at. A template is one token, with those of the
expressions in it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Literal, TypeAlias

from msgspec import Struct


class UntranslatableError(Exception):
    """JavaScript that has no counterpart in Python here; the text says what."""


Kind: TypeAlias = Literal["number", "string", "template", "name", "punctuator", "end"]


class Token(Struct, frozen=True):
    """A token; for a string `text` is what it holds, for all others how it is written."""

    kind: Kind
    text: str
    after_newline: bool
    """Whether a line ends between the token before and this one."""
    parts: tuple[str | tuple[Token, ...], ...] = ()
    """Of a template: its texts, and the tokens of each `${…}`, with one of kind `end` last."""


_SPACE = re.compile(
    r"[ \t\v\f\u00a0\ufeff\r\n\u2028\u2029]+|//[^\r\n\u2028\u2029]*|/\*.*?\*/", re.S
)
_NEWLINE = re.compile(r"[\r\n\u2028\u2029]")
_NUMBER = re.compile(
    r"0[xX][0-9a-fA-F_]+|0[oO][0-7_]+|0[bB][01_]+"
    r"|(?:(?:0|[1-9][0-9_]*)(?:\.[0-9_]*)?|\.[0-9][0-9_]*)(?:[eE][+-]?[0-9]+)?"
)
_NAME = re.compile(r"[A-Za-z_$][A-Za-z0-9_$]*")
_STRING = re.compile(r"'(?:\\.|[^'\\\r\n])*'|\"(?:\\.|[^\"\\\r\n])*\"")
_CHUNK = re.compile(r"(?:\\[^\r\n\u2028\u2029]|\$(?!\{)|[^\\`$])*+")
"""The text of a template, up to its end or to an expression."""
_DEEPEST = 20
_PUNCTUATOR = re.compile(
    r">>>=|\.\.\.|===|!==|\*\*=|<<=|>>=|>>>|&&=|\|\|=|\?\?=|=>|==|!=|<=|>=|&&|\|\||\?\?|\?\.|\+\+|--"
    r"|\+=|-=|\*=|/=|%=|&=|\|=|\^=|<<|>>|\*\*|[{}()\[\];,<>+\-*/%&|^!~?:=.]"
)
_ESCAPE = re.compile(r"\\(?:u\{([0-9a-fA-F]+)\}|u([0-9a-fA-F]{4})|x([0-9a-fA-F]{2})|(.))")
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f", "v": "\v", "0": "\0"}


def tokenize(code: str) -> tuple[Token, ...]:
    """The tokens of a piece of code, with one of kind `end` last.

    Raises:
        UntranslatableError: there is something that no token known here begins with.
    """
    return tuple(_tokens(code))


def _tokens(code: str) -> Iterator[Token]:
    at, newline = 0, False
    while at < len(code):
        if code[at] == "`":
            token, at = _template(code, at, newline, 0)
            yield token
            newline = False
            continue
        space = _SPACE.match(code, at)
        if space is not None:
            newline = newline or _NEWLINE.search(space.group()) is not None
            at = space.end()
            continue
        kind, text, at = _token(code, at)
        yield Token(kind, text, newline)
        newline = False
    yield Token("end", "", newline)


def _token(code: str, at: int) -> tuple[Kind, str, int]:
    if match := _STRING.match(code, at):
        return "string", _unescaped(match.group()[1:-1]), match.end()
    if match := _NUMBER.match(code, at):
        after = code[match.end() : match.end() + 1]
        if after.isalnum() or after in ("_", "$", "\\"):
            raise UntranslatableError(f"the number `{match.group()}{after}`")
        return "number", match.group(), match.end()
    if match := _NAME.match(code, at):
        if code[match.end() : match.end() + 1] == "\\":
            raise UntranslatableError("an escape in a name")
        return "name", match.group(), match.end()
    if match := _PUNCTUATOR.match(code, at):
        return "punctuator", match.group(), match.end()
    raise UntranslatableError(f"`{code[at]}`")


def _template(code: str, start: int, newline: bool, depth: int) -> tuple[Token, int]:
    """The template that begins at `start`, and where it ends."""
    if depth > _DEEPEST:
        raise UntranslatableError("code that is nested too deeply")
    parts: list[str | tuple[Token, ...]] = []
    at = start + 1
    while True:
        match = _CHUNK.match(code, at)
        assert match is not None  # it may be empty
        chunk = match.group().replace("\r\n", "\n").replace("\r", "\n")
        if chunk:
            parts.append(_unescaped(chunk))
        at = match.end()
        if code.startswith("`", at):
            return Token("template", code[start : at + 1], newline, tuple(parts)), at + 1
        if not code.startswith("${", at):
            raise UntranslatableError("a template with a line that goes on")
        inner, at = _inside(code, at + 2, depth)
        parts.append(inner)


def _inside(code: str, at: int, depth: int) -> tuple[tuple[Token, ...], int]:
    """The tokens up to the `}` that closes a `${`, and what comes after it."""
    found: list[Token] = []
    opened = 0
    while at < len(code):
        if space := _SPACE.match(code, at):
            at = space.end()
        elif code[at] == "`":
            token, at = _template(code, at, False, depth + 1)
            found.append(token)
        elif code[at] == "}" and opened == 0:
            return (*found, Token("end", "", False)), at + 1
        else:
            kind, text, at = _token(code, at)
            opened += (kind == "punctuator") * ((text == "{") - (text == "}"))
            found.append(Token(kind, text, False))
    raise UntranslatableError("code that ends too early")


def _unescaped(text: str) -> str:
    def one(match: re.Match[str]) -> str:
        point = match.group(1) or match.group(2) or match.group(3)
        if point is not None:
            number = int(point, 16)
            if 0xD800 <= number < 0xE000 or number > 0x10FFFF:
                raise UntranslatableError(f"the escape `{match.group()}`")
            return chr(number)
        letter = match.group(4)
        digit = text[match.end() : match.end() + 1].isdigit()
        if letter in "ux123456789" or (letter == "0" and digit):
            raise UntranslatableError(f"the escape `\\{letter}`")
        return _ESCAPED.get(letter, letter)

    return _ESCAPE.sub(one, text)
