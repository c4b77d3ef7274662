"""What is wrong with a text that is not TOML, and how to mend it.

Entry points: `mistake_of` (from what `tomllib` says), `nesting_mistake`, `place_of`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from msgspec import Struct

from coursebuild.core.syntax.escapes import odd_character, tex_word
from coursebuild.core.syntax.wording import short
from coursebuild.core.text.patterns import pattern

_DEEP = 64
"""More brackets or parts of a key than anyone writes."""

_PLACE = pattern(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")
_DOTTED = pattern(rf"(?:[\w\"'-]+[ \t]*\.[ \t]*){{{_DEEP},}}[\w\"'-]+")
_TOKEN = pattern(
    r'#[^\n]*|"""(?:[^\\]|\\.)*?"{3,5}|' + r"'''.*?'{3,5}|"
    r'"(?!"")(?:[^"\\\n]|\\[^\n])*"|' + r"'(?!'')[^'\n]*'|[\[\]{}\"']",
    re.DOTALL,
)
_SCALAR = pattern(r"[^\n,\]}#]*")
_WORD = pattern(r"[\w.+-]+|\S")
_CURLY = "“”„‟‘’‚‛«»"
_WORDS = {"True": "true", "TRUE": "true", "False": "false", "FALSE": "false"}
_NOTHING = frozenset(("null", "None", "nil", "Null", "NULL"))
_STRAIGHT = "TOML knows only the straight quotes `\"` and `'`"


class Mistake(Struct, frozen=True):
    """What is wrong at `[start, end)`."""

    start: int
    end: int
    message: str
    help: str = ""


def place_of(text: str, message: str) -> int:
    """The offset that a message of `tomllib` names; the end of the text where it names none."""
    place = _PLACE.search(message)
    if place is None or place[1] is None:
        return len(text)
    starts = [0, *(match.end() for match in re.finditer("\n", text))]
    return min(starts[min(int(place[1]), len(starts)) - 1] + int(place[2]) - 1, len(text))


def nesting_mistake(text: str) -> Mistake:
    """What nests deeper than the interpreter can follow: hundreds of brackets or parts of a key."""
    for at, opened in _brackets(text):
        if len(opened) > _DEEP:
            return Mistake(at, at + 1, "tables and arrays nest too deep")
    dotted = _DOTTED.search(text)
    return Mistake(*(dotted.span() if dotted else (0, 0)), "a key has too many parts")


def _brackets(text: str) -> Iterator[tuple[int, list[int]]]:
    """Each bracket with all that are open after it; at last a quote that is never closed."""
    opened: list[int] = []
    for token in _TOKEN.finditer(text):
        if token[0] in "[{\"'":
            opened.append(token.start())
        elif token[0] in "]}" and opened:
            opened.pop()
        yield token.start(), opened
        if token[0] in "\"'":
            return


def mistake_of(text: str, message: str) -> Mistake:
    """What is wrong with a text of which `tomllib` says `message`."""
    place = _PLACE.search(message)
    if place is None:  # the interpreter converts no more than some thousand digits
        digits = re.search(r"[-+0-9_]{1000,}", text)
        span = digits.span() if digits else (0, 0)
        return Mistake(*span, "the number is too long", "an integer has at most 64 bits")
    at = place_of(text, message)
    char = text[at : at + 1]
    words = message[: place.start()]
    if odd := "a lone carriage return" if char == "\r" else odd_character(char):
        help = "remove it" if at == 0 else "replace it by a plain space, or remove it"
        return Mistake(at, at + 1, f"{odd} cannot stand here in TOML", help)
    opened: list[int] = []
    for here, those in _brackets(text):
        if here >= at:
            break
        opened = those.copy()
    if opened and text[opened[-1]] in "\"'":
        return _unclosed_string(text, opened[-1])
    if re.match("Unescaped|Escaped|Invalid hex", words):
        return _escape(text, text.rindex("\\", 0, at))
    if opened and at >= len(text):
        start = opened[-1]
        return Mistake(start, start + 1, f"`{text[start]}` is never closed")
    if opened and text[opened[-1]] == "{" and char == "\n":
        help = "a longer table has a `[header]` of its own"
        message = "a table in braces stands on one line"
        return Mistake(opened[-1], opened[-1] + 1, message, help)
    if words.startswith(("Invalid value", "Invalid date")):
        return _no_value(text, at)
    if words.startswith(("Expected newline", "Unclosed")):
        return _after_value(text, at, "]" if words == "Unclosed array" else "}" if opened else "")
    return _other(text, at, words)


def _unclosed_string(text: str, start: int) -> Mistake:
    quote = text[start]
    if text.startswith(quote * 3, start):
        return Mistake(start, start + 3, f"`{quote * 3}` is never closed")
    end = start + len(text[start:].split("\n", 1)[0])
    help = f"close it with `{quote}`; text of several lines stands between three quotes"
    return Mistake(start, end, "the string is not closed on its line", help)


def _escape(text: str, start: int) -> Mistake:
    code = re.compile(r"\\(?:u[0-9A-Fa-f]{4}|U[0-9A-Fa-f]{8})").match(text, start)
    if code is not None:
        help = "write the character itself"
        return Mistake(start, code.end(), f"`{code[0]}` is no character", help)
    message = f"`{text[start : start + 2]}` is not an escape of TOML"
    return Mistake(start, start + 2, message, double_backslash(tex_word(text, start + 1)))


def double_backslash(command: str) -> str:
    """How to write a command of TeX in a string."""
    return f"double the backslash: `\\\\{command}`, or put the text between single quotes"


def _no_value(text: str, start: int) -> Mistake:
    """What stands in the place of a value."""
    scalar = _SCALAR.match(text, start)
    written = scalar[0].rstrip() if scalar else ""
    if not written:
        return Mistake(start, start, "a value is missing", 'an empty text is written `""`')
    message = f"`{short(written)}` is not a value of TOML"
    return Mistake(start, start + len(written), message, _value_help(written))


def _value_help(written: str) -> str:
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
    if '"' in written or "'" in written:
        return ""
    return f'text stands between quotes: `"{short(written)}"`'


def _after_value(text: str, at: int, closer: str) -> Mistake:
    """What follows a value: the rest of a word that began like a number, or something else."""
    before = re.search(r"[\w.+:-]*\Z", text[:at])
    if before and before[0] and not text[at].isspace() and text[at] not in ",#":
        return _no_value(text, before.start())
    what, help = "the end of the line", "each `key = value` stands on a line of its own"
    if closer:
        what, help = f"`,` or `{closer}`", "values in brackets have commas between them"
    return _expected(text, at, what, help)


def _other(text: str, at: int, words: str) -> Mistake:
    """What needs few words of our own."""
    help = ""
    if text[at : at + 1] in tuple(_CURLY):
        help = _STRAIGHT
    elif text[at : at + 1] == ":":
        help = "TOML writes `key = value`"
    if words.startswith("Invalid"):
        return _expected(text, at, "a key", help)
    if words.startswith("Expected "):
        return _expected(text, at, words.removeprefix("Expected ").replace("'", "`"), help)
    return Mistake(at, at, words[:1].lower() + words[1:], help)


def _expected(text: str, at: int, what: str, help: str) -> Mistake:
    word = _WORD.match(text, at)
    found = f"`{short(word[0])}`" if word else "the end of the line"
    end = word.end() if word else at
    return Mistake(at, end, f"expected {what}, found {found}", help)
