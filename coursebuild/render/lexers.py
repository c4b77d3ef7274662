"""Pygments: the tokens of a text in any language but Python, folded into a page's few classes.

Entry points: `runs(language, code)`, `class_of`.
"""

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
"""Kinds of token and their class, the special before the general."""


def runs(language: str, code: str) -> list[tuple[str, str]] | None:
    """Runs of a text, each with its class; `None` where no lexer knows the language.

    A lexer that leaves anything out marks nothing.
    """
    lexer = _lexer(language)
    if lexer is None:
        return None
    # Those of sessions see lines that end only.
    for end in ("", "\n"):
        found = [(class_of(token), text) for token, text in lexer.get_tokens(code + end)]
        if "".join(text for _, text in found) == code + end:
            break
    else:
        return [("", code)]
    if end:
        css, text = found.pop()
        found.append((css, text.removesuffix(end)))
    return found


@functools.cache
def class_of(token: _TokenType) -> str:
    """The class of a kind of token; empty where it belongs to none."""
    return next((css for kind, css in _CLASSES if token in kind), "")


@functools.cache
def _lexer(language: str) -> Lexer | None:
    try:
        return find_lexer_class_by_name(language)(stripnl=False, ensurenl=False)
    except ClassNotFound:
        return None
