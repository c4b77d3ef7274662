r"""Strings with escapes, in JSON and TOML: their values, and where each character stands.

Entry points: `escaped_string`, `tex_escapes`, `tex_word`, `odd_character`.

JSON and TOML both read `\t`, `\n`, `\b`, `\f` and `\r` as control characters, so that "$\tau$" in a
lesson silently becomes a tab and "au". A backspace, form feed or carriage return before a letter
has no use in a course's text; a tab or a line end has, so these are reported only before the rest
of a known command.
"""

from __future__ import annotations

import re
import unicodedata
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator

from coursebuild.core.syntax.nodes import StringNode
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Excerpt

_LETTERS = re.compile(r"[A-Za-z]+")
_DOLLARS = re.compile(r"(?<!\\)\$+")

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


def escaped_string(
    body: Excerpt,
    quoted: tuple[int, int],
    content: tuple[int, int],
    escapes: Iterable[re.Match[str]],
    meaning: Callable[[re.Match[str]], str],
    help: Callable[[str], str],
    diagnostics: list[Diagnostic],
) -> StringNode:
    """The string between the offsets `quoted`, whose text without the quotes is `content`.

    `escapes` are those in it, in order, and `meaning` says what each stands for. An escape that was
    surely meant for TeX is reported, with what `help` says of the command.
    """
    parts: list[str] = []
    runs: list[tuple[int, int]] = []
    controls: list[tuple[int, str]] = []
    length = 0

    def add(part: str, place: int) -> None:
        nonlocal length
        if part:
            runs.append((length, place))
            parts.append(part)
            length += len(part)

    here, end = content
    for escape in escapes:
        add(body.text[here : escape.start()], here)
        if escape[0] in ("\\t", "\\n", "\\b", "\\f", "\\r"):
            controls.append((length, escape[0][1]))
        add(meaning(escape), escape.start())
        here = escape.end()
    add(body.text[here:end], here)
    value = "".join(parts)
    places = dict(runs)  # an escape is a run of its own
    for at, command in tex_escapes(value, controls):
        span = body.span(places[at], places[at] + 1 + len(command))
        message = f"`\\{command[0]}` of `\\{command}` is read as a control character"
        diagnostics.append(diagnose("field-value", span, message, help=help(command)))
    return StringNode(body, *quoted, value, tuple(runs) or ((0, content[0]),))


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
