"""Labs against the course: which kinds and models it has."""

from __future__ import annotations

from coursebuild.features.lab.checks import check_labs
from support.made_courses import BOX, make_course

FENCES = [
    '\n{"model": "box"}',
    ' simlab\n{"xml": "<mujoco/>"}',
    " mjcf\n<mujoco/>",
    " pendulum\n{}",
    " deep/hidden\n{}",
    " notes\n{}",
]


def test_kinds_of_labs_are_the_built_in_ones_and_scripts_in_the_folder_of_labs() -> None:
    files = ("pendulum.js", "deep/hidden.js", "notes.md", "notes.js.txt")
    course = make_course(
        "".join(f"```lab{fence}\n```\n" for fence in FENCES),
        models={"box": BOX},
        files=[f"content/labs/{name}" for name in files],
    )
    told = [diagnostic.message for diagnostic in check_labs(course, course.documents)]
    assert told == [f"no kind of lab is called `{name}`" for name in ("deep/hidden", "notes")]
