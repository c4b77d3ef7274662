"""What a drawn page gives to the files beside it, and to those of the whole course.

Entry point: `page_exports`. It depends on what the page depends on, and on nothing else.
"""

from __future__ import annotations

from msgspec import Struct

from coursebuild.render import urls
from coursebuild.render.context import PageContext
from coursebuild.render.exports.markdown import Same
from coursebuild.render.exports.notebook import Notebook, notebook
from coursebuild.render.exports.parts import LessonPart, lesson_part
from coursebuild.render.exports.twin import twin
from coursebuild.render.formulas import Woven
from coursebuild.render.sheet import Sheet
from coursebuild.render.tools import Tools


class Beside(Struct, frozen=True):
    """What a page gives to the files beside it."""

    twin: str
    """The page as Markdown; empty where it has no twin."""
    notebook: Notebook | None
    """Of a lesson."""


class PageExports(Struct, frozen=True):
    """See the module. The two parts are kept apart, since the second is read for other files."""

    beside: Beside
    part: LessonPart | None
    """Of a lesson: what it gives to the files of the whole course."""


def page_exports(
    sheet: Sheet, page: PageContext | None, tools: Tools, base_url: str, body: str, article: Woven
) -> PageExports:
    """All of it; `page` is the context of the page's document, if it has one.

    `body` is the page's HTML as published, `article` its document's part of that.
    """
    same: Same = {}
    text = twin(sheet, page, body, same) if urls.twin_path(sheet.path) is not None else ""
    if sheet.kind != "lesson" or page is None:
        return PageExports(Beside(text, None), None)
    part = lesson_part(sheet, tools, article)
    return PageExports(Beside(text, notebook(sheet, page, base_url, same)), part)
