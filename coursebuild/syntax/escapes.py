r"""Backslashes that were meant for TeX.

Entry points: `tex_escapes` (escapes of a string that are valid and surely not meant), `tex_word`,
`odd_character`.

JSON and TOML both read `\t`, `\n`, `\b`, `\f` and `\r` as control characters, so that "$\tau$" in a
lesson silently becomes a tab and "au". A backspace, form feed or carriage return before a letter
has no use in a course's text; a tab or a line end has, so these are reported only before the rest
of a known command.
"""

from __future__ import annotations

import re
import unicodedata
from bisect import bisect_left
from collections.abc import Iterable, Iterator

from coursebuild.patterns import pattern

_LETTERS = pattern(r"[A-Za-z]+")
_DOLLARS = pattern(r"(?<!\\)\$+")

_COMMANDS = frozenset(
    re.findall(
        r"\w+",
        """
        tag tan tanh tau tbinom text textbf textcolor textit textrm textsf textstyle texttt tfrac
        therefore theta thickapprox thicksim tilde times to top triangle triangledown triangleleft
        triangleq triangleright

        nRightarrow nVdash nabla natural ncong ne nearrow neg negmedspace negthinspace neq nexists
        ngeq ngtr ni nleq nless nmid nolimits nonumber normalsize not notag notin nparallel nprec
        nrightarrow nsim nsubseteq nsucc nu nvdash nwarrow
        """,
    )
)
"""Commands of TeX that begin with `t` or `n`."""


def tex_word(text: str, at: int) -> str:
    """The letters that stand from `at` on."""
    match = _LETTERS.match(text, at)
    return match[0] if match else ""


def tex_escapes(value: str, escapes: Iterable[tuple[int, str]]) -> Iterator[tuple[int, str]]:
    """Which escapes of a decoded string were meant for TeX.

    `escapes` are (offset in the value, letter of the escape); the result has
    (offset in the value, the command).
    """
    if "$" not in value:
        return
    dollars = [match.start() for match in _DOLLARS.finditer(value)]
    for at, letter in escapes:
        rest = tex_word(value, at + 1)
        if not rest or letter not in "tnbfr":
            continue
        known = letter + rest in _COMMANDS
        in_math = bisect_left(dollars, at) % 2 == 1
        meant = (known and in_math) if letter == "n" else (known or in_math or letter in "bfr")
        if meant:
            yield at, letter + rest


def odd_character(char: str) -> str:
    """The name of a character that looks like a space or like nothing, and is no white space."""
    if not char or char in " \t\n\r":
        return ""
    if unicodedata.category(char) in {"Zs", "Zl", "Zp", "Cf", "Cc"}:
        name = unicodedata.name(char, "control character").lower()
        return f"U+{ord(char):04X} ({name})"
    return ""
