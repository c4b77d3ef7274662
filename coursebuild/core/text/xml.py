"""Text that XML can hold."""

from __future__ import annotations

import re

_FORBIDDEN_CHARACTER = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
"""XML 1.0 has no place for these characters (section 2.2)."""


def clean_xml(text: str) -> str:
    """The text with U+FFFD in place of each character that XML cannot hold."""
    return _FORBIDDEN_CHARACTER.sub("\ufffd", text)
