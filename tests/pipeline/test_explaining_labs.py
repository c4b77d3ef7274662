"""Labs in `coursebuild explain`, their results shared, and a check of them in parts."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from support.scratch_course import GOOD, Folder, Make

pytestmark = pytest.mark.engine

BALL = """<mujoco><include file="part.xml"/><worldbody>
<body><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"""
PART = '<mujoco><option timestep="0.01"/></mujoco>'
LAB = """```lab simlab
{"model": "ball", "title": "Fall", "verify": {"seconds": 0.1},
 "readouts": [{"label": "height", "expr": "data.qpos[2]"}]}
```

"""
INLINE = """```lab simlab
{"xml": "<mujoco><include file='part.xml'/><worldbody><body><freejoint/><geom size='1'/></body>\
</worldbody></mujoco>", "verify": {"seconds": 0.1}}
```

"""


@pytest.fixture
def course(make: Make) -> Folder:
    folder = make(GOOD + LAB + INLINE)
    folder.write("models/ball.xml", BALL)
    folder.write("models/part.xml", PART)
    return folder


def explained(folder: Folder, path: str) -> str:
    done = folder.main("explain", path)
    assert (done.status, done.err) == (0, "")
    return done.out


def tried(folder: Folder, *arguments: str) -> list[str]:
    """The labs that were tried, and not taken from the store."""
    done = folder.main("check", "--format", "json", *arguments)
    return [lab["name"] for lab in json.loads(done.out)["labs"] if not lab["cached"]]


def test_explain_says_which_labs_would_be_tried_and_why(course: Folder) -> None:
    unknown = "  because there is no result of it on this machine\n"
    assert explained(course, "1.1") == (
        "content/lessons/1.1-one.md: 1 script and 2 labs, of which 3 would run\n\n"
        f"examples/hello.py would run\n{unknown}\n"
        f"1.1-lab-1 would be tried\n{unknown}\n"
        f"1.1-lab-2 would be tried\n{unknown}"
    )
    assert explained(course, "1.1-lab-2") == (
        f"1.1-lab-2 would be tried\n{unknown}  of 1.1, not run yet on this machine\n"
    )
    assert course.main("explain", "1.1-lap-2").err == (
        "coursebuild: nothing of this course is called `1.1-lap-2`; did you mean `1.1-lab-2`?\n"
    )
    assert tried(course) == ["1.1-lab-1", "1.1-lab-2"]
    assert "1 script and 2 labs, of which none would run\n" in explained(course, "1.1")
    assert explained(course, "1.1-lab-2").startswith("1.1-lab-2 is remembered\n")
    assert tried(course) == []
    # A part of both models: the second lab's stands in the lesson.
    course.write("models/part.xml", PART.replace("0.01", "0.02"))
    told = explained(course, "models/part.xml")
    assert re.sub(r" +", " ", told) == (
        "models/part.xml\n\n"
        "is a part of:\n models/ball.xml\n\n"
        "depending on it:\n"
        " 1.1-lab-1 would be tried again\n because models/part.xml changed\n"
        " 1.1-lab-2 would be tried again\n because models/part.xml changed\n"
        " model-part would be tried\n because there is no result of it on this machine\n"
    )
    assert tried(course) == ["1.1-lab-1", "1.1-lab-2"]
    course.write("models/part.xml", PART)
    assert tried(course) == [], "this was so before"
    course.replace(course.lesson(), '"title": "Fall"', '"title": "Falling"')
    assert "of which none would run" in explained(course, "1.1")
    course.replace(course.lesson(), "data.qpos[2]", "data.qpos[1]")
    again = "1.1-lab-1 would be tried again\n  because its text changed\n"
    assert again in explained(course, "1.1")
    assert tried(course) == ["1.1-lab-1"]
    assert tried(course, "--no-cache") == ["1.1-lab-1", "1.1-lab-2"]
    assert tried(course) == []


def test_labs_are_shared_and_divided(
    course: Folder, make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared = str(tmp_path / "shared")
    parts = [tried(course, "--cache", shared, "--shard", f"{part}/2") for part in (1, 2)]
    assert sorted(parts[0] + parts[1]) == ["1.1-lab-1", "1.1-lab-2"]
    other = make(GOOD + LAB + INLINE, name="other")
    other.write("models/ball.xml", BALL)
    other.write("models/part.xml", PART)
    monkeypatch.setenv("COURSEBUILD_CACHE", shared)
    assert tried(other) == []
