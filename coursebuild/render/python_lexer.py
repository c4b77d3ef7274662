"""Pygments' Python lexer, with most of a text taken in long strides.

Entry point: `FastPythonLexer`.

Pygments tries its rules one by one at each token, some sixty for a name. The colours of a page do
not tell names, operators and white space apart, so a stretch of them is one token here, found by
one regular expression, as are keywords, numbers, comments and plain strings. All else (definitions,
imports, decorators, strings with something in them, the first thing on a line where it may be a
docstring) is left to Pygments' rules, so that what comes out differs from what Pygments gives only
in the kinds that `highlight` does not show.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeAlias

from pygments.lexer import RegexLexerMeta
from pygments.lexers.python import PythonLexer
from pygments.regexopt import regex_opt
from pygments.token import Comment, Keyword, Number, String, Text, _TokenType

_BEGIN_MORE = {"async", "class", "def", "from", "import", "yield"}
"""Keywords that Pygments takes together with what follows, or by which it changes its rules."""
_AT_LINE_START = {"case", "lazy", "match"}
"""Keywords only there."""


def _one_of(words: Iterable[str]) -> str:
    return str(regex_opt(tuple(words), suffix=r"\b"))


_KEYWORD = _one_of(set(keyword.kwlist) - _BEGIN_MORE)
_NUMBER = "|".join(f"(?:{rule[0]})" for rule in PythonLexer.tokens["numbers"])
_NAME = (
    rf"(?!__(?!(?:name|file)__\b)|{_one_of({*keyword.kwlist, *_AT_LINE_START})})"
    r"""[A-Za-z_][A-Za-z0-9_]*+(?!["']|[^\x00-\x7f])"""
)
_INDENTATION = r"""[ \t]*+(?![rRuUbB]{0,2}["']|(?:case|lazy|match)\b|\s)"""
"""With nothing after it for which the start of a line matters."""
_STRIDE = re.compile(
    rf"(?P<keyword>{_KEYWORD})"
    r"|(?P<comment>\#[^\n]*)"
    rf"|(?P<number>{_NUMBER})"
    r"""|(?P<string>"(?!"")[^"\\\n%{]*"|'(?!'')[^'\\\n%{]*')"""
    rf"|(?P<plain>(?:^{_INDENTATION}|(?!^))"
    rf"(?:{_NAME}|[ \t]++|[-+*/%=<>&^|~,:;()\[\]{{}}]|\.(?!\d)|\n(?=\n)|\n{_INDENTATION})*)",
    re.MULTILINE,
)
_INSIDE = re.compile(rf"(?:{_NAME}|\.(?!\d))+")
"""Names in the braces of an f-string."""
_SIMPLE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*+(?![^\x00-\x7f])")
"""A name without foreign letters."""
_FIRST = re.compile(r"[A-Za-z_]|[^\x00-\x7f]")
"""What a name may begin with."""
_Match: TypeAlias = Callable[[str, int], re.Match[str] | None]
"""How Pygments looks for what a rule is about."""
_KINDS: dict[str | None, _TokenType] = {
    "keyword": Keyword,
    "comment": Comment,
    "number": Number,
    "string": String,
    "plain": Text,
    None: Text,
}
_BRACES = {"expr-inside-fstring", "expr-inside-fstring-inner"}


class FastPythonLexer(PythonLexer):  # type: ignore[misc]  # its module has no types
    """Gives the same text in tokens of the same colours as `PythonLexer`, but fewer of them."""

    @classmethod
    def _process_regex(cls, regex: Any, flags: int, state: str) -> _Match:
        """Compile a rule when it is first tried: most never are, and all take a while."""
        compiled: _Match | None = None

        def match(text: str, at: int) -> re.Match[str] | None:
            nonlocal compiled
            if compiled is None:
                compiled = RegexLexerMeta._process_regex(cls, regex, flags, state)
            return compiled(text, at)

        return _simple_first(match) if regex == PythonLexer.uni_name else match

    def get_tokens_unprocessed(
        self, text: str, stack: Iterable[str] = ("root",)
    ) -> Iterator[tuple[int, _TokenType, str]]:
        """The tokens of a text, each with its offset."""
        states, at, end = list(stack), 0, len(text)
        while at < end:
            found = _stride(states[-1], text, at)
            if found is not None and found.end() > at:
                yield at, _KINDS[found.lastgroup], found[0]
                at = found.end()
                continue
            rule = _first(self._tokens[states[-1]], text, at)
            if rule is None:  # Pygments begins anew on the next line
                if text[at] == "\n":
                    states = ["root"]
                yield at, Text, text[at]
                at += 1
                continue
            found, action, change = rule
            if type(action) is _TokenType:
                yield at, action, found[0]
            elif action is not None:
                yield from action(self, found)
            at = found.end()
            if change is not None:
                _change(states, change)


def _simple_first(match: _Match) -> _Match:
    """Pygments' rule of names; those without foreign letters are found without it."""

    def simple(text: str, at: int) -> re.Match[str] | None:
        found = _SIMPLE.match(text, at)
        return found if found is not None or not _FIRST.match(text, at) else match(text, at)

    return simple


def _stride(state: str, text: str, at: int) -> re.Match[str] | None:
    if state == "root":
        return _STRIDE.match(text, at)
    return _INSIDE.match(text, at) if state in _BRACES else None


_Rule: TypeAlias = tuple[_Match, Any, Any]
"""How Pygments looks for it; what it makes of it; the states that it enters or leaves then."""


def _first(rules: list[_Rule], text: str, at: int) -> tuple[re.Match[str], Any, Any] | None:
    """The first of Pygments' rules that is met here."""
    for match, action, change in rules:
        found = match(text, at)
        if found is not None:
            return found, action, change
    return None


def _change(states: list[str], change: int | str | tuple[str, ...]) -> None:
    """Enter and leave states, as a rule says; one stays in any case."""
    if isinstance(change, int):
        del states[max(len(states) + change, 1) :]
    elif change == "#push":
        states.append(states[-1])
    else:
        for state in change:
            if state == "#pop":
                if len(states) > 1:
                    states.pop()
            else:
                states.append(states[-1] if state == "#push" else state)
