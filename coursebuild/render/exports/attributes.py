"""What attributes are for.

Entry point: `use_of(name)`.
"""

from __future__ import annotations

import functools

from coursebuild.patterns import pattern

OTHER, OF_SCRIPTS, OF_PAGES, ID, IDS, ADDRESS = range(6)
"""Uses; what is of pages is not for XML. `IDS` refer to elements."""
XML_NAME = pattern(r"(?:(?:xml|xlink):)?[A-Za-z_][A-Za-z0-9_.-]*")
_REFERRING = frozenset(
    "aria-activedescendant aria-controls aria-describedby aria-details aria-errormessage"
    " aria-flowto aria-labelledby aria-owns for headers list".split()
)
"""Attributes that hold ids."""


@functools.lru_cache(maxsize=512)
def use_of(name: str) -> int:
    """What an attribute is for."""
    lower = name.lower()
    if lower.startswith(("on", "data-")) or lower in ("style", "download", "loading", "srcset"):
        return OF_SCRIPTS
    if lower in ("tabindex", "sizes") or not XML_NAME.fullmatch(name):
        return OF_PAGES
    if name == "id":
        return ID
    if name in _REFERRING:
        return IDS
    return ADDRESS if name in ("href", "xlink:href", "src") else OTHER
