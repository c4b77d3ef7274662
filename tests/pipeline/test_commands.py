"""Arguments, exit statuses, which lessons a command means, and the forms of its report."""

from __future__ import annotations

import gc
import json
import os
import re
from pathlib import Path

import pytest

from coursebuild import __version__
from coursebuild.cli.commands import known_commands
from support.fixture_cases import fixture_tables
from support.run_code import run_code
from support.scratch_course import (
    DRIFTED_LESSON,
    FIRST,
    GOOD,
    SECOND,
    CommandResult,
    Folder,
    Make,
    block,
    without_seconds,
)

pytestmark = pytest.mark.site

COMMANDS = ("build", "check", "update", "extract")
MAP = "content/course.toml"
ONE_RAN = "ok       examples/one.py  # s\n\n1 lesson, 1 script run: everything holds\n"


# --- exit statuses


def test_status_and_report_tell_whether_the_course_is_right(make: Make) -> None:
    folder = make(GOOD)
    unrun = "holds, but for 1 script that was not run (extract runs nothing)"
    for command in COMMANDS:
        result = folder.main(command)
        claim = unrun if command == "extract" else "everything holds"
        assert (result.status, result.out.splitlines()[-1].partition(": ")[2]) == (0, claim)
        assert folder.main(command, "--quiet") == CommandResult(0, "", ""), command
    folder.write(folder.lesson(), GOOD + "> [!nosuch]\n> Text.\n")
    for command in COMMANDS:
        result = folder.main(command)
        assert (result.status, result.out.partition(": ")[0]) == (1, "error[callout-unknown]"), (
            command
        )
    (folder.root / MAP).unlink()
    for command in COMMANDS:
        result = folder.main("-C", str(folder.root), command)
        assert (result.status, result.out.partition(": ")[0]) == (1, "error[map-missing]"), command


@pytest.mark.parametrize(("form", "key"), [("github", "file="), ("sarif", '"uri": "')])
def test_services_get_paths_in_the_repository(
    make: Make, monkeypatch: pytest.MonkeyPatch, form: str, key: str
) -> None:
    folder = make("See [a model](model:nosuch).\n")
    assert f"{key}{folder.lesson()}" in folder.main("check", "--format", form).out
    monkeypatch.setenv("GITHUB_WORKSPACE", str(folder.root.parent))
    path = f"{key}{folder.root.name}/{folder.lesson()}"
    assert path in folder.main("check", "--format", form).out


def test_commands_one_after_the_other_leave_a_process_as_it_was(make: Make) -> None:
    """The garbage collector is set as before, and no file stays open."""
    course = make(GOOD)
    folder = Path("/proc/self/fd") if Path("/proc/self/fd").exists() else Path("/dev/fd")
    threshold, frozen = gc.get_threshold(), gc.get_freeze_count()
    course.main("check")
    gc.collect()
    open_files = len(list(folder.iterdir()))
    for _ in range(3):
        course.main("check", "--format", "json")
    gc.collect()
    assert len(list(folder.iterdir())) == open_files
    assert gc.get_threshold() == threshold
    assert gc.get_freeze_count() <= frozen  # frozen objects may have been freed


def test_wrong_usage_gives_2_and_touches_nothing(make: Make) -> None:
    folder = make(GOOD)
    planned = '[[level.lesson]]\nid = "1.77"\nslug = "planned"\ntitle = "P"\nstatus = "planned"\n'
    folder.write(MAP, f"{folder.text(MAP)}\n{planned}")
    before = folder.tree("content")
    for arguments, says in fixture_tables("usage")["wrong"]:
        result = folder.main(*arguments.split())
        assert (result.status, result.out) == (2, ""), arguments
        assert says in result.err, arguments
        assert "Traceback" not in result.err
    assert folder.tree("content") == before
    assert not (folder.root / "public").exists()


def test_outside_of_a_course_gives_2(tmp_path: Path) -> None:
    result = Folder(tmp_path).main("check")
    assert (result.status, result.out) == (2, "")
    assert "there is no content/course.toml in this folder or one above it" in result.err
    assert not any(tmp_path.iterdir())


