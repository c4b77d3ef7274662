"""Code as HTML: tokens in a handful of classes, and no character that HTML forbids.

Entry points: `highlight(language, code)`, `highlight_lines`, `visible(text)`.

1. Pygments tells tokens apart far finer than a page should show; they are folded into the few kinds
   of `_CLASSES`, and what belongs to none gets no element at all.
2. Characters that HTML forbids (control characters, non-characters) are shown as the symbols that
   stand for them.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from html import escape

from markupsafe import Markup
from pygments.lexer import Lexer
from pygments.lexers import get_lexer_by_name
from pygments.token import Comment, Keyword, Literal, Name, Operator, String, Token, _TokenType
from pygments.util import ClassNotFound

_CLASSES: tuple[tuple[_TokenType, str], ...] = (
    (Comment, "c"),
    (String.Doc, "d"),
    (String.Interpol, "i"),
    (String, "s"),
    (Literal.Number, "n"),
    (Keyword, "k"),
    (Operator.Word, "k"),
    (Name.Function, "f"),
    (Name.Class, "f"),
    (Name.Decorator, "a"),
    (Name.Attribute, "a"),
    (Name.Tag, "t"),
    (Token.Generic.Prompt, "p"),
    (Token.Generic.Deleted, "x"),
    (Token.Generic.Inserted, "y"),
)
"""Kinds of token and their class, the special before the general."""

_ALIASES = {"mjcf": "xml", "urdf": "xml"}

_FORBIDDEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ufdd0-\ufdef\ufffe\uffff\ud800-\udfff]")
_ASTRAL_NONCHARACTER = re.compile(
    "["
    + "".join(chr(p + 0xFFFE) + chr(p + 0xFFFF) for p in range(1 << 16, 17 << 16, 1 << 16))
    + "]"
)


def visible(text: str) -> str:
    """The text with what HTML forbids replaced: a control by its picture, the rest by U+FFFD."""
    return _ASTRAL_NONCHARACTER.sub("\ufffd", _FORBIDDEN.sub(_picture, text))


def _picture(match: re.Match[str]) -> str:
    code = ord(match[0])
    if code < 0x20:
        return chr(0x2400 + code)
    return "\u2421" if code == 0x7F else "\ufffd"


def highlight(language: str, code: str) -> Markup:
    """The code with its tokens marked; plain escaped text where no lexer knows the language."""
    return Markup("\n").join(highlight_lines(language, code))


@functools.lru_cache(maxsize=4096)
def highlight_lines(language: str, code: str) -> tuple[Markup, ...]:
    """The code's lines, each marked by itself: no element reaches over the end of a line."""
    lexer = _lexer(_ALIASES.get(language.lower(), language.lower()))
    if lexer is None:
        return tuple(Markup(escape(line, quote=False)) for line in visible(code).split("\n"))
    lines: list[list[tuple[str, str]]] = [[]]
    for token, text in _tokens(lexer, visible(code)):
        css = _class_of(token)
        for number, part in enumerate(text.split("\n")):
            if number:
                lines.append([])
            line = lines[-1]
            if line and (line[-1][0] == css or not part.strip()):
                line[-1] = (line[-1][0], line[-1][1] + part)
            else:
                line.append((css, part))
    return tuple(Markup("".join(_span(css, text) for css, text in line)) for line in lines)


def _tokens(lexer: Lexer, code: str) -> Iterator[tuple[_TokenType, str]]:
    """The lexer's tokens; a byte order mark at the start, which it drops, stays."""
    if code.startswith("\ufeff"):
        yield Token.Text, "\ufeff"
        code = code[1:]
    yield from lexer.get_tokens(code)


def _span(css: str, text: str) -> str:
    """A run of tokens of one class; white space around it stays outside the element."""
    core = text.strip()
    if not css or not core:
        return escape(text, quote=False)
    before, _, after = text.partition(core)
    return f'{before}<span class="{css}">{escape(core, quote=False)}</span>{after}'


@functools.cache
def _class_of(token: _TokenType) -> str:
    return next((css for kind, css in _CLASSES if token in kind), "")


@functools.cache
def _lexer(language: str) -> Lexer | None:
    if not language:
        return None
    try:
        return get_lexer_by_name(language, stripnl=False, ensurenl=False)
    except ClassNotFound:
        return None
