"""What Python says of a text: whether it compiles, and its statements.

Entry points: `python_mistake(code)`, `top_level(code)`, `text_key(code)`.

Each is worked out once in a process, or cheaply:

1. A text is compiled once; what is kept of it goes by its hash (`text_key`), since texts are long
   and what is found is short.
2. To parse a text into objects takes as long as to compile it, and most of the objects are inside
   of functions, where nobody looks. So bodies of functions and classes that import nothing are
   left out first, and what they take. `_without_bodies` knows where strings and comments end and
   nothing else of Python; that what it leaves has the same statements is sure because:

   - the text compiles. So a line that begins with `def` or `class` and is in no string begins a
     statement, with no bracket open before it;
   - a bracket that its first line leaves open is closed in what is left out as well, or what
     follows has one that closes and none that opens. That does not parse, and then the whole text
     is parsed.
"""

from __future__ import annotations

import ast
import hashlib
import re
import warnings
from typing import NamedTuple

from coursebuild.patterns import pattern

_MOST = 4096
"""Texts of which is known whether they compile."""


class Mistake(NamedTuple):
    """Where and why a text does not compile."""

    line: int
    """From 1."""
    column: int
    """From 0."""
    end_line: int
    end_column: int
    message: str


_known: dict[bytes, Mistake | None] = {}


def text_key(code: str) -> bytes:
    """What all that Python says of a text goes by: one line end after the last line is nothing."""
    core = code.rstrip("\n")
    if core.endswith("\\") or len(code) - len(core) > 1:
        core = code
    return hashlib.blake2b(core.encode("utf-8", "surrogatepass"), digest_size=16).digest()


def python_mistake(code: str) -> Mistake | None:
    """The first thing that Python has against a text."""
    key = text_key(code)
    if key not in _known:
        if len(_known) >= _MOST:
            _known.pop(next(iter(_known)), None)
        _known[key] = _compile(code)
    return _known[key]


def forget_texts() -> None:
    """Forget what was compiled, for whoever wants to know how long it takes."""
    _known.clear()


def _compile(code: str) -> Mistake | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            compile(code, "<lesson>", "exec", dont_inherit=True)
    except SyntaxError as error:
        line, column = error.lineno or 1, max((error.offset or 1) - 1, 0)
        end_column = max((error.end_offset or 0) - 1, 0)
        return Mistake(line, column, error.end_lineno or line, end_column, error.msg)
    except (ValueError, MemoryError, RecursionError, OverflowError) as error:
        message = f"the code cannot be compiled: {error}"
        return Mistake(1, 0, 1, 0, message if str(error) else "the code is nested too deeply")
    return None


def top_level(code: str) -> list[ast.stmt] | None:
    """The statements of a text, each on its lines; `None` where it does not parse.

    Bodies of functions and classes at the top level are whole only where they import something.
    """
    short = _without_bodies(code) if python_mistake(code) is None else None
    found = _parse(short) if short is not None else None
    return _parse(code) if found is None else found


def _parse(code: str) -> list[ast.stmt] | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(code).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def _field(other: str, own: str = "") -> str:
    """A field of an f-string: no backslash and no comment in it, and strings in the other quote.

    In one of three quotes it may have strings in its own, which never stand beside each other. What
    braces a string in it has are pairs, whether it is itself one with fields or not.
    """
    char = r"[^\"'\\\n{}\#]"
    text = rf"(?:{char}|\{{{char}*+\}})"
    some = [char, f"{other}(?!{other}{other}){text}*+{other}"]
    some += [f"{own}{text}++{own}(?!{own})"] if own else []
    one = f"(?:{'|'.join(some)})"
    return rf"\{{(?!\{{)(?:{one}|\{{{one}*+\}})++\}}"


_PLAIN = r"""
(?<![fFtT])(?<![fFtT][rR])(?:
  \"\"\"(?:[^"\\]++|\\.|"(?!""))*+\"\"\"
| '''(?:[^'\\]++|\\.|'(?!''))*+'''
| "(?!"")(?:[^"\\\n]++|\\[^\n])*+"
| '(?!'')(?:[^'\\\n]++|\\[^\n])*+'
)"""
_LITERAL = r"\\[^\n{}N]|\{\{|\}\}"
_FORMATTED = rf"""(?:
  \"\"\"(?:[^"\\{{}}]++|"(?!"")|{_LITERAL}|{_field("'", '"')})*+\"\"\"
| '''(?:[^'\\{{}}]++|'(?!'')|{_LITERAL}|{_field('"', "'")})*+'''
| "(?!"")(?:[^"\\\n{{}}]++|{_LITERAL}|{_field("'")})*+"
| '(?!'')(?:[^'\\\n{{}}]++|{_LITERAL}|{_field('"')})*+'
)"""
"""What may also be one without fields: it ends where a plain one does."""
_LINE = rf"(?:[^\"'\#\\\n\f]++|{_PLAIN}|{_FORMATTED}|\#[^\n]*+)*+"
"""Up to its end; a string in it may have others."""
_HEAD = r"(?:(?:async[ ]+)?def|class)[ ]"
_INSIDE = r"[ \t\#\n]"
"""With which a line begins that stands in the body of what is above it."""
_UNIT = pattern(
    rf"(?P<head>(?P<name>{_HEAD}[ \t]*+\w++)(?=[ \t:(\[])[^\"'\#\\\n\f]*+(?<=:)\n(?={_INSIDE}))?+"
    rf"(?P<rest>(?:{_HEAD})?+(?:(?(head)(?={_INSIDE})|(?!{_HEAD})){_LINE}\n)++)",
    re.VERBOSE | re.DOTALL,
)
"""A definition and its body; another beginning of one, or none, and lines that begin none.

To compile a line takes longer than to match one, so it is here only once.
"""


def _without_bodies(code: str) -> str | None:
    """A text that compiles, `pass` in place of bodies; `None` where it has something unusual."""
    if "\r" in code:
        return None
    code, parts, at = f"{code}\n", [], 0
    while at < len(code):
        found = _UNIT.match(code, at)
        if found is None:
            return None
        if found["head"] is None or "import" in found[0]:
            parts.append(found[0])
        else:
            parts += (found["name"], "(): pass\n", "\n" * found["rest"].count("\n"))
        at = found.end()
    return "".join(parts)
