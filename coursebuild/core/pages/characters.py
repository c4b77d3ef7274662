"""Characters that HTML forbids, made visible.

Entry point: `visible(text)`, which replaces control characters and non-characters by symbols.
"""

from __future__ import annotations

import re

_FORBIDDEN_CHARACTER = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff\U0001fffe-\U0010ffff]"
)
"""Past U+1FFFF also allowed ones: listing only the last two of each plane would be slow."""


def visible(text: str) -> str:
    """The text without what HTML forbids: a symbol for each control, U+FFFD for the rest."""
    return _FORBIDDEN_CHARACTER.sub(_picture, str(text))  # `str`, as `Markup` would escape


def _picture(match: re.Match[str]) -> str:
    code = ord(match[0])
    if code > 0xFFFF and code & 0xFFFE != 0xFFFE:
        return match[0]
    if code < 0x20:
        return chr(0x2400 + code)
    return "\u2421" if code == 0x7F else "\ufffd"
