"""Arguments, exit statuses, the choice of lessons, and the forms of a report."""

from __future__ import annotations

import gc
import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from support.scratch_course import FIRST, GOOD, SECOND, Folder, block, without_seconds

pytestmark = pytest.mark.site

Make = Callable[..., Folder]


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


def test_commands_one_after_the_other_leave_a_process_as_it_was(make: Make) -> None:
    """The collector is set as before, and no file stays open that only garbage holds."""
    course = make(GOOD)
    folder = Path("/proc/self/fd") if Path("/proc/self/fd").exists() else Path("/dev/fd")
    before = gc.get_threshold(), gc.get_freeze_count()
    course.main("check")
    gc.collect()
    opened = len(list(folder.iterdir()))
    for _ in range(5):
        course.main("check")
    gc.collect()
    assert len(list(folder.iterdir())) == opened
    assert (gc.get_threshold(), gc.get_freeze_count()) == before


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
        (["schema", "nosuch"], "there is no schema 'nosuch': choose from course, lab, model, quiz"),
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
def test_schema_prints_json_schema(tmp_path: Path, name: str) -> None:
    done = Folder(tmp_path).main("schema", name)
    assert done.status == 0
    schema = json.loads(done.out)
    assert "$defs" in schema or "properties" in schema


def test_tool_runs_as_a_module_of_python(make: Make) -> None:
    done = make(GOOD).run("check")
    assert (done.status, without_seconds(done.out)) == (
        0,
        "ok       examples/hello.py  # s\n\n1 lesson, 1 script run: everything holds\n",
    )


# --- where the course is


def test_a_course_is_found_from_below(make: Make) -> None:
    folder = make(GOOD)
    assert folder.main("check", cwd=folder.root / "content/lessons").status == 0


def test_option_c_takes_any_folder_from_anywhere(make: Make, tmp_path: Path) -> None:
    folder = make(GOOD, name="with spaces, quotes ' \" and ünïcödé 物理 🤖")
    elsewhere = tmp_path / "else where"
    elsewhere.mkdir()
    relative = os.path.relpath(folder.root, elsewhere)
    for where in (str(folder.root), relative, f"{relative}/", f"{folder.root}/content/.."):
        done = folder.main("-C", where, "build", cwd=elsewhere)
        assert done.status == 0, done.err
        assert (folder.root / "public/lessons/1.1-one.html").is_file()
    assert not any(elsewhere.iterdir())
    link = tmp_path / "link"
    link.symlink_to(folder.root)
    assert folder.main("-C", str(link), "check", cwd=elsewhere).status == 0
    done = folder.main("-C", str(folder.root), "build", "--out", "../a site/öut", cwd=elsewhere)
    assert done.status == 0
    assert (tmp_path / "a site/öut/index.html").is_file()


def test_a_folder_whose_name_is_not_utf8(make: Make) -> None:
    odd = make(GOOD).root.with_name("caf\udce9")
    make(GOOD, name="other").root.rename(odd)
    done = Folder(odd).main("build")
    assert (done.status, done.out) == (2, "")
    assert "the path of the course is not UTF-8: " in done.err
    assert "caf\\xe9" in done.err


def test_nearest_course_above_counts_without_option_c(make: Make) -> None:
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
def test_lesson_is_named_by_id_slug_or_file(make: Make, name: str) -> None:
    folder = make(FIRST, SECOND)
    name = str(folder.root / folder.lesson()) if name == "ABSOLUTE" else name
    done = folder.main("check", name)
    assert (done.status, without_seconds(done.out)) == (
        0,
        "ok       examples/one.py  # s\n\n1 lesson, 1 script run: everything holds\n",
    )


def test_lesson_file_is_named_from_the_working_directory(make: Make, tmp_path: Path) -> None:
    folder = make(FIRST, SECOND)
    inside = folder.root / "content/lessons"
    assert "examples/two.py" in folder.main("check", "1.2-two.md", cwd=inside).out
    assert "examples/two.py" in folder.main("check", "./1.2-two.md", cwd=inside).out
    other = tmp_path / "content/lessons/1.2-two.md"
    other.parent.mkdir(parents=True)
    other.write_text(SECOND)
    done = folder.main("check", str(other))
    assert (done.status, done.out) == (2, "")


def test_page_is_named_by_id_or_file(make: Make) -> None:
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
