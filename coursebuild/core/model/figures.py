"""Figures that scripts draw and their data, and the files of the course that they are recorded in.

Entry point: `recorded_figures`.
"""

from __future__ import annotations

import posixpath

from msgspec import Struct

from coursebuild.core.model.addresses import local_file
from coursebuild.core.model.blocks import Document, FigureName, Paragraph, Script
from coursebuild.core.model.inlines import Image
from coursebuild.core.model.walk import block_inlines, document_blocks, walk_inlines
from coursebuild.core.text.source import Span


class RecordedFigure(Struct, frozen=True):
    """A figure that a script draws, as a lesson shows it, or its data."""

    script: str
    name: str
    """As the script saves it."""
    path: str
    """The file of the course that is shown."""
    span: Span
    """Where the lesson names the figure."""

    @property
    def has_dark(self) -> bool:
        """Whether there is a drawing for dark pages, too."""
        return self.name.endswith(".svg")


def recorded_figures(document: Document) -> tuple[RecordedFigure, ...]:
    """The figures of a document's scripts that paragraphs show, each with its data after it."""
    drawn: dict[str, str] = {}
    found: list[RecordedFigure] = []
    for block in document_blocks(document):
        if isinstance(block, Script):
            drawn |= {figure.name: block.path for figure in block.figures}
        elif isinstance(block, Paragraph) and block.figure:
            inlines = walk_inlines(block_inlines(block))
            image = next(inline for inline in inlines if isinstance(inline, Image))
            path = local_file(image.url, document.source.path)
            for file in (path, f"{posixpath.splitext(path)[0]}.csv"):
                name = posixpath.basename(file)
                if name in drawn:
                    found.append(RecordedFigure(drawn[name], name, file, image.url_span))
    return tuple(found)


def unshown_figures(document: Document) -> tuple[FigureName, ...]:
    """The figures of a document's scripts that no paragraph below shows, and data of none."""
    shown = {(figure.script, figure.name) for figure in recorded_figures(document)}
    return tuple(
        figure
        for block in document_blocks(document)
        if isinstance(block, Script)
        for figure in block.figures
        if (block.path, figure.name) not in shown
    )
