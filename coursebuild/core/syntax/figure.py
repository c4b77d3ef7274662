"""Figures: a paragraph that begins with `Figure:` and shows an image.

Entry point: `read_figure`.
"""

from __future__ import annotations

import posixpath

from coursebuild.core.model import Image, Inline, plain_text
from coursebuild.core.text.source import Span

WORD = "Figure:"


def read_figure(
    children: tuple[Inline, ...], span: Span, drawn: list[str]
) -> tuple[tuple[Inline, ...], bool]:
    """The inlines of a paragraph that begins with the word, and whether it shows an image.

    `drawn` are the names of what scripts above draw and nothing has shown yet. A paragraph without
    an image shows the next of them, beside the lesson, and says in its words what that shows.
    """
    image = next((one for one in children if isinstance(one, Image)), None)
    if image is None and drawn:
        text = " ".join(plain_text(children).removeprefix(WORD).split())
        image = Image(span, drawn[0], text, "", span)
        children = (*children, image)
    if image is None:
        return children, False
    name = posixpath.basename(image.url)
    if name in drawn:
        drawn.remove(name)
    return children, True
