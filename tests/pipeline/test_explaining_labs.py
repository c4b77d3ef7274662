"""Labs in `coursebuild explain`, their results shared, and a check of them in parts."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from support.fixture_cases import fixture_text
from support.scratch_course import GOOD, Folder, Make

pytestmark = pytest.mark.engine

BALL = """<mujoco><include file="part.xml"/><worldbody>
<body><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"""
PART = '<mujoco><option timestep="0.01"/></mujoco>'
LAB = fixture_text("documents/explained_lab.md")
INLINE = fixture_text("documents/explained_inline_lab.md")


@pytest.fixture
def course(make: Make) -> Folder:
    folder = make(GOOD + LAB + INLINE)
    folder.write("models/ball.xml", BALL)
    folder.write("models/part.xml", PART)
    return folder


def explain(folder: Folder, path: str) -> str:
    result = folder.main("explain", path)
    assert (result.status, result.err) == (0, "")
    return result.out


def tried_labs(folder: Folder, *arguments: str) -> list[str]:
    """The labs that were tried, without those with a stored result."""
    result = folder.main("check", "--format", "json", *arguments)
    return [lab["name"] for lab in json.loads(result.out)["labs"] if not lab["cached"]]


def test_explain_says_which_labs_would_be_tried_and_why(course: Folder) -> None:
    unknown = "  because there is no result of it on this machine\n"
    assert explain(course, "1.1") == (
        "content/lessons/1.1-one.md: 1 script and 2 labs, of which 3 would run\n\n"
        f"examples/hello.py would run\n{unknown}\n"
        f"1.1-lab-1 would be tried\n{unknown}\n"
        f"1.1-lab-2 would be tried\n{unknown}"
    )
    assert explain(course, "1.1-lab-2") == (
        f"1.1-lab-2 would be tried\n{unknown}  of 1.1, not run yet on this machine\n"
    )
    assert course.main("explain", "1.1-lap-2").err == (
        "coursebuild: nothing in this course is called `1.1-lap-2`; did you mean `1.1-lab-2`?\n"
    )
    assert tried_labs(course) == ["1.1-lab-1", "1.1-lab-2"]
    assert "1 script and 2 labs, of which none would run\n" in explain(course, "1.1")
    assert explain(course, "1.1-lab-2").startswith("1.1-lab-2 is remembered\n")
    assert tried_labs(course) == []
    # A part of both models; that of the second lab stands in the lesson.
    course.write("models/part.xml", PART.replace("0.01", "0.02"))
    text = explain(course, "models/part.xml")
    assert re.sub(r" +", " ", text) == (
        "models/part.xml\n\n"
        "is a part of:\n models/ball.xml\n\n"
        "depending on it:\n"
        " 1.1-lab-1 would be tried again\n because models/part.xml changed\n"
        " 1.1-lab-2 would be tried again\n because models/part.xml changed\n"
        " model-part would be tried\n because there is no result of it on this machine\n"
    )
    assert tried_labs(course) == ["1.1-lab-1", "1.1-lab-2"]
    course.write("models/part.xml", PART)
    assert tried_labs(course) == [], "this was so before"
    course.replace(course.lesson(), '"title": "Fall"', '"title": "Falling"')
    assert "of which none would run" in explain(course, "1.1")
    course.replace(course.lesson(), "data.qpos[2]", "data.qpos[1]")
    again = "1.1-lab-1 would be tried again\n  because its text changed\n"
    assert again in explain(course, "1.1")
    assert tried_labs(course) == ["1.1-lab-1"]
    assert tried_labs(course, "--no-cache") == ["1.1-lab-1", "1.1-lab-2"]
    assert tried_labs(course) == []


def test_labs_are_shared_and_divided(
    course: Folder, make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared = str(tmp_path / "shared")
    parts = [tried_labs(course, "--cache", shared, "--shard", f"{part}/2") for part in (1, 2)]
    assert sorted(parts[0] + parts[1]) == ["1.1-lab-1", "1.1-lab-2"]
    second = make(GOOD + LAB + INLINE, name="other")
    second.write("models/ball.xml", BALL)
    second.write("models/part.xml", PART)
    monkeypatch.setenv("COURSEBUILD_CACHE", shared)
    assert tried_labs(second) == []
