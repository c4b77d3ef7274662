"""Diagnostics of texts that are not TOML, more helpful than the messages of `tomllib`.

Entry points: `diagnose_syntax`; `error_offset`, the place that a message of `tomllib` names.
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
_CURLY_QUOTES = tuple("“”„‟‘’‚‛«»")
_BOOLEANS = {"True": "true", "TRUE": "true", "False": "false", "FALSE": "false"}
_NULLS = frozenset(("null", "None", "nil", "Null", "NULL"))
_QUOTES_HELP = "TOML knows only the straight quotes `\"` and `'`"


def error_offset(text: str, message: str) -> int:
    """The offset that a message of `tomllib` names; the end of the text if it names none."""
    place = _PLACE.search(message)
    if place is None or place[1] is None:
        return len(text)
    starts = [0, *(match.end() for match in re.finditer("\n", text))]
    return min(starts[min(int(place[1]), len(starts)) - 1] + int(place[2]) - 1, len(text))


def double_backslash(command: str) -> str:
    """How to write a command of TeX in a string."""
    return f"double the backslash: `\\\\{command}`, or put the text between single quotes"


def diagnose_syntax(body: Excerpt, message: str, rule: str) -> Diagnostic:
    """The diagnostic of a text that `tomllib` refuses with `message`."""
    start, end, words, help = _describe_mistake(body.text, message)
    return diagnose(rule, body.span(start, end), words, help=help)


_Mistake = tuple[int, int, str, str]
"""Its start and end in the text, the message and the help."""


def _describe_mistake(text: str, message: str) -> _Mistake:
    at = error_offset(text, message)
    char, words = text[at : at + 1], _PLACE.sub("", message)
    if odd := "a lone carriage return" if char == "\r" else odd_character(char):
        help = "remove it" if at == 0 else "replace it by a plain space, or remove it"
        if at == 0 and char == "\ufeff":
            help = "save the file as UTF-8 without a byte order mark"
        return at, at + 1, f"{odd} is not allowed here in TOML", help
    opening = _innermost_opening(text, at)
    bracket = text[opening] if opening is not None else ""
    if opening is not None and bracket in "\"'":
        return _unclosed_string(text, opening)
    if re.match("Unescaped|Escaped|Invalid hex", words):
        start = text.rindex("\\", 0, at)
        help = double_backslash(tex_word(text, start + 1))
        return start, start + 2, f"`{text[start : start + 2]}` is not an escape of TOML", help
    if opening is not None and at >= len(text):
        return opening, opening + 1, f"`{bracket}` is never closed", ""
    if opening is not None and bracket == "{" and char == "\n":
        help = "a longer table has a `[header]` of its own"
        return opening, opening + 1, "a table in braces stands on one line", help
    if words.startswith(("Invalid value", "Invalid date")):
        return _wrong_value(text, at)
    if words.startswith(("Expected newline", "Unclosed")):
        closer = "]" if words == "Unclosed array" else "}" if bracket else ""
        return _wrong_end_of_value(text, at, closer)
    help = "TOML writes `key = value`" if char == ":" else ""
    help = _QUOTES_HELP if char in _CURLY_QUOTES else help
    if words.startswith("Invalid"):
        return _expected_instead(text, at, "a key", help)
    if words.startswith("Expected "):
        return _expected_instead(text, at, words.removeprefix("Expected ").replace("'", "`"), help)
    return at, at, words[:1].lower() + words[1:], help


def _innermost_opening(text: str, at: int) -> int | None:
    """The offset of the innermost bracket open at `at`, or of a quote that is never closed."""
    openings: list[int] = []
    for token in _TOKEN.finditer(text):
        if token.start() >= at:
            break
        if token[0] in ("[", "{", '"', "'"):
            openings.append(token.start())
        elif token[0] in ("]", "}") and openings:
            openings.pop()
    return openings[-1] if openings else None


def _unclosed_string(text: str, start: int) -> _Mistake:
    quote = text[start]
    if text.startswith(quote * 3, start):
        return start, start + 3, f"`{quote * 3}` is never closed", ""
    end = start + len(text[start:].split("\n", 1)[0])
    help = f"close it with `{quote}`; text of several lines stands between three quotes"
    return start, end, "the string is not closed on its line", help


def _wrong_value(text: str, start: int) -> _Mistake:
    """Describe what stands in the place of a value."""
    scalar = _SCALAR.match(text, start)
    value = scalar[0].rstrip() if scalar else ""
    if not value:
        return start, start, "a value is missing", 'an empty text is written `""`'
    message = f"`{shorten(value)}` is not a valid TOML value"
    return start, start + len(value), message, _value_help(value)


def _value_help(text: str) -> str:
    if text in _BOOLEANS:
        return f"write `{_BOOLEANS[text]}`"
    if text in _NULLS:
        return "TOML has no such value; leave the field out"
    if text[0] in _CURLY_QUOTES:
        return _QUOTES_HELP
    if re.fullmatch(r"[+-]?[0-9]*\.?[0-9]*", text):
        return "a number has no leading zeros, and digits on both sides of its point"
    if '"' in text or "'" in text:
        return ""
    return f'text needs quotes: `"{shorten(text)}"`'


def _wrong_end_of_value(text: str, at: int, closer: str) -> _Mistake:
    """Describe what wrongly follows a value, such as letters after digits."""
    before = re.search(r"[\w.+:-]*\Z", text[:at])
    if before and before[0] and not text[at].isspace() and text[at] not in ",#":
        return _wrong_value(text, before.start())
    noun, help = "the end of the line", "each `key = value` stands on a line of its own"
    if closer:
        noun, help = f"`,` or `{closer}`", "values in brackets have commas between them"
    return _expected_instead(text, at, noun, help)


def _expected_instead(text: str, at: int, noun: str, help: str) -> _Mistake:
    word = _WORD.match(text, at)
    quotation = f"`{shorten(word[0])}`" if word else "the end of the line"
    return at, word.end() if word else at, f"expected {noun}, found {quotation}", help
