"""All lessons in one file: as an e-book (EPUB 3), as one page, as a PDF of it; one as slides."""

from coursebuild.api import Exporter, Feature, on_demand

PDF_MARK = "/Keywords (coursebuild: the whole course"
"""The note that replaces that of the time."""

EPUB = Exporter(
    name="epub",
    summary="the lessons as an e-book, EPUB 3",
    file="course.epub",
    mark="EPUB/package.opf",
    make=on_demand("coursebuild.features.book.epub:epub_files"),
)
PAGE = Exporter(
    name="page",
    summary="the lessons on one page",
    file="course.html",
    mark='<meta name="generator" content="coursebuild: the whole course">',
    archive=False,
    make=on_demand("coursebuild.features.book.chapters:page_file"),
)
PDF = Exporter(
    name="pdf",
    summary="the lessons as a PDF, printed by a Chromium of this machine",
    file="course.pdf",
    mark=PDF_MARK,
    archive=False,
    make=on_demand("coursebuild.features.book.chapters:pdf_file"),
)
SLIDES = Exporter(
    name="slides",
    summary="a lesson as slides, with its labs",
    file="slides.html",
    mark='<meta name="generator" content="coursebuild: slides">',
    archive=False,
    of_lesson=True,
    make=on_demand("coursebuild.features.book.slides:slides_file"),
)
FEATURE = Feature(name="book", exporters=(EPUB, PAGE, PDF, SLIDES))
