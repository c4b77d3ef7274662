"""Labs against the course: their kinds and their models."""

from __future__ import annotations

import pytest

from coursebuild.features.lab.checks import check_labs, lab_kinds
from support.made_courses import BOX, make_course, said, told

OWN = ("content/labs/pendulum.js", "content/labs/deep/hidden.js", "content/labs/notes.md")


def findings(fence: str, files: tuple[str, ...] = OWN) -> list[str]:
    course = make_course(f"```lab{fence}\n```\n", models={"box": BOX}, files=files)
    found = tuple(check_labs(course, course.documents))
    assert len(told(found)) == len(said(found))
    return [f"{a}; {b}" for a, b in zip(told(found), said(found), strict=True)]


def test_a_course_has_the_kinds_of_its_own_scripts_beside_the_built_in_one() -> None:
    assert lab_kinds(make_course()) == {"mjcf", "simlab"}
    files = (*OWN, "content/labs/x.js", "content/other.js", "content/labs/.js.txt")
    assert lab_kinds(make_course(files=files)) == {"mjcf", "simlab", "pendulum", "x"}


@pytest.mark.parametrize(
    "fence", ['\n{"model": "box"}', ' simlab\n{"xml": "<mujoco/>"}', " pendulum\n{}"]
)
def test_a_lab_of_a_known_kind_with_a_known_model_is_good(fence: str) -> None:
    assert findings(fence) == []
