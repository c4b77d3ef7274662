"""Figures that scripts draw, and the files of the course that they are recorded in.

Entry point: `recorded_figures`.
"""

from __future__ import annotations

import posixpath
from collections.abc import Iterator

from msgspec import Struct

from coursebuild.core.model.addresses import local_file
from coursebuild.core.model.blocks import Document, FigureName, Paragraph, Script
from coursebuild.core.model.inlines import Image
from coursebuild.core.model.walk import block_inlines, document_blocks, walk_inlines
from coursebuild.core.text.source import Span


class RecordedFigure(Struct, frozen=True):
    """What a script draws, as a lesson shows it."""

    script: str
    name: str
    """As the script saves it."""
    path: str
    """The file of the course that is shown."""
    span: Span
    """Where the lesson names that."""


def recorded_figures(document: Document) -> tuple[RecordedFigure, ...]:
    """The figures of a document's scripts that paragraphs below them show."""
    return tuple(_recorded(document))


def unshown_figures(document: Document) -> tuple[FigureName, ...]:
    """The figures of a document's scripts that no paragraph below shows."""
    shown = {(figure.script, figure.name) for figure in recorded_figures(document)}
    return tuple(
        figure
        for block in document_blocks(document)
        if isinstance(block, Script)
        for figure in block.figures
        if (block.path, figure.name) not in shown
    )


def _recorded(document: Document) -> Iterator[RecordedFigure]:
    drawn: dict[str, str] = {}
    for block in document_blocks(document):
        if isinstance(block, Script):
            drawn |= {figure.name: block.path for figure in block.figures}
        elif isinstance(block, Paragraph) and block.figure:
            for inline in walk_inlines(block_inlines(block)):
                if isinstance(inline, Image):
                    name = posixpath.basename(inline.url)
                    if name in drawn:
                        path = local_file(inline.url, document.source.path)
                        yield RecordedFigure(drawn[name], name, path, inline.url_span)
                    break
