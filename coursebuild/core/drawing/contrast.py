"""The contrast of colours, given as `#rrggbb`, with their background, by WCAG 2.2."""

from __future__ import annotations

from collections.abc import Collection

GROUNDS_LIGHT, GROUNDS_DARK = ("#fcfbf8", "#f4f2ec"), ("#17191c", "#1f2226")
"""The backgrounds of text, `--paper` and `--sheet` of the style sheet."""
REQUIRED_CONTRAST, RECOMMENDED_CONTRAST = 4.5, 7.0
"""The contrast that text must have, and should have (success criteria 1.4.3 and 1.4.6)."""


def contrast(colour: str, grounds: Collection[str]) -> float:
    """The least contrast with any of the backgrounds, from 1 to 21."""
    luminance = _luminance(colour)
    pairs = (sorted((luminance, _luminance(ground))) for ground in grounds)
    return min((bright + 0.05) / (dim + 0.05) for dim, bright in pairs)


def legible(colour: str, grounds: Collection[str], least: float = REQUIRED_CONTRAST) -> str:
    """The colour, mixed with as little black or white as it needs on these backgrounds."""
    end = 0 if _luminance(next(iter(grounds))) > 0.5 else 255
    mixes = (
        "#" + "".join(f"{round(c + (end - c) * share / 255):02x}" for c in _channels(colour))
        for share in range(256)
    )
    return next(mix for mix in mixes if contrast(mix, grounds) >= least)


def _channels(colour: str) -> tuple[int, ...]:
    return tuple(bytes.fromhex(colour[1:]))


def _luminance(colour: str) -> float:
    shares = (channel / 255 for channel in _channels(colour))
    linear = [s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
