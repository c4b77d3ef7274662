"""Macros of a course: its own commands of formulas, replaced by what they stand for.

They are replaced as a text is read, so that whatever has a formula has it whole: what typesets it
and what computes it, the copies of a page and its notebook.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt

_MOST = 1_000
"""How often macros are replaced in one formula."""
_REACH = 200
"""Characters before a macro in which a command is looked for."""
_LONGEST = 20_000
"""Characters of a formula in which macros are replaced; a longer one is not typeset, either."""
DEFINED = regex(
    r"\\(?:[egx]?def|let|(?:re)?newcommand|providecommand|DeclareMathOperator)(?![A-Za-z])\*?\s*\{?\s*"
    r"\\?([A-Za-z]+)"
)
COMMAND = regex(r"\\(?:([A-Za-z]+)|.)", re.DOTALL)
_SIGN = regex(r"\\(?:[A-Za-z]+|.)|.", re.DOTALL)
PARAMETER = regex(r"(?<!\\)#([1-9])")
_COMMAND_AT_END = regex(r"\\[A-Za-z]+\Z")
BEFORE_ARGUMENT = regex(
    r"(?:[_^]|\\(?:acute|bar|bm|boldsymbol|breve|check|d?dot|grave|hat|math(?:bb|bf|cal|frak|it|rm|sf|tt)"
    r"|overline|tilde|underline|vec|widehat|widetilde)|\\[dt]?(?:binom|frac)\s*(?:\{[^{}]*\}|[^\s{}\\])?)\s*\Z"
)
"""What takes the next sign or group: a macro is one argument, as in MathJax."""


def expand_macros(tex: Excerpt, macros: Mapping[str, str]) -> Excerpt:
    """A formula with what its macros stand for, but of names that it defines itself.

    What stands for a macro is where the macro begins, and an argument where it was. A macro without
    its arguments is left alone.
    """
    own_names = DEFINED.findall(tex.text) if macros else ()
    at, left = 0, _MOST if macros else 0
    while left and len(tex.text) <= _LONGEST and (use := COMMAND.search(tex.text, at)):
        at = use.end()
        if use[1] in own_names or use[1] not in macros:
            continue
        before, rest = tex.slice(0, use.start()), tex.slice(at)
        body, arguments = macros[use[1]], [before]
        count = max(map(int, PARAMETER.findall(body)), default=0)
        while len(arguments) <= count and (split := split_argument(rest)):
            arguments.append(split[0])
            rest = split[1]
        if len(arguments) <= count:
            continue
        if BEFORE_ARGUMENT.search(before.text[-_REACH:]):
            body = f"{{{body}}}"
        places = ((at, tex.offset(use.start())) for at in range(len(body)))
        whole = Excerpt(tex.source, body, tuple(places) or ((0, tex.offset(at)),))
        parts, start = [before], 0
        for parameter in PARAMETER.finditer(body):
            parts += whole.slice(start, parameter.start()), arguments[int(parameter[1])]
            start = parameter.end()
        tex = _join([*parts, whole.slice(start), rest])
        at, left = use.start(), left - 1
    return tex


def _join(parts: Sequence[Excerpt]) -> Excerpt:
    """Parts of a formula put together, with a blank where a letter would go on a command."""
    whole: list[Excerpt] = []
    for part in parts:
        if part.text[:1].isalpha() and whole and _COMMAND_AT_END.search(whole[-1].text[-_REACH:]):
            whole.append(Excerpt(part.source, " ", ((0, part.offset(0)),)))
        if part.text:
            whole.append(part)
    return Excerpt.join(whole or parts)


def split_argument(tex: Excerpt) -> tuple[Excerpt, Excerpt] | None:
    """The argument with which a text begins, without its braces, and what follows it."""
    depth, start = 0, len(tex.text) - len(tex.text.lstrip())
    for sign in _SIGN.finditer(tex.text, start):
        depth += (sign[0] == "{") - (sign[0] == "}")
        if depth <= 0:
            edge, end = sign[0] == "}", sign.end()
            return None if depth else (tex.slice(start + edge, end - edge), tex.slice(end))
    return None
