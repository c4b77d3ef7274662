"""Pygments' rules for Python, one at a time, for what `python_lexer` leaves to them.

Entry point: `by_rules`. To import them takes longer than to mark a script, so nobody does who does
not need them.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from typing import Any, TypeAlias

from pygments.lexer import RegexLexerMeta
from pygments.lexers.python import PythonLexer
from pygments.token import Text, _TokenType

from coursebuild.render.lexers import class_of

_Match: TypeAlias = Callable[[str, int], re.Match[str] | None]
"""How Pygments looks for what a rule is about."""
_Rule: TypeAlias = tuple[_Match, Any, Any]
"""How Pygments looks for it; what it makes of it; the states that it enters or leaves then."""


class _Rules(PythonLexer):  # type: ignore[misc]  # its module has no types
    """Compiles a rule when it is first tried: most never are, and all take a while."""

    @classmethod
    def _process_regex(cls, regex: Any, flags: int, state: str) -> _Match:
        compiled: _Match | None = None

        def match(text: str, at: int) -> re.Match[str] | None:
            nonlocal compiled
            if compiled is None:
                compiled = RegexLexerMeta._process_regex(cls, regex, flags, state)
            return compiled(text, at)

        return match


@functools.cache
def _lexer() -> _Rules:
    return _Rules(stripnl=False, ensurenl=False)


def by_rules(text: str, at: int) -> tuple[list[tuple[str, str]], int]:
    """Runs of a text, each with its class, up to where Pygments is at its first state again.

    At least one is taken. With them comes the offset of what follows.
    """
    lexer, states, made, end = _lexer(), ["root"], list[tuple[str, str]](), len(text)
    while at < end and (not made or len(states) > 1):
        rule = _first(lexer._tokens[states[-1]], text, at)
        if rule is None:  # Pygments begins anew on the next line
            if text[at] == "\n":
                states = ["root"]
            made.append((class_of(Text), text[at]))
            at += 1
            continue
        found, action, change = rule
        if type(action) is _TokenType:
            made.append((class_of(action), found[0]))
        elif action is not None:
            made += ((class_of(token), part) for _, token, part in action(lexer, found))
        at = found.end()
        if change is not None:
            _change(states, change)
    return made, at


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
