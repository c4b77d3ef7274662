"""QR codes for paper, as SVG.

Entry point: `qr_svg(text, label)`. Each row of the code is a line of strokes, which takes few
bytes; around it is the white space that ISO/IEC 18004 demands.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby

from markupsafe import Markup, escape

_QUIET = 4
"""Modules of white space on each side."""


def qr_svg(text: str, label: str) -> Markup:
    """The QR code of a text as an `svg` element with a label; empty for a text that is too long.

    Up to a seventh of the code may be damaged (level M), or more if that takes no more room.
    """
    import segno  # only pages with labs need it

    try:
        code = segno.make_qr(text, error="m", boost_error=True)
    except segno.DataOverflowError:  # more than 2,331 bytes
        return Markup()
    rows = [bytes(row) for row in code.matrix]
    size = len(rows) + 2 * _QUIET
    return Markup(
        f'<svg class="qr" viewBox="{-_QUIET} {-_QUIET} {size} {size}" role="img"'
        f' aria-label="{escape(label)}"><path d="{_strokes(rows)}"/></svg>'
    )


def _strokes(rows: Iterable[bytes]) -> str:
    """Strokes as wide as a module along the middle of each row."""
    parts: list[str] = []
    for y, row in enumerate(rows):
        gap: str = f"M0 {y}.5"
        x = 0
        for dark, run in groupby(row):
            length = len(list(run))
            if dark:
                parts.append(f"{gap}h{length}")
                gap = ""
            elif gap:
                gap = f"M{x + length} {y}.5"
            else:
                gap = f"m{length} 0"
            x += length
    return "".join(parts)
