"""Arguments, exit statuses, the choice of lessons, and the forms of a report."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import pytest
from coursekit import GOOD, ROOT, Done, Folder, block, without_seconds

Make = Callable[..., Folder]
FIRST = "## One\n\n" + block("one.py", "print(1)", "1")
SECOND = "## Two\n\n" + block("two.py", "print(2)", "2")
DRIFTED = "## One\n\n" + block("one.py", "print('value', 1.25)", "value 1.35", "digits")


# --- exit statuses


@pytest.mark.parametrize("command", ["build", "check", "update", "extract"])
def test_a_clean_course_gives_0(make: Make, command: str) -> None:
    done = make(GOOD).main(command)
    assert (done.status, done.out.splitlines()[-1].partition(": ")[2]) == (0, "everything holds")


@pytest.mark.parametrize("command", ["build", "check", "update", "extract"])
def test_a_mistake_in_the_course_gives_1(make: Make, command: str) -> None:
    done = make(GOOD + "> [!nosuch]\n> Text.\n").main(command)
    assert done.status == 1
    assert done.out.startswith("error[callout-unknown]: ")


@pytest.mark.parametrize("command", ["build", "check", "update", "extract"])
def test_a_folder_without_a_map_gives_1(make: Make, command: str) -> None:
    folder = make(GOOD)
    (folder.root / "content/course.toml").unlink()
    done = folder.main("-C", str(folder.root), command)
    assert done.status == 1
    assert done.out.startswith("error[map-missing]: ")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "the following arguments are required: COMMAND"),
        (["publish"], "invalid choice: 'publish'"),
        (["check", "--nosuch"], "unrecognized arguments: --nosuch"),
        (["che"], "invalid choice: 'che'"),
        (["check", "--form", "json"], "unrecognized arguments: --form"),
        (["check", "--format", "yaml"], "invalid choice: 'yaml'"),
        (["build", "extra"], "unrecognized arguments: extra"),
        (["extract", "--jobs", "2"], "unrecognized arguments: --jobs 2"),
        (["check", "--jobs", "0"], "'0' is no number of jobs: a whole number from 1"),
        (["check", "--jobs", "-1"], "'-1' is no number of jobs"),
        (["check", "--jobs", "2.5"], "'2.5' is no number of jobs"),
        (["check", "--jobs", "²"], "'²' is no number of jobs"),
        (["serve", "--port", "65536"], "'65536' is no port"),
        (["serve", "--port", "http"], "'http' is no port"),
        (["schema", "nosuch"], "invalid choice: 'nosuch'"),
        (["-C"], "expected one argument"),
        (["-C", "no/such", "check"], "there is no folder no/such"),
        (["-C", "content/course.toml", "check"], "content/course.toml is not a folder"),
        (["check", "1.2"], "no lesson or page is called `1.2`; did you mean `1.1`?"),
        (["check", "oen"], "no lesson or page is called `oen`; did you mean `one`?"),
        (["update", "1.1", "9.9.9"], "no lesson or page is called `9.9.9`"),
        (["build", "--out", "."], " is the project itself"),
        (["build", "--out", ".."], " holds the project"),
        (["build", "--out", "content/site"], "content/site lies in content/ of the project"),
        (["build", "--out", "content/course.toml"], "course.toml"),
    ],
)
def test_wrong_usage_gives_2_and_touches_nothing(
    make: Make, arguments: list[str], says: str
) -> None:
    folder = make(GOOD)
    before = folder.tree("content")
    done = folder.main(*arguments)
    assert (done.status, done.out) == (2, "")
    assert says in done.err
    assert "Traceback" not in done.err
    assert folder.tree("content") == before
    assert not (folder.root / "public").exists()


def test_outside_of_a_course_gives_2(tmp_path: Path) -> None:
    done = Folder(tmp_path).main("check")
    assert (done.status, done.out) == (2, "")
    assert "there is no content/course.toml in this folder or one above it" in done.err
    assert not any(tmp_path.iterdir())


def test_a_planned_lesson_cannot_be_checked(make: Make) -> None:
    folder = make(GOOD, SECOND)
    folder.replace("content/course.toml", 'two"\nstatus = "complete"', 'two"\nstatus = "planned"')
    (folder.root / folder.lesson(2)).unlink()
    done = folder.main("check", "1.2")
    assert (done.status, done.out) == (2, "")
    assert "lesson 1.2 is planned, so there is nothing in it yet" in done.err


@pytest.mark.parametrize("arguments", [["--help"], ["check", "--help"], ["--version"]])
def test_asking_for_help_gives_0(tmp_path: Path, arguments: list[str]) -> None:
    done = Folder(tmp_path).main(*arguments)
    assert (done.status, done.err) == (0, "")
    assert done.out


@pytest.mark.parametrize("name", ["quiz", "lab", "course"])
def test_schemas(tmp_path: Path, name: str) -> None:
    done = Folder(tmp_path).main("schema", name)
    assert done.status == 0
    schema = json.loads(done.out)
    assert "$defs" in schema or "properties" in schema


def test_as_a_module_of_python(make: Make) -> None:
    done = make(GOOD).run("check")
    assert (done.status, without_seconds(done.out)) == (
        0,
        "ok       examples/hello.py  # s\n\n1 lesson, 1 script run: everything holds\n",
    )


# --- where the course is


def test_a_course_is_found_from_below(make: Make) -> None:
    folder = make(GOOD)
    assert folder.main("check", cwd=folder.root / "content/lessons").status == 0


def test_c_takes_any_folder_from_anywhere(make: Make, tmp_path: Path) -> None:
    folder = make(GOOD, name="with spaces, quotes ' \" and ünïcödé 物理 🤖")
    elsewhere = tmp_path / "else where"
    elsewhere.mkdir()
    relative = os.path.relpath(folder.root, elsewhere)
    for where in (str(folder.root), relative, f"{relative}/", f"{folder.root}/content/.."):
        done = folder.run("-C", where, "build", cwd=elsewhere)
        assert done.status == 0, done.err
        assert (folder.root / "public/lessons/1.1-one.html").is_file()
    assert not any(elsewhere.iterdir())
    link = tmp_path / "link"
    link.symlink_to(folder.root)
    assert folder.main("-C", str(link), "check", cwd=elsewhere).status == 0
    done = folder.run("-C", str(folder.root), "build", "--out", "../a site/öut", cwd=elsewhere)
    assert done.status == 0
    assert (tmp_path / "a site/öut/index.html").is_file()


def test_a_folder_whose_name_is_not_utf8(make: Make) -> None:
    odd = make(GOOD).root.with_name("caf\udce9")
    make(GOOD, name="other").root.rename(odd)
    done = Folder(odd).run("build")
    assert (done.status, done.out) == (2, "")
    assert "the path of the course is not UTF-8: " in done.err
    assert "caf\\xe9" in done.err


def test_without_c_the_nearest_course_counts(make: Make) -> None:
    outer = make(GOOD)
    inner = Folder(outer.root / "inner")
    inner.write("content/course.toml", outer.text("content/course.toml"))
    inner.write(inner.lesson(), "## Inner\n\n" + block("inner.py", "print(1)", "1"))
    done = outer.main("check", cwd=inner.root / "content")
    assert "examples/inner.py" in done.out
    assert done.status == 0


# --- which lessons


@pytest.mark.parametrize(
    "name",
    [
        "1.1",
        "one",
        "1.1-one",
        "1.1-one.md",
        "content/lessons/1.1-one.md",
        "./content/lessons/1.1-one.md",
        "content/pages/../lessons/1.1-one.md",
        "ABSOLUTE",
    ],
)
def test_a_lesson_by_id_slug_and_file(make: Make, name: str) -> None:
    folder = make(FIRST, SECOND)
    name = str(folder.root / folder.lesson()) if name == "ABSOLUTE" else name
    done = folder.main("check", name)
    assert (done.status, without_seconds(done.out)) == (
        0,
        "ok       examples/one.py  # s\n\n1 lesson, 1 script run: everything holds\n",
    )


def test_a_file_from_where_one_stands(make: Make, tmp_path: Path) -> None:
    folder = make(FIRST, SECOND)
    inside = folder.root / "content/lessons"
    assert "examples/two.py" in folder.main("check", "1.2-two.md", cwd=inside).out
    assert "examples/two.py" in folder.main("check", "./1.2-two.md", cwd=inside).out
    other = tmp_path / "content/lessons/1.2-two.md"
    other.parent.mkdir(parents=True)
    other.write_text(SECOND)
    done = folder.main("check", str(other))
    assert (done.status, done.out) == (2, "")


def test_a_page_by_id_and_file(make: Make) -> None:
    folder = make(FIRST)
    map_ = folder.text("content/course.toml")
    page = '[[page]]\nid = "about"\ntitle = "About"\nfile = "content/pages/about.md"\n'
    folder.write("content/course.toml", map_ + page)
    folder.write("content/pages/about.md", "## About\n\n" + block("p.py", "print(5)", "6"))
    done = folder.main("check")
    assert "run `coursebuild update about`" in done.out
    assert folder.main("check", "1.1").status == 0
    assert folder.main("check", "content/pages/about.md").status == 1
    assert folder.main("update", "about").status == 0
    assert folder.main("check").status == 0


def test_several_lessons_stand_in_the_order_of_the_course(make: Make) -> None:
    done = make(FIRST, SECOND, GOOD).main("check", "three", "1.1", "1.1")
    assert [line.split()[1] for line in done.out.splitlines()[:2]] == [
        "examples/one.py",
        "examples/hello.py",
    ]
    assert "2 lessons, 2 scripts run" in done.out


def test_a_mistake_elsewhere_does_not_count(make: Make) -> None:
    folder = make(FIRST, SECOND + "[gone](lesson:7.7)\n")
    assert folder.main("check", "1.1").status == 0
    assert folder.main("check", "1.2").status == 1
    assert folder.main("check").status == 1


def test_a_mistake_in_the_map_always_counts(make: Make) -> None:
    folder = make(FIRST)
    folder.replace("content/course.toml", 'title = "Scratch"', 'title = "Scratch"\nsumary = ""')
    done = folder.main("check", "1.1")
    assert done.status == 1
    assert "error[field-unknown]: unknown field `sumary`" in done.out


def test_a_number_bound_to_another_lesson(make: Make) -> None:
    bound = "## Two\n\n" + block("two.py", "print(2)") + "It is `41`{out=examples/one.py}.\n"
    folder = make("## One\n\n" + block("one.py", "print(41)", "41"), bound)
    assert folder.main("check", "1.2").status == 0
    folder.write(folder.lesson(1), "## One\n\n" + block("one.py", "print(41)"))
    assert folder.main("check").status == 0
    assert folder.main("check", "1.2").status == 0
    folder.write(folder.lesson(1), "## One\n\n" + block("one.py", "print(42)"))
    assert "error[binding-mismatch]" in folder.main("check", "1.2").out
    folder.write(folder.lesson(1), "## One\n\n" + block("one.py", "print(41)\n1/0"))
    done = folder.main("check", "1.2")
    assert (done.status, "error[script-failed]" in done.out) == (1, True)


def test_a_question_about_a_script_of_another_lesson(make: Make) -> None:
    quiz = """## Two

