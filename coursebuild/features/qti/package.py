"""Quizzes as a content package of IMS QTI 2.1.

Entry point: `package_files(context)`: one test for each quiz, one item for each question, the
pictures that they show, and a manifest that lists every file with the item that shows it.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from pathlib import Path

from coursebuild.core.model import find_blocks
from coursebuild.core.model.results import CachedFile, OutputFile, SiteFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.added_files import ExportContext
from coursebuild.core.pages.xml import identifier, render_xml
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.features.qti.flow import STRIKE_CLASS
from coursebuild.features.qti.items import STYLE, QuizItems, quiz_items
from coursebuild.features.quiz.model import Quiz

_FOLDER = Path(__file__).parent
_STYLE_SHEET = f"""\
.{STRIKE_CLASS} {{ text-decoration: line-through; }}
.align-center {{ text-align: center; }}
.align-right {{ text-align: right; }}
"""


def package_files(context: ExportContext) -> Iterator[SiteFile | Diagnostic]:
    """Yield the files, none if no question has an answer, and report what items cannot hold."""
    quizzes: list[QuizItems] = []
    for quiz in _quizzes(context):
        yield from quiz.losses
        if quiz.items:
            quizzes.append(quiz)
            test = render_xml(_FOLDER / "test.jinja", quiz=quiz)
            yield OutputFile(f"tests/{quiz.identifier}.xml", test)
            for item in quiz.items:
                yield OutputFile(f"items/{item.identifier}.xml", item.data)
    if quizzes:
        pictures = {path for quiz in quizzes for item in quiz.items for path in item.pictures}
        for path in context.course.files:
            if urls.file_path(path) in pictures:
                read = functools.partial(context.read, path)
                yield CachedFile(urls.file_path(path), "", read)
        yield OutputFile(STYLE, _STYLE_SHEET.encode())
        manifest = render_xml(
            _FOLDER / "manifest.jinja",
            identifier=identifier("course.", context.course.key),
            quizzes=quizzes,
            style=STYLE,
            encode=urls.encode,
        )
        yield OutputFile("imsmanifest.xml", manifest)


def _quizzes(context: ExportContext) -> Iterator[QuizItems]:
    """Write all quizzes, in the order of the course."""
    for owner in context.course.owners:
        summary = owner.document
        if summary and any(find_blocks(summary, Quiz)):
            page = context.page(summary)
            for quiz in find_blocks(page.document, Quiz):
                yield quiz_items(page, quiz, context.course)
