"""All lessons in one file: as an e-book (EPUB 3), as one page, as a PDF of it; one as slides."""

from collections.abc import Callable, Iterable
from importlib import import_module

from coursebuild.api import ExportContext, Exporter, Feature, SiteFile

PDF_MARK = "/Keywords (coursebuild: the whole course"
"""The note that replaces that of the time."""


def load(module: str, function: str) -> Callable[[ExportContext], Iterable[SiteFile]]:
    """What makes files, or a single one; its module is imported when the export is asked for."""

    def make(context: ExportContext) -> Iterable[SiteFile]:
        files: SiteFile | Iterable[SiteFile] = getattr(
            import_module(f"{__name__}.{module}"), function
        )(context)
        return (files,) if isinstance(files, SiteFile) else files

    return make


EPUB = Exporter(
    name="epub",
    summary="the lessons as an e-book, EPUB 3",
    file="course.epub",
    mark="EPUB/package.opf",
    make=load("epub", "epub_files"),
)
PAGE = Exporter(
    name="page",
    summary="the lessons on one page",
    file="course.html",
    mark='<meta name="generator" content="coursebuild: the whole course">',
    archive=False,
    make=load("chapters", "page_file"),
)
PDF = Exporter(
    name="pdf",
    summary="the lessons as a PDF, printed by a Chromium of this machine",
    file="course.pdf",
    mark=PDF_MARK,
    archive=False,
    make=load("chapters", "pdf_file"),
)
SLIDES = Exporter(
    name="slides",
    summary="a lesson as slides, with its labs",
    file="slides.html",
    mark='<meta name="generator" content="coursebuild: slides">',
    archive=False,
    of_lesson=True,
    make=load("slides", "slides_file"),
)
FEATURE = Feature(name="book", exporters=(EPUB, PAGE, PDF, SLIDES))