```quiz
{"id": "q", "questions": [{"kind": "output", "q": "?", "of": "examples/one.py", "line": 2}]}
```
"""
    folder = make("## One\n\n" + block("one.py", "print(41)"), quiz)
    done = folder.main("check", "1.2")
    assert (done.status, "error[quiz-output]" in done.out) == (1, True)


def test_a_script_that_fails_in_a_sibling_of_another_lesson(make: Make) -> None:
    folder = make(
        "## One\n\n" + block("one.py", "def f(x):\n    return 1 / x"),
        "## Two\n\n" + block("two.py", "from one import f\n\nf(0)"),
    )
    done = folder.main("check", "1.2")
    assert done.status == 1
    assert "error[script-failed]: `examples/two.py` exited with status 1" in done.out


# --- nothing to do is a mistake


def test_a_check_that_runs_no_script(make: Make) -> None:
    folder = make("## Only text\n")
    done = folder.main("check")
    assert done.status == 1
    assert "error[no-scripts]: no script was run, so that nothing was verified" in done.out
    assert folder.main("build").status == 0


@pytest.mark.parametrize("info", ["norun", "requires=no_such_module"])
def test_a_check_whose_scripts_cannot_run(make: Make, info: str) -> None:
    done = make("## One\n\n" + block("one.py", "print(1)", info=info)).main("check", "1.1")
    assert done.status == 1
    assert "1.1 has none that can run here" in done.out


def test_no_script_because_of_another_mistake(make: Make) -> None:
    done = make("## One\n\n```python file=one.py\nprint(1)\n```\n").main("check")
    assert done.status == 1
    assert "no-scripts" not in done.out


@pytest.mark.parametrize("command", ["build", "check"])
def test_a_course_without_a_written_lesson(make: Make, command: str) -> None:
    folder = make()
    done = folder.main(command)
    assert done.status == 1
    assert "error[no-lessons]: no lesson of the course is written" in done.out
    assert "no-scripts" not in done.out
    assert not (folder.root / "public").exists()


# --- how much is said


@pytest.mark.parametrize("command", ["build", "check", "update", "extract"])
def test_quiet_says_nothing_when_all_is_well(make: Make, command: str) -> None:
    assert make(GOOD).main(command, "--quiet") == Done(0, "", "")


@pytest.mark.parametrize("command", ["build", "check"])
def test_quiet_says_what_is_wrong_and_no_more(make: Make, command: str) -> None:
    done = make(DRIFTED).main(command, "-q")
    assert (done.status, done.err) == (1, "")
    assert done.out.startswith("error[output-drift]: ")
    assert "examples/one.py  " not in done.out
    assert "published" not in done.out


def test_quiet_keeps_warnings(make: Make) -> None:
    done = make(GOOD + "![](../pic.png)\n\n#### Skipped\n").main("check", "-q")
    assert "warning[heading-skip]" in done.out


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
    done = folder.main("build")
    said = done.err.splitlines()
    assert said[:3] == ["reading lessons and pages", "compiling models", "drawing pages"]
    assert said[-1] == "publishing"
    assert re.search("^published [0-9]+ files in public$", done.out, re.MULTILINE)


def test_jobs_run_at_a_time(make: Make) -> None:
    meet = """
