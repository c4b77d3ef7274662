"""All lessons in one file: as an e-book (EPUB 3), as one page, as a PDF of it; one as slides."""

from collections.abc import Callable, Iterable
from importlib import import_module

from coursebuild.api import ExportContext, Exporter, Feature, OutputFile, SiteFile

PDF_MARK = "/Keywords (coursebuild: the whole course"
"""The note that replaces that of the time."""


def single_file(module: str, function: str) -> Callable[[ExportContext], Iterable[OutputFile]]:
    """What makes a file; its module is imported when the export is asked for."""
    return lambda context: (getattr(import_module(f"{__name__}.{module}"), function)(context),)


def epub(context: ExportContext) -> Iterable[SiteFile]:
    """The files of the e-book."""
    from coursebuild.features.book.epub import epub_files

    return epub_files(context)


EPUB = Exporter(
    name="epub",
    summary="the lessons as an e-book, EPUB 3",
    file="course.epub",
    mark="EPUB/package.opf",
    make=epub,
)
PAGE = Exporter(
    name="page",
    summary="the lessons on one page",
    file="course.html",
    mark='<meta name="generator" content="coursebuild: the whole course">',
    archive=False,
    make=single_file("chapters", "page_file"),
)
PDF = Exporter(
    name="pdf",
    summary="the lessons as a PDF, printed by a Chromium of this machine",
    file="course.pdf",
    mark=PDF_MARK,
    archive=False,
    make=single_file("chapters", "pdf_file"),
)
SLIDES = Exporter(
    name="slides",
    summary="a lesson as slides, with its labs",
    file="slides.html",
    mark='<meta name="generator" content="coursebuild: slides">',
    archive=False,
    of_lesson=True,
    make=single_file("slides", "slides_file"),
)
FEATURE = Feature(name="book", exporters=(EPUB, PAGE, PDF, SLIDES))
