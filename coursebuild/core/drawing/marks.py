"""Text in drawings: what markup can hold, how wide it is, and how labels are kept apart.

Entry points: `markup_text`, `text_width`, `shorten_to_width`; `separate_labels`.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from html import escape

_CACHE_SIZE = 1024
"""How many texts are remembered: drawings share many, in several sizes."""
_NO_MARKUP = re.compile("[\x00-\x1f\x7f\ud800-\udfff\ufffe\uffff]")
"""Includes lone surrogates, which stand for bytes that are not text."""
_NARROW = frozenset("ijl.,:;'|!()[] ·ft")
_BROAD = frozenset("mwMW—%@")


@functools.lru_cache(maxsize=_CACHE_SIZE)
def markup_text(text: str) -> str:
    """Text escaped for markup, without characters that markup cannot hold."""
    return escape(_NO_MARKUP.sub("", text))


@functools.lru_cache(maxsize=_CACHE_SIZE)
def text_width(text: str, size: float) -> float:
    """About how wide a text is in a sans-serif face of this size, rather too wide."""
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


def shorten_to_width(text: str, room: float, size: float) -> str:
    """A text shortened to a width, with an ellipsis if something is left out."""
    if text_width(text, size) <= room:
        return text
    while text and text_width(f"{text}…", size) > room:
        text = text[:-1]
    return f"{text}…"


def separate_labels(desired: Sequence[float], gap: float, top: float, bottom: float) -> list[float]:
    """Places for labels as near as possible to the desired ones, in order, at least `gap` apart.

    Args:
        desired: where the labels belong, rising.
        gap: the least distance from one label to the next.
        top: the least place of the first.
        bottom: the greatest place of the last; if there is too little room, the first go above top.
    """
    places: list[float] = []
    for y in desired:
        places.append(max(y, places[-1] + gap) if places else max(y, top))
    most = bottom
    for i in reversed(range(len(places))):  # those pushed past the bottom go up again
        most = places[i] = min(places[i], most)
        most -= gap
    return places
