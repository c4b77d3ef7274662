"""All lessons in one file: as an e-book (EPUB 3), as one page, as a PDF of it; one as slides."""

from coursebuild.api import Exporter, Feature
from coursebuild.features.book.chapters import PDF_MARK, page_file, pdf_file
from coursebuild.features.book.epub import epub_files
from coursebuild.features.book.slides import slides_file

EPUB = Exporter(
    name="epub",
    summary="the lessons as an e-book, EPUB 3",
    file="course.epub",
    mark="EPUB/package.opf",
    make=epub_files,
)
PAGE = Exporter(
    name="page",
    summary="the lessons on one page",
    file="course.html",
    mark='<meta name="generator" content="coursebuild: the whole course">',
    archive=False,
    make=lambda context: (page_file(context),),
)
PDF = Exporter(
    name="pdf",
    summary="the lessons as a PDF, printed by a Chromium of this machine",
    file="course.pdf",
    mark=PDF_MARK,
    archive=False,
    make=lambda context: (pdf_file(context),),
)
SLIDES = Exporter(
    name="slides",
    summary="a lesson as slides, with its labs",
    file="slides.html",
    mark='<meta name="generator" content="coursebuild: slides">',
    archive=False,
    of_lesson=True,
    make=lambda context: (slides_file(context),),
)
FEATURE = Feature(name="book", exporters=(EPUB, PAGE, PDF, SLIDES))
