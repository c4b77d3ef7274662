"""Documents of one face are the same to the rest of their course, wherever things stand in them."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.checks.course import check_course
from coursebuild.core.model import Course, Document
from coursebuild.core.model.results import Outcome, Results, ScriptRun
from coursebuild.core.model.summary import without_prose
from coursebuild.core.pages.lookup.lexicon import lexicon
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.extract import extract
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.text.source import Source
from coursebuild.core.values import fingerprint
from coursebuild.numerics.reports import Reports
from coursebuild.pipeline.fingerprints import (
    course_fingerprint,
    document_fingerprint,
    results_fingerprint,
)
from support.summary_lessons import MAP, PARTS, document, library_of, with_documents

pytestmark = pytest.mark.site

PROSE = ["Plain words.\n\n", "More of *them*, `code`.\n\n", "- a\n- b\n\n", "***\n\n", "\n"]
SECOND = "".join(PARTS[:9])


def bare(text: str) -> Document:
    whole = document("content/0.md", text)
    return replace(without_prose(whole), lexicon=lexicon(whole, {}))


def course_of(first: Document) -> Course:
    parsed = parse_course_map(Source("content/course.toml", MAP))
    assert parsed.value is not None
    second = document("content/1.md", SECOND)
    second = replace(without_prose(second), lexicon=lexicon(second, {}))
    return with_documents(parsed.value, [first, second])


def results_of(course: Course) -> Results:
    runs = [ScriptRun(e.path, Outcome.OK, 0, "one 1.5\n", "", 0.0) for e in extract(course).value]
    return Results(tuple(runs), verify(course, runs), (), (), "3", "3")


def seen_elsewhere(course: Course) -> list[object]:
    """What is seen of the first lesson by others: other pages, and whether anything is wrong."""
    library = library_of(course, results_of(course))
    found: list[object] = [bool(check_course(course))]
    for page in page_list(library):
        if page.id != "1.1":
            try:
                found.append((page.path, fingerprint(page.inputs(library))))
            except (KeyError, StopIteration) as error:  # a link or model that is nowhere
                found.append((page.path, repr(error)))
    return found


@given(st.lists(st.sampled_from(PARTS), max_size=5), st.data())
@settings(max_examples=60)
def test_what_has_one_face_is_seen_alike(parts: list[str], data: st.DataObject) -> None:
    other: list[str] = []
    for part in data.draw(st.one_of(st.just(parts), st.permutations(parts))):
        other += [*data.draw(st.lists(st.sampled_from(PROSE), max_size=2)), part]
    one, two = bare("".join(parts)), bare("".join(other))
    if document_fingerprint(one) == document_fingerprint(two):
        assert seen_elsewhere(course_of(one)) == seen_elsewhere(course_of(two))


def test_prose_moves_things_and_changes_no_face() -> None:
    text = "".join(PARTS)
    moved = document_fingerprint(bare("Plain words.\n\n" + text))
    assert (
        moved
        == document_fingerprint(bare(text))
        == document_fingerprint(bare(text + "Plain words.\n"))
    )


@pytest.mark.parametrize(
    ("old", "new"),
    [
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
    ],
)
def test_what_others_see_changes_the_face(old: str, new: str) -> None:
    text = "".join(PARTS)
    assert old in text
    assert document_fingerprint(bare(text)) != document_fingerprint(bare(text.replace(old, new, 1)))


def test_the_face_of_a_course() -> None:
    first = bare(PARTS[0])
    course = course_of(first)
    fingerprints = [(document, document_fingerprint(document)) for document in course.documents]
    face = course_fingerprint(course, fingerprints)
    assert face is not None
    moved = course_of(bare(PROSE[0] + PARTS[0]))
    again = [(document, document_fingerprint(document)) for document in moved.documents]
    assert course_fingerprint(moved, again) == face
    assert course_fingerprint(replace(course, title="Other"), fingerprints) != face
    assert course_fingerprint(replace(course, files=("content/a.png",)), fingerprints) != face
    assert course_fingerprint(course, fingerprints[1:]) is None  # one that is not known has none
    assert course_fingerprint(course, [(document, "") for document, _ in fingerprints]) is None


def test_the_face_of_results() -> None:
    course = course_of(bare("".join(PARTS)))
    results = results_of(course)
    face = results_fingerprint(results, Reports())
    slower = tuple(replace(run, seconds=9.0) for run in results.runs)
    assert results_fingerprint(replace(results, runs=slower), Reports()) == face
    other = (replace(results.runs[0], stdout="two\n"), *results.runs[1:])
    assert results_fingerprint(replace(results, runs=other), Reports()) != face
    assert results_fingerprint(replace(results, engine="4"), Reports()) != face
    verdicts = tuple(replace(v, status="drift") for v in results.verdicts)
    assert results_fingerprint(replace(results, verdicts=verdicts), Reports()) != face
    models = (("box", None),)
    assert results_fingerprint(replace(results, models=models), Reports()) != face  # type: ignore[arg-type]


_PRINTED = """
import sys
{first}
from coursebuild.pipeline.fingerprints import results_fingerprint
from coursebuild.numerics.reports import Reports
from coursebuild.core.model.results import Outcome, Results, ScriptRun
run = ScriptRun("a.py", Outcome.OK, 0, "one", "", 0.0)
print(results_fingerprint(Results((run,), (), (), (), "3", "3"), Reports()))
"""


def test_a_face_does_not_depend_on_what_else_is_imported() -> None:
    """It is compared with that of an earlier process."""
    fingerprints = set()
    for seed, first in enumerate(("", "import coursebuild.pipeline.build", "import decimal")):
        done = subprocess.run(
            [sys.executable, "-c", _PRINTED.format(first=first)],
            env={**os.environ, "PYTHONHASHSEED": str(seed)},
            capture_output=True,
            check=True,
            text=True,
        )
        fingerprints.add(done.stdout)
    assert len(fingerprints) == 1
