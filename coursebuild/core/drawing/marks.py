"""Text in drawings: what markup can hold, how wide it is, and how labels keep apart.

Entry points: `markup_text`, `text_width`, `shortened`; `apart`.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from html import escape

_REMEMBERED = 1024
"""Texts: those of a drawing stand in others as well, in several sizes."""
_NO_MARKUP = re.compile("[\x00-\x1f\x7f\ud800-\udfff\ufffe\uffff]")
"""Halves of surrogate pairs among them, which stand for bytes that are no text."""
_NARROW = frozenset("ijl.,:;'|!()[] ·ft")
_BROAD = frozenset("mwMW—%@")


@functools.lru_cache(maxsize=_REMEMBERED)
def markup_text(text: str) -> str:
    """Text for markup; characters that no markup can hold are left out."""
    return escape(_NO_MARKUP.sub("", text))


@functools.lru_cache(maxsize=_REMEMBERED)
def text_width(text: str, size: float) -> float:
    """About how wide a text is in a sans-serif face of this size; rather too much."""
    letters = 0.0
    for char in text:
        if char in _NARROW:
            letters += 0.36
        elif char in _BROAD:
            letters += 0.92
        elif char > "\u2e80":
            letters += 1.05
        else:
            letters += 0.68 if char.isupper() else 0.58
    return letters * size


def shortened(text: str, room: float, size: float) -> str:
    """A text that fits into so much room, with an ellipsis where some of it is left out."""
    if text_width(text, size) <= room:
        return text
    while text and text_width(f"{text}…", size) > room:
        text = text[:-1]
    return f"{text}…"


def apart(wanted: Sequence[float], gap: float, top: float, bottom: float) -> list[float]:
    """Places as near to those wanted as may be, in their order, and each `gap` below the last.

    Args:
        wanted: rising.
        gap: from one to the next.
        top: where the first may be.
        bottom: where the last may be; what does not fit begins above the top.
    """
    places: list[float] = []
    for y in wanted:
        places.append(max(y, places[-1] + gap) if places else max(y, top))
    most = bottom
    for i in reversed(range(len(places))):  # those that were pushed out at the bottom go up again
        most = places[i] = min(places[i], most)
        most -= gap
    return places
