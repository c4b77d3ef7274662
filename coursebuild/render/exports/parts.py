"""A lesson as a part of the whole course: on one page with the others, and in the e-book.

Entry point: `lesson_part(sheet, tools, article)`. Links to the rest of the site are left open, see
`rewrite`; so a part depends on its own lesson only.
"""

from __future__ import annotations

from markupsafe import Markup
from msgspec import Struct

from coursebuild.render.exports.cut import Cut
from coursebuild.render.exports.rewrite import Rewriter, Rules
from coursebuild.render.exports.tags import Start
from coursebuild.render.formulas import Woven
from coursebuild.render.lesson import LessonHead
from coursebuild.render.sheet import Sheet
from coursebuild.render.tools import Tools

SHOWN = frozenset("gif jpeg jpg png svg webp".split())
"""Endings of the pictures that every reading system shows."""
_ON_PAPER = frozenset(("anchor", "bar-tools", "plot-wide", "qr"))
"""Classes of what an e-book does not need: links of headings to themselves, downloads, QR codes; of
two drawings of a plot the one that small screens cannot show."""
_TOP = "_top"
_HERE = Markup("\ue000")
"""Stands for the article."""
_DOWN = 2
"""The course is the first heading, its levels are the second."""


class OpenChapter(Struct, frozen=True):
    """A lesson as a chapter of the e-book, with its links left open."""

    text: str
    """XHTML."""
    pictures: tuple[str, ...]
    """Site paths of its pictures."""
    mathml: bool
    svg: bool


class LessonPart(Struct, frozen=True):
    """A lesson, with its links left open. The two are kept apart: no file is made of both."""

    section: str
    """HTML."""
    chapter: OpenChapter


def anchor(lesson: str, id: str = _TOP) -> str:
    """The id on the page of the whole course of what has an id in a lesson; of the lesson.

    In a drawing an id must be a name of XML, which does not begin with a digit.
    """
    return f"_{lesson}--{id}"


def lesson_part(sheet: Sheet, tools: Tools, article: Woven) -> LessonPart:
    """The part; `article` is the lesson's text as published."""
    head = sheet.values["lesson"]
    assert isinstance(head, LessonHead), "the sheet of a lesson has its head"
    values = {"lesson": head, "draft": sheet.values["draft"], "article": _HERE, "top": _TOP}
    # Behind the article are tags and nothing else.
    before, _, after = str(tools.render("exports/lesson.html", **values)).rpartition(_HERE)
    first, *others = (*article.texts[:-1], article.texts[-1] + after)
    prefix = anchor(head.id, "")
    page = Rules(sheet.path, prefix, down=_DOWN, opened=_is_no_answer, part=head.id)
    book = Rules(sheet.path, xml=True, pictures=SHOWN, without=_ON_PAPER)
    cut = Cut(Woven((before + first, *others), article.formulas))
    rewriter = Rewriter(book)
    section, text = Rewriter(page).of(cut), rewriter.of(cut)
    mathml, svg = (f"<{name}" in text for name in ("math", "svg"))
    return LessonPart(section, OpenChapter(text, tuple(rewriter.pictures), mathml, svg))


def _is_no_answer(start: Start) -> bool:
    return not {"answer", "hint"}.intersection((start.get("class") or "").split())
