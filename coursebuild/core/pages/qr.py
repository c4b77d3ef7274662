"""QR codes for paper, as SVG.

Entry point: `qr_svg(text, label)`.
"""

from __future__ import annotations

from markupsafe import Markup, escape


def qr_svg(text: str, label: str) -> Markup:
    """The QR code of a text as an `svg` element with a label; empty for a text that is too long.

    Up to a seventh of the code may be damaged (level M), or more if that takes no more room.
    """
    import segno  # only pages with labs need it

    try:
        code = segno.make_qr(text, error="m", boost_error=True)
    except segno.DataOverflowError:  # more than 2,331 bytes
        return Markup()
    svg = code.svg_inline(omitsize=True, svgclass="qr", lineclass=None)
    return Markup(svg.replace("<svg", f'<svg role="img" aria-label="{escape(label)}"', 1))
