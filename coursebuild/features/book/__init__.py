"""All lessons in one file: as an e-book (EPUB 3), and as one page."""

from coursebuild.core.features import Exporter, Feature
from coursebuild.features.book.chapters import page_file
from coursebuild.features.book.epub import epub_files

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
FEATURE = Feature(name="book", exporters=(EPUB, PAGE))
