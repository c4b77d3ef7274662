"""Forms of reports, and how much they say."""

from __future__ import annotations

import json
import re

import pytest

from support.scratch_course import (
    DRIFTED_LESSON,
    FIRST,
    GOOD,
    SECOND,
    Make,
    block,
    without_seconds,
)

pytestmark = pytest.mark.site


def test_quiet_says_what_is_wrong_and_no_more(make: Make) -> None:
    folder = make(DRIFTED_LESSON, GOOD + "![](../pic.png)\n\n#### Skipped\n")
    folder.write("content/pic.png", "")
    for command in ("build", "check"):
        result = folder.main(command, "-q")
        assert (result.status, result.err) == (1, "")
        assert result.out.startswith("error[output-drift]: ")
        assert "warning[heading-skip]" in result.out
        assert "examples/one.py  " not in result.out
        assert "published" not in result.out


def test_plain_lines_say_what_runs_and_what_ran(make: Make) -> None:
    result = make(FIRST, SECOND).main("check", "--jobs", "1")
    assert without_seconds(result.err) == (
        "reading lessons and pages\n"
        "running scripts (2)\n"
        "  examples/one.py\n"
        "  examples/one.py: ok after # s\n"
        "  examples/two.py\n"
        "  examples/two.py: ok after # s\n"
    )
    assert without_seconds(result.out) == (
        "ok       examples/one.py  # s\n"
        "ok       examples/two.py  # s\n"
        "\n"
        "2 lessons, 2 scripts run: everything holds\n"
    )


def test_the_stages_of_a_build(make: Make) -> None:
    folder = make("## One $x$\n\n" + block("one.py", "print(1)", info="norun"))
    folder.write("models/m.xml", "<mujoco/>")
    page = '[[page]]\nid = "guide"\ntitle = "Guide"\nfile = "docs/guide.md"\n'
    folder.write("content/course.toml", folder.text("content/course.toml") + page)
    folder.write(
        "docs/guide.md", "One.\n"
    )  # pages elsewhere are read separately, but reported with the lessons
    result = folder.main("build")
    lines = result.err.splitlines()
    assert lines[:2] == ["reading lessons and pages", "compiling models"]
    assert lines[2:4] == ["trying labs", "drawing pages"], "the model's own page has a lab"
    assert lines[-1] == "publishing"
    assert re.search("^published [0-9]+ files in public$", result.out, re.MULTILINE)


def test_json_of_a_clean_course_tells_what_ran_and_of_a_broken_map_the_mistake(make: Make) -> None:
    folder = make(GOOD)
    for runs, cached_runs in ((1, 0), (0, 1)):
        result = folder.main("check", "--format", "json", "--quiet")
        assert (result.status, result.err) == (0, "")
        report = json.loads(result.out)
        assert (report["diagnostics"], report["summary"]["ok"]) == ([], True)
        assert (report["summary"]["ran"], report["summary"]["cached"]) == (runs, cached_runs)
    folder.write("content/course.toml", "[course\n")
    result = folder.main("check", "--format", "json")
    assert result.status == 1
    report = json.loads(result.out)
    assert ([d["rule"] for d in report["diagnostics"]], report["scripts"]) == (["map-syntax"], [])


def test_json_is_utf8_whatever_the_locale(make: Make) -> None:
    folder = make("## Größe\n\n" + block("größe.py", "print('値')", "值"))
    environment = {"LC_ALL": "C", "LANG": "C", "PYTHONIOENCODING": "ascii"}
    result = folder.run("check", "--format", "json", env=environment)
    assert result.status == 1
    assert "examples/größe.py" in result.out
    assert json.loads(result.out)["scripts"][0]["path"] == "examples/größe.py"