def test_help_version_and_schemas_are_printed_anywhere(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    for arguments in (["--help"], ["-h"], ["help"]):
        result = folder.main(*arguments)
        assert (result.status, result.err) == (0, "")
        for line in (
            "  check        verify everything without publishing\n",
            "  bench        measure speed",
        ):
            assert line in result.out
    in_build = ["-C", "build", "bench", "--help"]  # a folder with the name of a command
    assert folder.main(*in_build) == folder.main("help", "bench")
    for name in known_commands():
        result = folder.main("help", name)
        assert (result.status, result.err) == (0, ""), name
        assert result.out.startswith(f"usage: coursebuild {name} "), name
        assert "\nexamples:\n  " in result.out, name
    for arguments in (["--version"], ["-V"], ["-C", "no/such", "-V"]):
        result = folder.main(*arguments)
        assert (result.status, result.out, result.err) == (0, f"coursebuild {__version__}\n", "")
    for name in ("quiz", "lab", "course"):
        result = Folder(tmp_path).main("schema", name)
        assert result.status == 0
        assert json.loads(result.out).keys() & {"$defs", "properties"}, name


# --- where the course is


def test_on_windows_one_sentence_says_where_it_runs() -> None:
    code = (
        "import sys; sys.platform = 'win32'; from coursebuild.cli import main; sys.exit(main([]))"
    )
    result = run_code(code)
    message = "coursebuild runs on Linux and macOS; on Windows, install it in WSL\n"
    assert (result.returncode, result.stdout, result.stderr) == (2, "", message)


def test_a_course_is_found_from_anywhere(make: Make, tmp_path: Path) -> None:
    folder = make(FIRST, name="with spaces, quotes ' \" and ünïcödé 物理 🤖")
    assert without_seconds(folder.run("check").out) == ONE_RAN  # as a module of Python
    assert folder.main("check", cwd=folder.root / "content/lessons").status == 0
    elsewhere = tmp_path / "else where"
    elsewhere.mkdir()
    link = tmp_path / "link"
    link.symlink_to(folder.root)
    relative = os.path.relpath(folder.root, elsewhere)
    for place in (folder.root, relative, f"{relative}/", f"{folder.root}/content/..", link):
        assert folder.main("-C", str(place), "check", cwd=elsewhere).status == 0, place
    for words in (["check", "-C", relative], ["check", f"-C{relative}", "-q"]):
        assert folder.main(*words, cwd=elsewhere).status == 0, words
    assert folder.main("check", "--", "-C", cwd=folder.root).status == 2  # a lesson of this name
    assert not any(elsewhere.iterdir())
    place = str(folder.root)
    assert folder.main("-C", place, "build", "--out", "../a site/öut", cwd=elsewhere).status == 0
    assert (tmp_path / "a site/öut/lessons/1.1-one.html").is_file()
    inner = Folder(folder.root / "inner")  # the nearest course above counts
    inner.write(MAP, folder.text(MAP))
    inner.write(inner.lesson(), "## Inner\n\n" + block("inner.py", "print(1)", "1"))
    assert "examples/inner.py" in folder.main("check", cwd=inner.root / "content").out
    for name, problem in (
        ("caf\udce9", f"is not UTF-8: {tmp_path}/caf\\xe9"),
        ("a\\b", f"has a backslash, which MuJoCo misreads: {tmp_path}/a\\b"),
    ):
        folder = Folder(folder.root.rename(folder.root.with_name(name)))
        result = folder.main("build")
        assert (result.status, result.out, result.err) == (
            2,
            "",
            f"coursebuild: the path of the course {problem}\n",
        )


# --- lessons


def test_lessons_and_pages_are_named_by_id_slug_or_file(make: Make, tmp_path: Path) -> None:
    folder = make(FIRST, SECOND, GOOD)
    page = '[[page]]\nid = "about"\ntitle = "About"\nfile = "content/pages/about.md"\n'
    folder.write(MAP, folder.text(MAP) + page)
    folder.write("content/pages/about.md", "## About\n\n" + block("p.py", "print(5)", "6"))
    for name in (
        "1.1",
        "one",
        "1.1-one",
        "1.1-one.md",
        folder.lesson(),
        f"./{folder.lesson()}",
        "content/pages/../lessons/1.1-one.md",
        str(folder.root / folder.lesson()),
    ):
        result = folder.main("check", name)
        scripts = [line for line in result.out.splitlines() if "examples/" in line]
        assert (result.status, len(scripts), "examples/one.py" in scripts[0]) == (0, 1, True), name
    for name in ("1.2-two.md", "./1.2-two.md"):
        result = folder.main("check", name, cwd=folder.root / "content/lessons")
        assert "examples/two.py" in result.out
    lesson = tmp_path / "content/lessons/1.2-two.md"
    lesson.parent.mkdir(parents=True)
    lesson.write_text(SECOND)
    assert folder.main("check", str(lesson)).status == 2
    result = folder.main("check", "three", "1.1", "1.1")  # in the order of the course, each once
    assert [line.split()[1] for line in result.out.splitlines()[:2]] == [
        "examples/one.py",
        "examples/hello.py",
    ]
    assert "\n2 lessons, " in result.out
    assert "run `coursebuild update about`" in folder.main("check").out
    assert folder.main("check", "content/pages/about.md").status == 1
    assert folder.main("update", "about").status == 0
    assert folder.main("check").status == 0


def test_a_mistake_elsewhere_does_not_count_but_one_in_the_map(make: Make) -> None:
    folder = make(FIRST, SECOND + "[gone](lesson:7.7)\n")
    assert [folder.main("check", *names).status for names in (["1.1"], ["1.2"], [])] == [0, 1, 1]
    folder.replace(MAP, 'title = "Scratch"', 'title = "Scratch"\nsumary = ""')
    result = folder.main("check", "1.1")
    assert result.status == 1
    assert "error[field-unknown]: unknown field `sumary`" in result.out


def test_a_lesson_that_quotes_another_is_checked_with_its_script(make: Make) -> None:
    lesson = "## Two\n\n" + block("two.py", "print(2)") + "It is `41`{out=examples/one.py}.\n"
    quiz = """## Three

```quiz
{"id": "q", "questions": [{"kind": "output", "q": "?", "of": "examples/one.py", "line": 2}]}
```
"""
    sibling = "## Four\n\n" + block("four.py", "from one import f\n\nf(0)")
    folder = make(FIRST, lesson, quiz, sibling)
    for code, rules in (
        ("print(41)\ndef f(x): return 1 / x", ("", "quiz-output", "script-failed")),
        ("print(42)\nprint(1)\ndef f(x): return 1", ("binding-mismatch", "", "")),
        ("print(41)\n1/0", ("script-failed", "script-failed", "script-failed")),
    ):
        folder.write(folder.lesson(), "## One\n\n" + block("one.py", code))
        for name, rule in zip(("1.2", "1.3", "1.4"), rules, strict=True):
            result = folder.main("check", name)
            if rule:
                assert (result.status, f"error[{rule}]" in result.out) == (1, True), (code, name)
            else:
                assert result.status == 0, (code, name)


# --- nothing to do


def test_a_course_may_have_no_scripts_and_is_told_that_none_can_run(make: Make) -> None:
    folder = make("## Only text\n\nIt says so.\n")
    for command in (["check"], ["check", "--shard", "1/3"], ["check", "--jobs", "1024"], ["build"]):
        result = folder.main(*command)
        assert (result.status, "no-scripts" in result.out) == (0, False), command
    for info, is_warned in (("norun", False), ("requires=no_such_module", True)):
        folder.write(folder.lesson(), "## One\n\n" + block("one.py", "print(1)", info=info))
        for command in (["check", "1.1"], ["build"]):
            result = folder.main(*command)
            assert (result.status, "warning[no-scripts]" in result.out) == (0, is_warned), command


def test_a_course_without_a_written_lesson_is_a_mistake(make: Make) -> None:
    folder = make()
    for command in ("build", "check"):
        result = folder.main(command)
        assert result.status == 1
        assert "error[no-lessons]: the course has no written lesson" in result.out
        assert "no-scripts" not in result.out
    assert not (folder.root / "public").exists()


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
