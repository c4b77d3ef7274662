"""Code in runs by Pygments, which reads most languages; it is imported when a page has some."""

from __future__ import annotations

import functools

from pygments.lexer import Lexer
from pygments.lexers import find_lexer_class_by_name
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
"""Kinds of tokens and their classes, the special before the general."""
_ALIASES = {"mjcf": "xml", "urdf": "xml"}


def pygments_runs(language: str, code: str) -> list[tuple[str, str]]:
    """The code in runs, each with its class, perhaps an empty one; none without a lexer for it."""
    if (lexer := _lexer(_ALIASES.get(language, language))) is None:
        return []
    for end in ("", "\n"):  # lexers of sessions need a line end
        runs = [(_class_of(token), part) for token, part in lexer.get_tokens(code + end)]
        if "".join(part for _, part in runs) == code + end:  # else nothing is marked
            if end:
                css, part = runs.pop()
                runs.append((css, part.removesuffix(end)))
            return runs
    return []


@functools.cache
def _lexer(language: str) -> Lexer | None:
    try:
        return find_lexer_class_by_name(language)(stripnl=False, ensurenl=False)
    except ClassNotFound:
        return None


@functools.cache
def _class_of(token: _TokenType) -> str:
    return next((css for kind, css in _CLASSES if token in kind), "")
