"""Code as HTML: tokens in a handful of classes, and no character that HTML forbids.

Entry points: `highlight(language, code)`, `highlight_lines`.

1. Pygments tells tokens apart far finer than a page should show; they are folded into the few kinds
   of `_CLASSES`, and what belongs to none gets no element at all.
2. Characters that HTML forbids (control characters, non-characters) are shown as the symbols that
   stand for them.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from html import escape

from markupsafe import Markup
from pygments.lexer import Lexer
from pygments.lexers import find_lexer_class_by_name
from pygments.token import Comment, Keyword, Literal, Name, Operator, String, Token, _TokenType
from pygments.util import ClassNotFound

from coursebuild.render.characters import visible as visible

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


def highlight(language: str, code: str) -> Markup:
    """The code with its tokens marked; plain escaped text where no lexer knows the language."""
    return Markup("\n".join(highlight_lines(language, code)))


@functools.lru_cache(maxsize=256)
def highlight_lines(language: str, code: str) -> tuple[Markup, ...]:
    """The code's lines, each marked by itself: no element reaches over the end of a line."""
    lexer = _lexer(_ALIASES.get(language.lower(), language.lower()))
    if lexer is None:
        return tuple(Markup(escape(line, quote=False)) for line in visible(code).split("\n"))
    lines: list[str] = []
    line: list[str] = []
    css, run = "", ""
    for token, text in _tokens(lexer, visible(code)):
        kind = _class_of(token)
        first, *others = text.split("\n") if "\n" in text else (text,)
        if kind == css or (run and (not first or first.isspace())):
            run += first
        else:
            line.append(_span(css, run))
            css, run = kind, first
        for part in others:
            line.append(_span(css, run))
            lines.append("".join(line))
            line = []
            css, run = kind, part
    line.append(_span(css, run))
    lines.append("".join(line))
    return tuple(map(Markup, lines))


def _tokens(lexer: Lexer, code: str) -> Iterator[tuple[_TokenType, str]]:
    """The lexer's tokens; a byte order mark at the start, which it drops, stays.

    A lexer that leaves anything else out marks nothing.
    """
    if code.startswith("\ufeff"):
        yield Token.Text, "\ufeff"
        code = code[1:]
    # Those of sessions see lines that end only.
    for end in ("", "\n"):
        found = list(lexer.get_tokens(code + end))
        if "".join(text for _, text in found) == code + end:
            break
    else:
        found, end = [(Token.Text, code)], ""
    if end:
        token, text = found.pop()
        found.append((token, text.removesuffix(end)))
    yield from found


def _span(css: str, text: str) -> str:
    """A run of tokens of one class; white space around it stays outside the element."""
    html = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    if not css or not (core := html.strip()):
        return html
    if core == html:
        return f'<span class="{css}">{html}</span>'
    before, _, after = html.partition(core)
    return f'{before}<span class="{css}">{core}</span>{after}'


@functools.cache
def _class_of(token: _TokenType) -> str:
    return next((css for kind, css in _CLASSES if token in kind), "")


@functools.cache
def _lexer(language: str) -> Lexer | None:
    if not language:
        return None
    try:
        found = find_lexer_class_by_name(language)
    except ClassNotFound:
        return None
    if found.name == "Python":
        from coursebuild.render.python_lexer import FastPythonLexer

        found = FastPythonLexer
    return found(stripnl=False, ensurenl=False)
