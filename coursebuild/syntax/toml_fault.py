"""What is wrong with a text that is not TOML, and how to mend it.

Entry points: `FaultError`, `check_scalar`, `advice`.
"""

from __future__ import annotations

import re
import tomllib

from coursebuild.syntax.nodes import StringNode
from coursebuild.syntax.wording import short

_CURLY = "“”„‟‘’‚‛«»"
_WORDS = {"True": "true", "TRUE": "true", "False": "false", "FALSE": "false"}
_NOTHING = frozenset(("null", "None", "nil", "Null", "NULL"))
_STRAIGHT = "TOML knows only the straight quotes `\"` and `'`"


class FaultError(Exception):
    """The text is not TOML here; `first` is where something that may stand once stands already."""

    def __init__(
        self, start: int, end: int, message: str, help: str = "", first: StringNode | None = None
    ) -> None:
        super().__init__(message)
        self.start = start
        self.end = end
        self.message = message
        self.help = help
        self.first = first


def check_scalar(text: str, start: int, end: int) -> None:
    """Raise `FaultError` unless `text[start:end]` is a number, a boolean or a date."""
    written = text[start:end]
    if _is_value(written):
        return
    first = written.split()[0]
    rest = written[len(first) :].lstrip()
    if rest and _is_value(first):
        at = end - len(rest)
        help = "values in an array have commas between them; a line holds one `key = value`"
        raise FaultError(at, end, f"`{short(rest)}` after the value `{short(first)}`", help)
    help = _scalar_help(written)
    raise FaultError(start, end, f"`{short(written)}` is not a value of TOML", help)


def _is_value(written: str) -> bool:
    try:
        tomllib.loads("x = " + written)
    except ValueError:
        return False
    return True


def _scalar_help(written: str) -> str:
    if written in _WORDS:
        return f"write `{_WORDS[written]}`"
    if written in _NOTHING:
        return "TOML has no such value; leave the field out"
    if written[0] in _CURLY:
        return _STRAIGHT
    if re.fullmatch(r"[+-]?0[0-9]+", written):
        return "a number has no leading zeros"
    if re.fullmatch(r"[+-]?(\.[0-9]+|[0-9]+\.)", written):
        return "a decimal point stands between digits"
    if re.fullmatch(r"[+-]?[0-9_]+", written):
        return "an integer has at most 64 bits"
    if '"' in written or "'" in written:
        return ""
    return f'text stands between quotes: `"{short(written)}"`'


def advice(text: str, at: int, expected: str) -> str:
    """How to mend what stands at `at` in the place of what is expected; may be empty."""
    char = text[at : at + 1]
    if char and char in _CURLY:
        return _STRAIGHT
    if expected.startswith("`=`") and char == ":":
        return "TOML writes `key = value`"
    if expected == "the end of the line":
        return "each `key = value` stands on a line of its own"
    if expected == "a value" and char in ("", "\n", "#"):
        return 'an empty text is written `""`'
    return ""
