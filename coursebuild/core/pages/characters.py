"""Characters that HTML forbids, made visible.

Entry point: `visible(text)`. Control characters and non-characters are shown as the symbols that
stand for them.
"""

from __future__ import annotations

import re

_FORBIDDEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff\U0001fffe-\U0010ffff]"
)
"""And, past U+1FFFF, some that are allowed: to list only the last two of each plane takes long."""


def visible(text: str) -> str:
    """The text with what HTML forbids replaced: a control by its picture, the rest by U+FFFD."""
    return _FORBIDDEN.sub(_picture, str(text))  # and no markup


def _picture(match: re.Match[str]) -> str:
    code = ord(match[0])
    if code > 0xFFFF and code & 0xFFFE != 0xFFFE:
        return match[0]
    if code < 0x20:
        return chr(0x2400 + code)
    return "\u2421" if code == 0x7F else "\ufffd"
