"""What is wrong with a text that is not TOML, and how to mend it.

Entry points: `diagnose_syntax` (from what `tomllib` says), `error_offset`.
"""

from __future__ import annotations

import re

from coursebuild.core.syntax.nodes import odd_character, tex_word
from coursebuild.core.syntax.wording import shorten
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Excerpt

_PLACE = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")
_TOKEN = re.compile(
    r'#[^\n]*|"""(?:[^\\]|\\.)*?"{3,5}|' + r"'''.*?'{3,5}|"
    r'"(?!"")(?:[^"\\\n]|\\[^\n])*"|' + r"'(?!'')[^'\n]*'|[\[\]{}\"']",
    re.DOTALL,
)
_SCALAR = re.compile(r"[^\n,\]}#]*")
_WORD = re.compile(r"[\w.+-]+|\S")
_CURLY = tuple("“”„‟‘’‚‛«»")
_WORDS = {"True": "true", "TRUE": "true", "False": "false", "FALSE": "false"}
_NOTHING = frozenset(("null", "None", "nil", "Null", "NULL"))
_STRAIGHT = "TOML knows only the straight quotes `\"` and `'`"


def error_offset(text: str, message: str) -> int:
    """The offset that a message of `tomllib` names; the end of the text where it names none."""
    place = _PLACE.search(message)
    if place is None or place[1] is None:
        return len(text)
    starts = [0, *(match.end() for match in re.finditer("\n", text))]
    return min(starts[min(int(place[1]), len(starts)) - 1] + int(place[2]) - 1, len(text))


def double_backslash(command: str) -> str:
    """How to write a command of TeX in a string."""
    return f"double the backslash: `\\\\{command}`, or put the text between single quotes"


def diagnose_syntax(body: Excerpt, message: str, rule: str) -> Diagnostic:
    """What is wrong with a text of which `tomllib` says `message`, as a diagnostic of a rule."""
    start, end, words, help = _mistake(body.text, message)
    return diagnose(rule, body.span(start, end), words, help=help)


_Mistake = tuple[int, int, str, str]
"""Where it begins and ends, what is wrong, and how to mend it."""


def _mistake(text: str, message: str) -> _Mistake:
    at = error_offset(text, message)
    char, words = text[at : at + 1], _PLACE.sub("", message)
    if odd := "a lone carriage return" if char == "\r" else odd_character(char):
        help = "remove it" if at == 0 else "replace it by a plain space, or remove it"
        return at, at + 1, f"{odd} cannot stand here in TOML", help
    opened = _open_at(text, at)
    left = text[opened] if opened is not None else ""
    if opened is not None and left in "\"'":
        return _unclosed_string(text, opened)
    if re.match("Unescaped|Escaped|Invalid hex", words):
        start = text.rindex("\\", 0, at)
        help = double_backslash(tex_word(text, start + 1))
        return start, start + 2, f"`{text[start : start + 2]}` is not an escape of TOML", help
    if opened is not None and at >= len(text):
        return opened, opened + 1, f"`{left}` is never closed", ""
    if opened is not None and left == "{" and char == "\n":
        help = "a longer table has a `[header]` of its own"
        return opened, opened + 1, "a table in braces stands on one line", help
    if words.startswith(("Invalid value", "Invalid date")):
        return _no_value(text, at)
    if words.startswith(("Expected newline", "Unclosed")):
        return _after_value(text, at, "]" if words == "Unclosed array" else "}" if left else "")
    help = _STRAIGHT if char in _CURLY else "TOML writes `key = value`" if char == ":" else ""
    if words.startswith("Invalid"):
        return _expected(text, at, "a key", help)
    if words.startswith("Expected "):
        return _expected(text, at, words.removeprefix("Expected ").replace("'", "`"), help)
    return at, at, words[:1].lower() + words[1:], help


def _open_at(text: str, at: int) -> int | None:
    """The innermost bracket that is open at an offset, or the quote that is never closed."""
    opened: list[int] = []
    for token in _TOKEN.finditer(text):
        if token.start() >= at:
            break
        if token[0] in ("[", "{", '"', "'"):
            opened.append(token.start())
        elif token[0] in ("]", "}") and opened:
            opened.pop()
    return opened[-1] if opened else None


def _unclosed_string(text: str, start: int) -> _Mistake:
    quote = text[start]
    if text.startswith(quote * 3, start):
        return start, start + 3, f"`{quote * 3}` is never closed", ""
    end = start + len(text[start:].split("\n", 1)[0])
    help = f"close it with `{quote}`; text of several lines stands between three quotes"
    return start, end, "the string is not closed on its line", help


def _no_value(text: str, start: int) -> _Mistake:
    """What stands in the place of a value."""
    scalar = _SCALAR.match(text, start)
    written = scalar[0].rstrip() if scalar else ""
    if not written:
        return start, start, "a value is missing", 'an empty text is written `""`'
    message = f"`{shorten(written)}` is not a value of TOML"
    return start, start + len(written), message, _value_help(written)


def _value_help(written: str) -> str:
    if written in _WORDS:
        return f"write `{_WORDS[written]}`"
    if written in _NOTHING:
        return "TOML has no such value; leave the field out"
    if written[0] in _CURLY:
        return _STRAIGHT
    if re.fullmatch(r"[+-]?[0-9]*\.?[0-9]*", written):
        return "a number has no leading zeros, and digits on both sides of its point"
    if '"' in written or "'" in written:
        return ""
    return f'text stands between quotes: `"{shorten(written)}"`'


def _after_value(text: str, at: int, closer: str) -> _Mistake:
    """What follows a value: the rest of a word that began like a number, or something else."""
    before = re.search(r"[\w.+:-]*\Z", text[:at])
    if before and before[0] and not text[at].isspace() and text[at] not in ",#":
        return _no_value(text, before.start())
    what, help = "the end of the line", "each `key = value` stands on a line of its own"
    if closer:
        what, help = f"`,` or `{closer}`", "values in brackets have commas between them"
    return _expected(text, at, what, help)


def _expected(text: str, at: int, what: str, help: str) -> _Mistake:
    word = _WORD.match(text, at)
    found = f"`{shorten(word[0])}`" if word else "the end of the line"
    return at, word.end() if word else at, f"expected {what}, found {found}", help
