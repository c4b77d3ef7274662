"""How much is said, and in which form."""

from __future__ import annotations

import json
import re

import pytest

from support.scratch_course import (
    DRIFTED,
    FIRST,
    GOOD,
    SECOND,
    Make,
    block,
    without_seconds,
)

pytestmark = pytest.mark.site


def test_quiet_says_what_is_wrong_and_no_more(make: Make) -> None:
    folder = make(DRIFTED, GOOD + "![](../pic.png)\n\n#### Skipped\n")
    folder.write("content/pic.png", "")
    for command in ("build", "check"):
        done = folder.main(command, "-q")
        assert (done.status, done.err) == (1, "")
        assert done.out.startswith("error[output-drift]: ")
        assert "warning[heading-skip]" in done.out
        assert "examples/one.py  " not in done.out
        assert "published" not in done.out


def test_plain_lines_say_what_runs_and_what_ran(make: Make) -> None:
    done = make(FIRST, SECOND).main("check", "--jobs", "1")
    assert without_seconds(done.err) == (
        "reading lessons and pages\n"
        "running scripts (2)\n"
        "  examples/one.py\n"
        "  examples/one.py: ok after # s\n"
        "  examples/two.py\n"
        "  examples/two.py: ok after # s\n"
    )
    assert without_seconds(done.out) == (
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
    folder.write("docs/guide.md", "One.\n")  # read apart from the lessons, and told with them
    done = folder.main("build")
    said = done.err.splitlines()
    assert said[:2] == ["reading lessons and pages", "compiling models"]
    assert said[2:4] == ["trying labs", "drawing pages"], "the model's own page has a lab"
    assert said[-1] == "publishing"
    assert re.search("^published [0-9]+ files in public$", done.out, re.MULTILINE)


def test_json_of_a_clean_course_tells_what_ran_and_of_a_broken_map_the_mistake(make: Make) -> None:
    folder = make(GOOD)
    for ran, cached in ((1, 0), (0, 1)):
        done = folder.main("check", "--format", "json", "--quiet")
        assert (done.status, done.err) == (0, "")
        found = json.loads(done.out)
        assert (found["diagnostics"], found["summary"]["ok"]) == ([], True)
        assert (found["summary"]["ran"], found["summary"]["cached"]) == (ran, cached)
    folder.write("content/course.toml", "[course\n")
    done = folder.main("check", "--format", "json")
    assert done.status == 1
    found = json.loads(done.out)
    assert ([d["rule"] for d in found["diagnostics"]], found["scripts"]) == (["map-syntax"], [])


def test_json_is_utf8_whatever_the_locale(make: Make) -> None:
    folder = make("## Größe\n\n" + block("größe.py", "print('値')", "值"))
    environment = {"LC_ALL": "C", "LANG": "C", "PYTHONIOENCODING": "ascii"}
    done = folder.run("check", "--format", "json", env=environment)
    assert done.status == 1
    assert "examples/größe.py" in done.out
    assert json.loads(done.out)["scripts"][0]["path"] == "examples/größe.py"
