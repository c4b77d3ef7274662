"""Characters that HTML forbids, made visible.

Entry point: `visible(text)`. Control characters and non-characters are shown as the symbols that
stand for them.
"""

from __future__ import annotations

import functools
import re

RARE = r"\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff\U0001fffe-\U0010ffff"
"""What a class of allowed characters leaves out, besides controls of ASCII; characters past U+1FFFD
are left to a closer look. (To compile a class takes as long as what it lists is long: the few that
are forbidden are a tenth of the work of the many that are not.)
"""
_ALLOWED = re.compile(rf"(?:[\t\n -~]++|[^\x00-\x7e{RARE}]++)*+")
"""Text in which none is forbidden, found out fast."""
_FORBIDDEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ufdd0-\ufdef\ufffe\uffff\ud800-\udfff]")


@functools.cache
def _astral_noncharacter() -> re.Pattern[str]:
    """The last two characters of each plane but the first; rarely needed, and long to compile."""
    planes = range(1 << 16, 17 << 16, 1 << 16)
    return re.compile("[" + "".join(chr(p + 0xFFFE) + chr(p + 0xFFFF) for p in planes) + "]")


def visible(text: str) -> str:
    """The text with what HTML forbids replaced: a control by its picture, the rest by U+FFFD."""
    if _ALLOWED.fullmatch(text):
        return str(text)  # and no markup
    return _astral_noncharacter().sub("\ufffd", _FORBIDDEN.sub(_picture, text))


def _picture(match: re.Match[str]) -> str:
    code = ord(match[0])
    if code < 0x20:
        return chr(0x2400 + code)
    return "\u2421" if code == 0x7F else "\ufffd"
