"""Code as HTML: tokens in a handful of classes, and no character that HTML forbids.

Entry point: `highlight_lines(language, code)`.

1. tree-sitter reads Python, which most code of a course is, and takes an eighth of the time of
   Pygments, which reads the other languages. Pygments tells tokens apart far finer than a page
   should show; they are folded into few classes, and what belongs to none gets no element at all.
2. Characters that HTML forbids (control characters, non-characters) are shown as the symbols that
   stand for them.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Iterator
from html import escape
from itertools import chain
from typing import TypeAlias

from markupsafe import Markup
from pygments.lexer import Lexer
from pygments.lexers import find_lexer_class_by_name
from pygments.token import Comment, Keyword, Literal, Name, Operator, String, Token, _TokenType
from pygments.util import ClassNotFound

from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.highlight_python import python_runs

Run: TypeAlias = tuple[str, str]
"""A class, or nothing, and the text that has it."""

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
_PYTHON = ("python", "py", "python3", "py3")
_LONGEST = 20_000
"""Characters of Python that tree-sitter reads. An absurd text, such as of backslashes alone, takes
it time with the square of its length, and Pygments not; at this length that is a second."""
_ALIASES = {"mjcf": "xml", "urdf": "xml"}
_WITHOUT_OUTER_SPACE = re.compile(r"\S(?:.*\S)?")


def highlight_lines(language: str, code: str) -> tuple[Markup, ...]:
    """The code's lines, each marked by itself: no element reaches over the end of a line.

    Where no lexer knows the language, they are plain escaped text.
    """
    text = visible(code)
    # Lexers drop a byte order mark at the start.
    mark = "\ufeff" if text.startswith("\ufeff") else ""
    runs = _merge(chain([("", mark)], _runs(language.lower(), text.removeprefix(mark))))
    html = "".join(_element(css, escape(run, quote=False)) for css, run in runs)
    return tuple(map(Markup, html.split("\n")))


def _runs(language: str, code: str) -> Iterable[Run]:
    if language in _PYTHON and len(code) <= _LONGEST:
        return python_runs(code)
    lexer = _lexer(_ALIASES.get(language, language))
    return [("", code)] if lexer is None else _lexed(lexer, code)


@functools.cache
def _lexer(language: str) -> Lexer | None:
    try:
        return find_lexer_class_by_name(language)(stripnl=False, ensurenl=False)
    except ClassNotFound:
        return None


def _lexed(lexer: Lexer, code: str) -> list[Run]:
    """Runs of a text, each with its class. A lexer that leaves anything out marks nothing."""
    # Lexers of sessions only see lines that end.
    for end in ("", "\n"):
        found = [(_class_of(token), text) for token, text in lexer.get_tokens(code + end)]
        if "".join(text for _, text in found) == code + end:
            break
    else:
        return [("", code)]
    if end:
        css, text = found.pop()
        found.append((css, text.removesuffix(end)))
    return found


@functools.cache
def _class_of(token: _TokenType) -> str:
    """The class of a kind of token; empty where it belongs to none."""
    return next((css for kind, css in _CLASSES if token in kind), "")


def _merge(runs: Iterator[Run]) -> Iterator[Run]:
    """Neighbours of one class as one run, with the space between them on a line."""
    css, run = "", ""
    for kind, text in runs:
        if kind == css or not text or (text.isspace() and "\n" not in text):
            run += text
        else:
            yield css, run
            css, run = kind, text
    yield css, run


def _element(css: str, html: str) -> str:
    """An element on each line; white space around it stays outside."""
    if not css:
        return html
    return _WITHOUT_OUTER_SPACE.sub(rf'<span class="{css}">\g<0></span>', html)
