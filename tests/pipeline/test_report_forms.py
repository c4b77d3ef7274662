"""How much is said, and in which form."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable

import pytest

from support.scratch_course import (
    DRIFTED,
    FIRST,
    GOOD,
    SECOND,
    Folder,
    block,
    without_seconds,
)

pytestmark = pytest.mark.site

Make = Callable[..., Folder]


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


def test_as_many_scripts_run_at_once_as_jobs(make: Make) -> None:
    meet = """
import pathlib, sys, time
mine, other = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
mine.touch()
for _ in range(12_000):
    if other.exists():
        break
    time.sleep(0.01)
else:
    sys.exit("alone")
"""
    folder = make(
        "## Two that meet\n\n"
        + block("a.py", meet, info='args="../met-a ../met-b" timeout=300')
        + block("b.py", meet, info='args="../met-b ../met-a" timeout=300')
    )
    assert folder.main("check", "--jobs", "2").status == 0


def test_json_report_of_drift(make: Make) -> None:
    folder = make(DRIFTED + block("skipped.py", "pass", info="requires=no_such_module"))
    done = folder.main("check", "--format", "json")
    assert done.status == 1
    found = json.loads(done.out)
    assert {"diagnostics", "scripts", "summary"} <= found.keys()
    [drift] = found["diagnostics"]
    keys = "rule severity path line column end_line end_column message help notes"
    assert set(keys.split()) <= set(drift)
    line = folder.text(folder.lesson()).splitlines().index("value 1.35") + 1
    assert drift["rule"] == "output-drift"
    assert drift["severity"] == "error"
    assert drift["path"] == folder.lesson()
    assert (drift["line"], drift["column"]) == (line, 7)
    assert (drift["end_line"], drift["end_column"]) == (line, 11)
    assert drift["message"] and drift["help"] and isinstance(drift["notes"], list)
    ran, skipped = found["scripts"]
    assert list(ran) == ["path", "lesson", "status", "seconds", "cached", "missing"]
    assert (ran["path"], ran["lesson"], ran["status"]) == ("examples/one.py", "1.1", "drift")
    assert ran["seconds"] > 0 and ran["cached"] is False
    assert skipped["status"] == "skipped"
    summary = found["summary"]
    assert (summary["ok"], summary["errors"], summary["ran"]) == (False, 1, 1)
    assert (summary["lessons"], summary["scripts"], summary["skipped"]) == (1, 2, 1)


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


def test_other_forms_of_a_report_of_drift(make: Make) -> None:
    folder = make(DRIFTED)

    def shown(form: str) -> str:
        done = folder.main("check", "--format", form)
        assert done.status == 1
        return done.out

    suite = ET.fromstring(shown("junit"))[0]
    assert {key: suite.get(key) for key in ("tests", "failures")} == {"tests": "2", "failures": "2"}
    [script, lesson] = suite
    assert script.get("name") == "examples/one.py"
    failure = lesson.find("failure")
    assert failure is not None and failure.get("type") == "output-drift"
    [run] = json.loads(shown("sarif"))["runs"]
    [result] = run["results"]
    assert result["ruleId"] == "output-drift"
    place = result["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == folder.lesson()
    assert place["region"]["startColumn"] == 7
    [line] = shown("github").splitlines()
    assert line.startswith(f"::error file={folder.lesson()},line=")
    folder.write(folder.lesson(), GOOD)
    assert folder.main("check", "--format", "github").out == ""


def test_everything_wrong_is_told_at_once(make: Make) -> None:
    folder = make(
        DRIFTED + "> [!nosuch]\n> Text.\n\n$\\frac{1$\n",
        "# Two\n\n" + block("two.py", "raise SystemExit(3)") + "[x](lesson:8.8)\n",
    )
    folder.write("models/m.xml", "<mujoco><worldbody><geom/></worldbody></mujoco>")
    folder.write("content/lessons/9.9-stray.md", "## Stray\n\n```io\nINPUT: x\nPROCESS: y\n```\n")
    done = folder.main("check", "--format", "json")
    assert done.status == 1
    found = json.loads(done.out)["diagnostics"]
    assert [(d["path"].rpartition("/")[2], d["rule"]) for d in found] == [
        ("1.1-one.md", "output-drift"),
        ("1.1-one.md", "callout-unknown"),
        ("1.1-one.md", "math-syntax"),
        ("1.2-two.md", "heading-top"),
        ("1.2-two.md", "script-failed"),
        ("1.2-two.md", "link-lesson"),
        ("9.9-stray.md", "lesson-unlisted"),
        ("9.9-stray.md", "io-missing"),
        ("m.xml", "model-error"),
    ]
