"""Courses made from texts, without files, and the diagnostics of checks as short lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from msgspec.structs import replace

from coursebuild.core.model import Course, Document, MjcfModel
from coursebuild.core.model.course import CALLOUTS
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Source

KINDS = frozenset(CALLOUTS)
LESSON = """
[[level.lesson]]
id = "{0}"
slug = "{1}"
title = "T"
status = "{2}"
"""
MAP = (
    '[course]\ntitle = "T"\n[[level]]\nid = "1"\ntitle = "One"\n'
    + LESSON.format("1.1", "first", "complete")
    + LESSON.format("1.2", "second", "draft")
    + LESSON.format("1.3", "third", "planned")
    + '[[page]]\nid = "about"\ntitle = "About"\nfile = "content/pages/about.md"\n'
)
BOX = "<mujoco>\n  <worldbody/>\n</mujoco>\n"


def make_course(
    first: str = "Text.\n",
    second: str = "Text.\n",
    page_text: str = "Text.\n",
    *,
    models: Mapping[str, str] | None = None,
) -> Course:
    """A course of two written lessons, a planned lesson and a page, with models by their names."""
    course = parse_course_map(Source("content/course.toml", MAP)).value
    assert course is not None
    texts = {"1.1": first, "1.2": second, "about": page_text}
    return replace(
        with_documents(course, documents_of(course, texts)),
        models=tuple(
            MjcfModel(name, Source(f"models/{name}.xml", text))
            for name, text in (models or {}).items()
        ),
    )


def with_documents(course: Course, documents: Mapping[str, Document]) -> Course:
    """The course with documents, by the ids of their lessons and pages, and with no others."""
    levels = (
        replace(
            level, lessons=tuple(replace(x, document=documents.get(x.id)) for x in level.lessons)
        )
        for level in course.levels
    )
    pages = (replace(page, document=documents.get(page.id)) for page in course.pages)
    return replace(course, levels=tuple(levels), pages=tuple(pages))


def documents_of(course: Course, texts: Mapping[str, str]) -> dict[str, Document]:
    """Parse the texts of lessons and pages, given and returned by their ids."""
    kinds = KINDS | {kind.name for kind in course.callouts}
    owners = (owner for owner in course.owners if owner.id in texts)
    return {owner.id: document(owner.path, texts[owner.id], kinds) for owner in owners}


def document(path: str, text: str, kinds: frozenset[str] = KINDS) -> Document:
    """Parse a document, which must give no diagnostics."""
    result = parse_document(Source(path, text), kinds, lesson="lessons" in path)
    assert result.diagnostics == (), [d.message for d in result.diagnostics]
    return result.value


def rules_and_texts(diagnostics: Iterable[Diagnostic]) -> list[str]:
    return [f"{d.rule}: {d.span.text}" for d in diagnostics]
