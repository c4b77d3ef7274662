"""What is kept of a document in the place of its text tells the rest of the course the same."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.checks.compiled import mjcf_texts
from coursebuild.core.checks.course import check_course
from coursebuild.core.model import (
    Course,
    Document,
    Mjcf,
    Recording,
    Script,
    ThematicBreak,
    document_blocks,
    document_has,
)
from coursebuild.core.model.results import Outcome, Results, ScriptRun
from coursebuild.core.model.summary import without_prose
from coursebuild.core.pages.document_inputs import document_inputs
from coursebuild.core.pages.equations import equations_of
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.pages.renderer import known_mathml
from coursebuild.core.pages.urls import Place
from coursebuild.core.registry import summarize
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.extract import extract
from coursebuild.core.scripts.findings import script_findings
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.text.source import Source
from coursebuild.core.values import decode, encode, fingerprint
from coursebuild.features.glossary.page import course_terms
from coursebuild.features.lab.model import Lab
from coursebuild.features.quiz.checks import check_output_lines
from coursebuild.features.quiz.model import Quiz
from coursebuild.pipeline.fingerprints import document_fingerprint
from coursebuild.pipeline.reading import DocumentSummary
from support.scratch_course import ROOT
from support.summary_lessons import MAP, PARTS, document, library_of, with_documents

pytestmark = pytest.mark.site

PROSE = ["Plain words.\n\n", "More of *them*, `code`.\n\n", "- a\n- b\n\n", "***\n\n", "\n"]
FIXTURES = [
    path for top in ("fixtures", "courses") for path in sorted((ROOT / "tests" / top).rglob("*.md"))
]


def courses(*texts: str) -> tuple[Course, Course]:
    """A course of these lessons and the last as a page: whole, and of summaries."""
    parsed = parse_course_map(Source("content/course.toml", MAP))
    assert parsed.value is not None
    read = (document(f"content/{i}.md", text) for i, text in enumerate(texts))
    whole = [replace(one, summaries=summarize(one, known_mathml({})).value) for one in read]
    kept = [from_store(one) for one in whole]
    return with_documents(parsed.value, whole), with_documents(parsed.value, kept)


def summarized(whole: Document) -> Document:
    mathml = known_mathml({})
    summaries = summarize(whole, mathml).value
    return replace(without_prose(whole), equations=equations_of(whole, mathml), summaries=summaries)


def from_store(whole: Document) -> Document:
    data = encode(DocumentSummary(summarized(whole), (), (), True))
    found = decode(data, DocumentSummary, whole.source)
    assert found is not None
    return found.document


def known_of(course: Course) -> Iterator[object]:
    """Everything that is known of a course by its documents."""
    extracted = extract(course)
    runs = [
        ScriptRun(e.path, Outcome.OK if i % 3 else Outcome.FAILED, 0, "one 1.5\nx 1\n", "", 0.0)
        for i, e in enumerate(extracted.value, 1)
    ]
    verdicts = verify(course, runs)
    library = library_of(course, Results(tuple(runs), verdicts, (), (), "3", "3"))
    yield check_course(course)
    yield [
        (text.text, text.code, text.block.span, text.lines_before) for text in mjcf_texts(course)
    ]
    yield extracted.diagnostics
    yield [(e.path, e.text, e.owner, e.script) for e in extracted.value]
    yield [(v.recording.span, v.recording.body, v.status, v.changes) for v in verdicts]
    yield script_findings(course, extracted.value, runs, verdicts)
    yield list(check_output_lines(course, runs))
    yield [(n, [(u.owner.id, u.by_lab, u.by_script) for u in us]) for n, us in library.uses.items()]
    yield {id: [owner.id for owner in owners] for id, owners in library.referrers.items()}
    yield [(t.term, t.owner.id, [o.id for o in t.used]) for t in course_terms(library)]
    for one in course.documents:
        try:
            yield fingerprint(document_inputs(library, Place("lessons/x.html"), one))
        except KeyError as error:  # a link that leads nowhere, in a course that is never drawn
            yield repr(error)


@given(st.lists(st.lists(st.sampled_from(PARTS), max_size=6), min_size=1, max_size=2))
@settings(max_examples=40)
def test_a_summary_tells_what_the_document_tells(lessons: list[list[str]]) -> None:
    whole, kept = courses(*("".join(parts) for parts in lessons))
    assert list(known_of(whole)) == list(known_of(kept))


def test_summaries_of_the_fixtures_tell_what_they_tell() -> None:
    wrong = []
    for paths in zip(FIXTURES[::2], FIXTURES[1::2], strict=False):
        whole, kept = courses(*(path.read_text(encoding="utf-8") for path in paths))
        same = list(known_of(whole)) == list(known_of(kept))
        for one in (*whole.documents, *kept.documents):
            blocks = tuple(document_blocks(one))
            for kind in (Script, Lab, Mjcf, Quiz, Recording):
                there = any(isinstance(block, kind) for block in blocks)
                same = same and document_has(one, kind) == there
        if not same:
            wrong.append(paths)
    assert wrong == []


def test_prose_is_not_in_a_summary() -> None:
    whole = document("content/a.md", "Only *prose*, `code` and $x$ here.\n\n- and\n- there\n")
    assert list(document_blocks(without_prose(whole))) == [ThematicBreak(whole.blocks[0].span)]
    for text in ("", "\ufeff\n", "[a]: b\n"):
        assert list(document_blocks(without_prose(document("content/a.md", text)))) == []


# --- fingerprints


def seen_elsewhere(first: Document) -> list[object]:
    """What is seen of the first lesson by others: other pages, and whether anything is wrong."""
    parsed = parse_course_map(Source("content/course.toml", MAP))
    assert parsed.value is not None
    second = summarized(document("content/1.md", "".join(PARTS[:9])))
    course = with_documents(parsed.value, [first, second])
    runs = [ScriptRun(e.path, Outcome.OK, 0, "one 1.5\n", "", 0.0) for e in extract(course).value]
    results = Results(tuple(runs), verify(course, runs), (), (), "3", "3")
    library = library_of(course, results)
    found: list[object] = [bool(check_course(course))]
    for page in page_list(library):
        if page.id != "1.1":
            try:
                found.append((page.path, fingerprint(page.inputs(library))))
            except (KeyError, StopIteration) as error:  # a link or model that is nowhere
                found.append((page.path, repr(error)))
    return found


@given(st.lists(st.sampled_from(PARTS), max_size=5), st.data())
@settings(max_examples=40)
def test_documents_of_one_fingerprint_are_seen_alike(parts: list[str], data: st.DataObject) -> None:
    other: list[str] = []
    for part in data.draw(st.one_of(st.just(parts), st.permutations(parts))):
        other += [*data.draw(st.lists(st.sampled_from(PROSE), max_size=2)), part]
    one, two = (summarized(document("content/0.md", "".join(text))) for text in (parts, other))
    if document_fingerprint(one) == document_fingerprint(two):
        assert seen_elsewhere(one) == seen_elsewhere(two)


SEEN = [
    ("{#here}", "{#there}"),
    ("lesson:1.2#here", "lesson:1.1#here"),
    ("<b id=b>", "<b id=c>"),
    ('href="#gone"', 'href="#raw"'),
    ("[thing]{term}", "[thing]{term=sing}"),
    ("{#eq:a}", "{#eq:b}"),
    ("print(2)", "print(3)"),
    ("| x | 1 |", "| x | 2 |"),
    ("<mujoco/>", "<mujoco />"),
    ('"id": "q"', '"id": "r"'),
    ('"model": "box"', '"model": "ball"'),
    ("bench box", "bench arm"),
    ("[!note]", "[!warning]"),
    ("![p](p.png)", "![p](q.png)"),
]


def test_fingerprint_changes_with_what_others_see_and_not_with_prose() -> None:
    text = "".join(PARTS)

    def of(text: str) -> str:
        return document_fingerprint(summarized(document("content/0.md", text)))

    assert of("Plain words.\n\n" + text) == of(text) == of(text + "Plain words.\n")
    assert all(old in text for old, _ in SEEN)
    assert [new for old, new in SEEN if of(text.replace(old, new, 1)) == of(text)] == []
