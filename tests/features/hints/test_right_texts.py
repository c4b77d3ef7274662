"""Right texts: nothing in them is an error or a warning, whatever their language and subject.

`slips.md` has wrong ones, and says of each whether it is an error, a hint or silence.

`cases.txt` has a case below each line `=== name`, and `prose.md` three pages; `sentences.md` has a
text in each paragraph. They are lessons of one course that has a script with MuJoCo, so that its
names are known. What holds formulas is checked with `check`, which typesets them, elsewhere.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from coursebuild.core.model.course import CALLOUTS
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.hints import unread_marks
from support.fixture_cases import FIXTURES, check_lines, fixture_text, input_lines
from support.scratch_course import Folder, block

ROOT = Path(__file__).parents[3]
MakeCourse = Callable[..., Folder]
SIMULATION = """import mujoco

model = mujoco.MjModel.from_xml_string("<mujoco/>")
data = mujoco.MjData(model)
print(data.time)"""


def right_texts() -> Iterator[tuple[str, str]]:
    """Each text with its name."""
    for case in re.split("^=== ", fixture_text("right_texts/cases.txt"), flags=re.MULTILINE)[1:]:
        name, _, text = case.partition("\n")
        yield name, f"## A heading\n\n{text}"
    for name in ("sentences", "prose"):
        yield name, fixture_text(f"right_texts/{name}.md")


def this_repository() -> Iterator[tuple[str, str]]:
    """The lessons and the manual, which are right texts as well."""
    for folder in ("content", "docs"):
        for path in sorted((ROOT / folder).rglob("*.md")):
            if {"public", ".coursebuild"} & {*path.relative_to(ROOT).parts}:  # a built site
                continue
            yield path.relative_to(ROOT).as_posix(), path.read_text("utf-8")


@pytest.mark.site
def test_right_texts_are_read_without_a_mistake_or_a_hint() -> None:
    """As far as parsing goes, so that formulas are not typeset."""
    failures, count = {}, 0
    for name, text in (*right_texts(), *this_repository()):
        path = name if name.endswith(".md") else "content/lessons/1.1-x.md"
        is_lesson = "/lessons/" in path
        document = parse_document(Source(path, text), frozenset(CALLOUTS), lesson=is_lesson)
        diagnostics = [*document.diagnostics, *unread_marks(document.value)]
        if diagnostics:
            failures[name] = [f"{d.rule} {d.span.line}: {d.span.text!r}" for d in diagnostics]
        count += len(re.findall("^.+$", text, re.MULTILINE))
    assert failures == {}
    assert count > 500


@pytest.mark.site
def test_names_in_right_texts_are_no_mistakes(make_course: MakeCourse) -> None:
    """In a course about MuJoCo, whose scripts make a model and its data."""
    texts = [text for _, text in right_texts() if "$$" not in text and not re.search(r"\$\S", text)]
    sentences = re.sub(r"^.*\$.*$", "", fixture_text("right_texts/sentences.md"), flags=re.M)
    course = make_course("\n\n".join([*texts, sentences]), block("m.py", SIMULATION, "0.0"))
    report = json.loads(course.main("check", "--format", "json", "-q").out)
    assert report["diagnostics"] == []


@pytest.mark.site
def test_formulas_of_right_prose_hold(make_course: MakeCourse) -> None:
    course = make_course(fixture_text("right_texts/prose.md"))
    report = json.loads(course.main("check", "--format", "json", "-q").out)
    assert report["diagnostics"] == []


@pytest.mark.site
def test_slips_of_edited_books_are_told_where_they_are_certain(
    make_course: MakeCourse, rewriting: bool
) -> None:
    path = FIXTURES / "right_texts/slips.md"
    places: dict[int, str] = {}
    text = f"## Slips\n\n{block('m.py', SIMULATION, '0.0')}\n"
    for slip in input_lines(path):
        start = text.count("\n") + 1
        text += f"{slip}\n\n"
        places |= dict.fromkeys(range(start, text.count("\n") + 1), slip)
    course = make_course(text)
    report = json.loads(course.main("check", "--hints", "--format", "json", "-q").out)
    verdicts: dict[str, set[str]] = {slip: set() for slip in places.values()}
    for entry in report["diagnostics"]:
        verdicts[places[entry["line"]]].add(f"{entry['severity']} {entry['rule']}")
    check_lines(path, lambda slip: sorted(verdicts[slip]) or ["silent"], rewriting=rewriting)
