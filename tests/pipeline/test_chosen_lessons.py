"""`check LESSON`: all that it uses is checked, and the last line claims no more than ran."""

from __future__ import annotations

import json

import pytest

from support.scratch_course import FIRST, SECOND, Make, block

BALL = (
    '<mujoco>\n<worldbody>\n<body name="ball">\n<freejoint/>\n<geom size="0.1"/>\n</body>\n'
    "</worldbody>\n</mujoco>\n"
)
BROKEN = BALL.replace("<freejoint/>", '<joint type="hinje"/>')
INCLUDING = '<mujoco>\n<include file="part.xml"/>\n</mujoco>\n'
LAB = '```lab simlab\n{"model": "ball", "title": "A ball"}\n```\n'
OPENS = """import mujoco
from mjcourse.paths import model_path
mujoco.MjModel.from_xml_path(str(model_path("ball")))
print(1)
"""
USES = {
    "a script": (block("u.py", OPENS, "1"), {"models/ball.xml": BROKEN}, "model-error"),
    "a lab": (LAB, {"models/ball.xml": BROKEN}, "model-error"),
    "a link": ("See [it](model:ball).\n", {"models/ball.xml": BROKEN}, "model-error"),
    "a part of a model": (
        "See [it](model:ball).\n",
        {"models/ball.xml": INCLUDING, "models/part.xml": BROKEN},
        "model-error",
    ),
    "a script that is not run": (
        block("u.py", OPENS, info="norun"),
        {"models/ball.xml": BROKEN},
        "model-error",
    ),
    "a helper": (
        block("u.py", "import other\n", "1"),
        {"content/lessons/1.2-two.md": "## Two\n\n" + block("other.py", "1 / 0\n")},
        "script-failed",
    ),
}


@pytest.mark.parametrize("use", USES)
def test_errors_in_what_a_lesson_uses_are_errors_of_the_lesson(make: Make, use: str) -> None:
    text, files, rule = USES[use]
    folder = make(f"## One\n\n{text}", SECOND)
    for path, content in files.items():
        folder.write(path, content)
    result = folder.main("check", "1.1")
    assert (result.status, f"error[{rule}]" in result.out) == (1, True), result.out
    assert "holds" not in result.out.splitlines()[-1]


def test_hints_on_a_model_that_a_lesson_uses_are_told_with_it(make: Make) -> None:
    folder = make("## One\n\nSee [it](model:ball).\n", SECOND)
    hinge = '<joint type="hinge" range="-1.5708 1.5708"/>'
    folder.write("models/ball.xml", BALL.replace("<freejoint/>", hinge))
    texts = [folder.main("check", lesson, "--hints").out for lesson in ("1.1", "1.2")]
    assert ["hint[angle-unit]" in text for text in texts] == [True, False]


def test_errors_in_what_a_lesson_does_not_use_are_none_of_its(make: Make) -> None:
    folder = make(FIRST, "## Two\n\n" + block("two.py", "print(2)", "3") + LAB)
    folder.write("models/ball.xml", BROKEN)
    result = folder.main("check", "1.1")
    assert (result.status, result.out.splitlines()[-1]) == (
        0,
        "1 lesson, 1 script run: everything holds",
    )


def test_update_of_a_lesson_tells_no_mistakes_of_others(make: Make) -> None:
    folder = make("## One\n\n" + block("one.py", "print(1)", "0"), "## Two\n\n[x](nowhere.md)\n")
    assert folder.main("update", "1.1").status == 0
    result = folder.main("update", "1.2")
    assert (result.status, "error[link-file]" in result.out) == (1, True), result.out


def test_a_script_that_fails_by_a_fragment_of_a_model_is_reported(make: Make) -> None:
    """A fragment that compiles only where it is included has no mistake of its own."""
    opens = OPENS.replace('"ball"', '"part"')
    folder = make("## One\n\n" + block("u.py", opens, "1") + "See [it](model:ball).\n")
    folder.write("models/ball.xml", INCLUDING)
    folder.write("models/part.xml", "<mujocoinclude>\n<worldbody/>\n</mujocoinclude>\n")
    result = folder.main("check", "1.1")
    assert (result.status, "error[script-failed]" in result.out) == (1, True), result.out


def test_a_lab_that_was_not_tried_is_listed_in_every_format(make: Make) -> None:
    folder = make("## One\n\n" + LAB)
    folder.write("models/ball.xml", BROKEN)
    result = folder.main("check", "1.1")
    assert "untried  1.1-lab-1  (other mistakes)\n" in result.out
    assert result.out.endswith(": 1 error, and 1 lab that was not tried (other mistakes)\n"), (
        result.out
    )
    report = json.loads(folder.main("check", "1.1", "--format", "json").out)
    assert (report["summary"]["ok"], report["summary"]["untried"]) == (False, 1)
    assert '<skipped message="other mistakes"' in folder.main("check", "--format", "junit").out


def test_a_lab_of_a_kind_of_the_course_is_not_said_to_hold(make: Make) -> None:
    folder = make('## One\n\n```lab dial\n{"title": "A dial"}\n```\n')
    folder.write("content/labs/dial.js", "export default () => {};\n")
    result = folder.main("check").require_success()
    assert result.out.splitlines()[-1] == (
        "1 lesson, 0 scripts run: holds, but for 1 lab that was not tried (a kind of the course's)"
    )


def test_a_quoted_script_of_another_lesson_that_was_left_out_is_a_mistake(make: Make) -> None:
    folder = make(FIRST, "## Two\n\nIt is `1`{out=examples/one.py}.\n")
    assert folder.main("check").status == 0
    folder.write("examples/one.py", "print(7)\n")
    result = folder.main("check", "1.2")
    assert (result.status, "error[example-edited]" in result.out) == (1, True), result.out
    assert "blocked  examples/one.py" in result.out


def test_a_quoted_script_that_has_drifted_is_a_mistake(make: Make) -> None:
    folder = make(
        "## One\n\n" + block("one.py", "print('at', 1)\nprint(41)", "at 2\n41"),
        "## Two\n\nIt is `41`{out=examples/one.py}.\n",
    )
    result = folder.main("check", "1.2")
    assert (result.status, "error[output-drift]" in result.out) == (1, True), result.out
