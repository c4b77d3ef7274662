"""A document without its prose tells the rest of the course what the whole document tells it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.checks.compiled import mjcf_texts
from coursebuild.core.checks.course import check_course
from coursebuild.core.model import (
    Course,
    Document,
    Lab,
    Mjcf,
    Recording,
    Script,
    ThematicBreak,
    document_blocks,
    document_has,
)
from coursebuild.core.model.results import Outcome, Results, ScriptRun
from coursebuild.core.model.summary import without_prose
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.lookup.lexicon import lexicon
from coursebuild.core.pages.shown import shown
from coursebuild.core.pages.urls import Place
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.extract import extract
from coursebuild.core.scripts.findings import script_findings
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.text.source import Source
from coursebuild.core.values import decode, encode, fingerprint
from coursebuild.features.quiz.checks import check_output_lines
from coursebuild.features.quiz.model import Quiz
from coursebuild.pipeline.tasks import DocumentSummary
from support.scratch_course import ROOT
from support.summary_lessons import MAP, PARTS, document, library_of, with_documents

pytestmark = pytest.mark.site

FIXTURES = sorted((ROOT / "tests" / "fixtures").rglob("*.md")) + sorted(
    (ROOT / "tests" / "courses").rglob("*.md")
)


def courses(*texts: str) -> tuple[Course, Course]:
    """A course of these lessons and the last as a page: whole, and of summarys."""
    parsed = parse_course_map(Source("content/course.toml", MAP))
    assert parsed.value is not None
    whole = [document(f"content/{i}.md", text) for i, text in enumerate(texts)]
    return with_documents(parsed.value, whole), with_documents(parsed.value, map(again, whole))


def again(document: Document) -> Document:
    """The summary as it comes from the store."""
    bare = replace(without_prose(document), lexicon=lexicon(document, {}))
    found = decode(encode(DocumentSummary(bare, (), (), True)), DocumentSummary, document.source)
    assert found is not None
    return found.document


def told(course: Course) -> list[object]:
    """Everything that is known of a course by its documents."""
    extracted = extract(course)
    runs = [
        ScriptRun(e.path, Outcome.OK if i % 3 else Outcome.FAILED, 0, "one 1.5\nx 1\n", "", 0.0)
        for i, e in enumerate(extracted.value, 1)
    ]
    verdicts = verify(course, runs)
    library = library_of(course, Results(tuple(runs), verdicts, (), (), "3", "3"))
    here = Place("lessons/x.html")
    return [
        check_course(course),
        [(text.text, text.code, text.block.span, text.lines_before) for text in mjcf_texts(course)],
        extracted.diagnostics,
        [(e.path, e.text, e.owner, e.script) for e in extracted.value],
        [(v.recording.span, v.recording.body, v.status, v.changes, v.diff) for v in verdicts],
        script_findings(course, extracted.value, runs, verdicts),
        list(check_output_lines(course, runs)),
        [(n, [(u.owner.id, u.by_lab, u.by_script) for u in us]) for n, us in library.uses.items()],
        said(library),
        [shown_or_not(library, here, document) for document in course.documents],
    ]


def said(library: Library) -> list[object]:
    """What documents say of each other."""
    found = library.references
    return [
        {id: [owner.id for owner in owners] for id, owners in found.referrers.items()},
        [(t.term, t.owner.id, [owner.id for owner in t.used]) for t in found.terms.values()],
    ]


def shown_or_not(library: Library, here: Place, document: Document) -> object:
    try:
        return fingerprint(shown(library, here, document))
    except KeyError as error:  # a link that leads nowhere, in a course that is never drawn
        return repr(error)


@given(st.lists(st.lists(st.sampled_from(PARTS), max_size=6), min_size=1, max_size=2))
@settings(max_examples=60)
def test_a_summary_tells_what_the_document_tells(lessons: list[list[str]]) -> None:
    whole, bare = courses(*("".join(parts) for parts in lessons))
    assert told(whole) == told(bare)


@pytest.mark.parametrize("path", FIXTURES, ids=lambda path: path.name)
def test_those_of_the_fixtures_too(path: Path) -> None:
    whole, bare = courses(path.read_text(encoding="utf-8"), "".join(PARTS))
    assert told(whole) == told(bare)


@pytest.mark.parametrize("path", FIXTURES, ids=lambda path: path.name)
def test_which_blocks_a_document_has(path: Path) -> None:
    for course in courses(path.read_text(encoding="utf-8"), "".join(PARTS)):
        for one in course.documents:
            blocks = tuple(document_blocks(one))
            for kind in (Script, Lab, Mjcf, Quiz, Recording):
                there = any(isinstance(block, kind) for block in blocks)
                assert document_has(one, kind) == there


def test_prose_is_not_in_a_summary() -> None:
    whole = document("content/a.md", "Only *prose*, `code` and $x$ here.\n\n- and\n- there\n")
    assert list(document_blocks(without_prose(whole))) == [ThematicBreak(whole.blocks[0].span)]


def test_of_nothing_to_read_there_is_no_summary() -> None:
    for text in ("", "\ufeff\n", "[a]: b\n"):
        assert list(document_blocks(without_prose(document("content/a.md", text)))) == []
