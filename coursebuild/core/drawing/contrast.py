"""How well colours are told from their ground, by WCAG 2.2.

Entry points: `contrast`; `legible`, the nearest colour that is told well enough. Colours are
`#rrggbb`.
"""

from __future__ import annotations

from collections.abc import Collection

GROUNDS_LIGHT, GROUNDS_DARK = ("#fcfbf8", "#f4f2ec"), ("#17191c", "#1f2226")
"""What text stands on, `--paper` and `--sheet` of the style sheet."""
LEAST, ENOUGH = 4.5, 7.0
"""The contrast that text must have, and better has (success criteria 1.4.3 and 1.4.6)."""


def contrast(colour: str, grounds: Collection[str]) -> float:
    """The least contrast with one of the grounds, from 1 to 21."""
    own = _luminance(colour)
    pairs = (sorted((own, _luminance(ground))) for ground in grounds)
    return min((bright + 0.05) / (dim + 0.05) for dim, bright in pairs)


def legible(colour: str, grounds: Collection[str], least: float = LEAST) -> str:
    """The colour, with as much black or white in it as it needs on these grounds."""
    end = 0 if _luminance(next(iter(grounds))) > 0.5 else 255
    mixes = (
        "#" + "".join(f"{round(c + (end - c) * share / 255):02x}" for c in _channels(colour))
        for share in range(256)
    )
    return next(mixed for mixed in mixes if contrast(mixed, grounds) >= least)


def _channels(colour: str) -> tuple[int, ...]:
    return tuple(bytes.fromhex(colour[1:]))


def _luminance(colour: str) -> float:
    shares = (channel / 255 for channel in _channels(colour))
    linear = [s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
