"""Recorded figures: files of the course that scripts draw, with their data.

Entry point: `recorded_figures`.
"""

from __future__ import annotations

import posixpath

from msgspec import Struct

from coursebuild.core.model.addresses import local_file
from coursebuild.core.model.blocks import Document, FigureName, Paragraph, Script
from coursebuild.core.model.inlines import Image
from coursebuild.core.model.walk import (
    block_inlines,
    document_blocks,
    document_scripts,
    walk_inlines,
)
from coursebuild.core.text.source import Span


class RecordedFigure(Struct, frozen=True):
    """A figure that a script draws and a lesson shows, or its data."""

    script: str
    name: str
    """The name under which the script saves it."""
    path: str
    """The file of the course that the lesson shows."""
    span: Span
    """Where the lesson names the figure."""

    @property
    def has_dark(self) -> bool:
        """Whether there is also a drawing for dark pages."""
        return self.name.endswith(".svg")


def recorded_figures(document: Document) -> tuple[RecordedFigure, ...]:
    """The figures of a document's scripts that its paragraphs show, each followed by its data."""
    script_by_name: dict[str, str] = {}
    figures: list[RecordedFigure] = []
    for block in document_blocks(document):
        if isinstance(block, Script):
            script_by_name |= {figure.name: block.path for figure in block.figures}
        elif isinstance(block, Paragraph) and block.figure:
            inlines = walk_inlines(block_inlines(block))
            image = next(inline for inline in inlines if isinstance(inline, Image))
            path = local_file(image.url, document.source.path)
            for file in (path, f"{posixpath.splitext(path)[0]}.csv"):
                name = posixpath.basename(file)
                if name in script_by_name:
                    figures.append(RecordedFigure(script_by_name[name], name, file, image.url_span))
    return tuple(figures)


def unshown_figures(document: Document) -> tuple[FigureName, ...]:
    """The figures of a document's scripts that no paragraph below shows, and data without one."""
    shown_names = {(figure.script, figure.name) for figure in recorded_figures(document)}
    return tuple(
        figure
        for script in document_scripts(document)
        for figure in script.figures
        if (script.path, figure.name) not in shown_names
    )
