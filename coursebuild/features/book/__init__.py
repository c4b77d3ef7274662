"""All lessons in one file: as an e-book (EPUB 3), and as one page."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from coursebuild.core.features import Exporter, Feature

if TYPE_CHECKING:
    from coursebuild.core.model.results import SiteFile
    from coursebuild.core.pages.added_files import ExportContext


def export_epub(context: ExportContext) -> Iterator[SiteFile]:
    """The files of the e-book."""
    from coursebuild.features.book.epub import epub_files

    return epub_files(context)


def export_page(context: ExportContext) -> Iterator[SiteFile]:
    """The page."""
    from coursebuild.features.book.page import page_file

    yield page_file(context)


EPUB = Exporter(
    name="epub",
    summary="the lessons as an e-book, EPUB 3",
    file="course.epub",
    mark="EPUB/package.opf",
    make=export_epub,
)
PAGE = Exporter(
    name="page",
    summary="the lessons on one page",
    file="course.html",
    mark='<meta name="generator" content="coursebuild: the whole course">',
    archive=False,
    make=export_page,
)
FEATURE = Feature(name="book", exporters=(EPUB, PAGE))
