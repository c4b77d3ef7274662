"""The quizzes of a page as items.

Entry point: `page_quizzes(sheet, document, tools, base_url)`.
"""

from __future__ import annotations

from coursebuild.features.quiz.model import Quiz
from coursebuild.model import Document, document_blocks
from coursebuild.render import urls
from coursebuild.render.context import PageContext
from coursebuild.render.packages.items import MadeQuiz, made_items
from coursebuild.render.sheet import Sheet
from coursebuild.render.tools import Tools


def page_quizzes(
    sheet: Sheet, document: Document, tools: Tools, base_url: str, language: str
) -> tuple[MadeQuiz, ...]:
    """The quizzes of a document, in its order."""
    assert sheet.shown is not None
    page = PageContext.made(tools, sheet.shown, urls.Place(sheet.path), document)
    quizzes = (block for block in document_blocks(document) if isinstance(block, Quiz))
    return tuple(made_items(page, quiz, base_url, language or "en") for quiz in quizzes)
