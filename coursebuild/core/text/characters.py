"""Characters: what HTML, XML and logs forbid, and how wide a text is on a terminal."""

from __future__ import annotations

import re
import unicodedata

from coursebuild.core.text.regex import regex

_NOT_HTML = regex(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff\U0001fffe-\U0010ffff]"
)
"""Past U+1FFFF also allowed ones: listing only the last two of each plane would be slow."""


_PLAIN = bytes((*b"\t\n", *range(0x20, 0x7F)))
"""What most texts consist of: searching the rest takes a tenth of the time."""


def visible(text: str) -> str:
    """The text without what HTML forbids: a symbol for each control, U+FFFD for the rest."""
    text = str(text)  # as `Markup` would escape
    rest = text.encode("utf-8", "surrogatepass").translate(None, _PLAIN)
    is_clean = _NOT_HTML.search(rest.decode("utf-8", "surrogatepass")) is None
    return text if is_clean else _NOT_HTML.sub(_picture, text)


def _picture(match: re.Match[str]) -> str:
    code = ord(match[0])
    if code > 0xFFFF and code & 0xFFFE != 0xFFFE:
        return match[0]
    return chr(_PICTURES.get(code, 0xFFFD))


_NOT_XML = regex("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
"""XML 1.0 has no place for these characters (section 2.2)."""


def clean_xml(text: str) -> str:
    """The text with U+FFFD in place of each character that XML cannot hold."""
    return _NOT_XML.sub("\ufffd", text)


_COMMAND = regex(r"^([^\S\n]*):(?=:)|(##\w*)\[", re.MULTILINE)


def without_commands(text: str) -> str:
    """The text, in which a CI service that reads its log finds nothing to obey.

    GitHub obeys lines such as `  ::add-mask::x`, and `##[error]x` in a line, as Azure does
    `##vso[…]`; in JSON they stay what they are.
    """
    bracket = "\\u005b" if text.startswith(("{", "[")) else "\u2045"
    return _COMMAND.sub(lambda m: f"{m[1]}\u205a" if m[2] is None else m[2] + bracket, text)


REORDERING = regex("[\u202a-\u202e]")
"""Characters by which a browser shows others in another order than they are read."""
ISOLATING = regex("[\u202a-\u202e\u2066-\u2069]")
"""These, and those that texts in Arabic may need, but code does not."""

TAB = 4
_PICTURES = {0x7F: 0x2421, **{code: 0x2400 + code for code in range(0x20)}}


def printable(text: str) -> str:
    """Return a text with symbols for control characters, so that it cannot change the terminal."""
    unseen = ("Cc", "Cf", "Cs", "Zl", "Zp")
    return "".join(
        "\ufffd" if unicodedata.category(char) in unseen and char != "\u200d" else char
        for char in text.replace("\t", " " * TAB).translate(_PICTURES)
    )


def printable_lines(text: str) -> str:
    """Do the same for a text of several lines."""
    return "\n".join(printable(line) for line in text.split("\n"))


def cells(text: str) -> int:
    """The number of columns that a text takes."""
    width = 0
    for char in text:
        if char == "\t":
            width += TAB
        elif not unicodedata.combining(char) and char != "\u200d":
            width += 2 if unicodedata.east_asian_width(char) in ("W", "F") else 1
    return width