import pathlib, sys, time
mine, other = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
mine.touch()
for _ in range(600):
    if other.exists():
        break
    time.sleep(0.01)
else:
    sys.exit("alone")
"""
    folder = make(
        "## Two that meet\n\n"
        + block("a.py", meet, info='args="../met-a ../met-b" timeout=9')
        + block("b.py", meet, info='args="../met-b ../met-a" timeout=9')
    )
    assert folder.main("check", "--jobs", "2").status == 0


# --- forms


def test_json(make: Make) -> None:
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
    assert list(ran) == ["path", "lesson", "status", "seconds", "cached"]
    assert (ran["path"], ran["lesson"], ran["status"]) == ("examples/one.py", "1.1", "drift")
    assert 0 < ran["seconds"] < 60 and ran["cached"] is False
    assert skipped["status"] == "skipped"
    summary = found["summary"]
    assert (summary["ok"], summary["errors"], summary["ran"]) == (False, 1, 1)
    assert (summary["lessons"], summary["scripts"], summary["skipped"]) == (1, 2, 1)


def test_json_of_a_clean_course(make: Make) -> None:
    done = make(GOOD).main("check", "--format", "json", "--quiet")
    assert (done.status, done.err) == (0, "")
    found = json.loads(done.out)
    assert found["diagnostics"] == []
    assert found["summary"]["ok"] is True


def test_json_of_a_broken_map(make: Make) -> None:
    folder = make(GOOD)
    folder.write("content/course.toml", "[course\n")
    done = folder.main("check", "--format", "json")
    assert done.status == 1
    found = json.loads(done.out)
    assert [d["rule"] for d in found["diagnostics"]] == ["map-syntax"]
    assert found["scripts"] == []


def test_json_is_utf8_whatever_the_locale(make: Make) -> None:
    folder = make("## Größe\n\n" + block("größe.py", "print('値')", "值"))
    environment = {"LC_ALL": "C", "LANG": "C", "PYTHONIOENCODING": "ascii"}
    done = folder.run("check", "--format", "json", env=environment)
    assert done.status == 1
    assert "examples/größe.py" in done.out
    assert json.loads(done.out)["scripts"][0]["path"] == "examples/größe.py"


def test_junit(make: Make) -> None:
    done = make(DRIFTED).main("check", "--format", "junit")
    assert done.status == 1
    suite = ET.fromstring(done.out)[0]
    assert {key: suite.get(key) for key in ("tests", "failures")} == {"tests": "2", "failures": "2"}
    [script, lesson] = suite
    assert script.get("name") == "examples/one.py"
    failure = lesson.find("failure")
    assert failure is not None and failure.get("type") == "output-drift"


def test_sarif(make: Make) -> None:
    folder = make(DRIFTED)
    done = folder.main("check", "--format", "sarif")
    assert done.status == 1
    [run] = json.loads(done.out)["runs"]
    [result] = run["results"]
    assert result["ruleId"] == "output-drift"
    place = result["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == folder.lesson()
    assert place["region"]["startColumn"] == 7


def test_annotations(make: Make) -> None:
    folder = make(DRIFTED)
    done = folder.main("check", "--format", "github")
    assert done.status == 1
    [line] = done.out.splitlines()
    assert line.startswith(f"::error file={folder.lesson()},line=")
    assert make(GOOD, name="b").main("check", "--format", "github").out == ""


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


# --- nothing to do


def aged(folder: Folder) -> None:
    """Let all that was written be long ago: what was saved this very moment leaves no stamp."""
    for path in folder.root.rglob("*"):
        if not path.is_symlink() and ".coursebuild" not in path.parts:
            os.utime(path, (1_000_000_000.1234567, 1_000_000_000.1234567))


def test_a_run_with_nothing_to_do_loads_next_to_nothing_and_says_the_same(make: Make) -> None:
    folder = make(FIRST)
    aged(folder)
    code = (
        "import sys; from coursebuild.cli import main; status = main(sys.argv[1:]);"
        "print(sorted(m for m in sys.modules if m.startswith('coursebuild.')), file=sys.stderr);"
        "sys.exit(status)"
    )
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", code, "-C", str(folder.root), "check"],
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        assert done.returncode == 0
    assert done.stdout == (
        "ok       examples/one.py  cached\n\n"
        "nothing has changed since the last check\n\n"
        "1 lesson, 0 scripts run, 1 cached: everything holds\n"
    )
    assert done.stderr == (
        "['coursebuild.cli', 'coursebuild.cli.arguments', 'coursebuild.cli.commands', "
        "'coursebuild.cli.output', 'coursebuild.effects', 'coursebuild.effects.errors', "
        "'coursebuild.effects.place', 'coursebuild.effects.stamp']\n"
    )


@pytest.mark.parametrize("wrong", [["--cache-size", "5q"], ["--cache", ""], ["--executor", "x"]])
def test_wrong_usage_is_told_also_where_there_is_nothing_to_do(
    make: Make, wrong: list[str]
) -> None:
    folder = make(FIRST)
    aged(folder)
    assert folder.main("check").status == 0
    assert folder.main("check", *wrong).status == 2


def test_what_changed_is_looked_at_again(make: Make) -> None:
    folder = make(FIRST)
    aged(folder)
    assert folder.main("check").status == 0
    folder.write(folder.lesson(), "## One\n\n" + block("one.py", "print(2)", "1"))
    assert folder.main("check").status == 1
