"""`coursebuild explain`, and which edits make scripts run again, through the commands."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from support.scratch_course import HELLO, ROOT, Folder, block

pytestmark = pytest.mark.site

Make = Callable[..., Folder]

READS = 'from pathlib import Path\nprint(len(Path("models/data.txt").read_text()))\n'
HELPER = 'word = "help"\nif __name__ == "__main__":\n    print(word)\n'
HELPED = "from helper import word\nprint(word)\n"
LESSON = (
    "## A\n\n"
    + block("hello.py", HELLO, "hello 3.14159")
    + block("reads.py", READS, "3")
    + "It has `3`{out=examples/reads.py} letters, see [the data](../../models/data.txt).\n"
)
OTHER = "## B\n\n" + block("helper.py", HELPER, "help") + block("helped.py", HELPED, "help")


@pytest.fixture
def course(make: Make) -> Folder:
    folder = make(LESSON, OTHER)
    folder.write("models/data.txt", "abc")
    return folder


def ran(folder: Folder, *arguments: str) -> list[str]:
    """The scripts that a check ran, without those whose result was remembered."""
    done = folder.main("check", "--format", "json", *arguments)
    scripts = json.loads(done.out)["scripts"]
    return [Path(script["path"]).stem for script in scripts if not script["cached"]]


def explained(folder: Folder, path: str) -> str:
    done = folder.main("explain", path)
    assert (done.status, done.err) == (0, "")
    return re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC, \d+\.\d\d s", "WHEN", done.out)


def test_second_check_runs_no_script(course: Folder) -> None:
    assert ran(course) == ["hello", "reads", "helper", "helped"]
    assert ran(course) == []
    done = course.main("check", "--shard", "1/1")
    assert "2 lessons, 0 scripts run, 4 cached: everything holds" in done.out
    assert done.out.count("  cached\n") == 4
    assert "running scripts" not in done.err


@pytest.mark.parametrize(
    ("path", "old", "new", "again"),
    [
        ("content/lessons/1.1-one.md", "## A", "## Another\n\nMore prose.", []),
        ("content/course.toml", 'title = "Scratch"', 'title = "Other"', []),
        ("content/lessons/1.1-one.md", '"hello"', '"hello" ', ["hello"]),
        ("content/lessons/1.1-one.md", "s/hello.py", "s/hello.py timeout=9", ["hello"]),
        ("content/lessons/1.1-one.md", "s/hello.py", 's/hello.py args="-v"', ["hello"]),
        ("models/data.txt", "abc", "xyz", ["reads"]),
        ("content/lessons/1.2-two.md", 'word = "help"', 'word = "held"', ["helper", "helped"]),
    ],
)  # fmt: skip
def test_an_edit_runs_again_what_depends_on_it(
    course: Folder, path: str, old: str, new: str, again: list[str]
) -> None:
    ran(course)
    course.replace(path, old, new)
    assert ran(course) == again
    course.replace(path, new, old)
    assert ran(course) == [], "this was so before"


def test_a_new_lesson_runs_its_own_scripts_only(make: Make) -> None:
    folder = make(LESSON)
    folder.write("models/data.txt", "abc")
    ran(folder)
    text = folder.text("content/course.toml")
    folder.write(
        "content/course.toml",
        text + '\n[[level.lesson]]\nid = "1.2"\nslug = "two"\ntitle = "B"\nstatus = "complete"\n',
    )
    folder.write(folder.lesson(2), OTHER)
    assert ran(folder) == ["helper", "helped"]


def test_new_file_with_the_name_of_an_imported_module_runs_its_importers(course: Folder) -> None:
    """What a script imports may be found elsewhere from now on."""
    ran(course)
    course.write("examples/pathlib.py", "raise ValueError\n")
    assert ran(course) == ["reads"]


def test_a_moved_course_runs_nothing(course: Folder) -> None:
    ran(course)
    moved = Folder(course.root.with_name("elsewhere"))
    shutil.copytree(course.root, moved.root, symlinks=True)
    moved.tmp.mkdir()
    assert ran(moved) == []


def test_shared_cache_spares_runs_in_other_courses(
    course: Folder, make: Make, tmp_path: Path
) -> None:
    shared = str(tmp_path / "shared")
    assert ran(course, "--cache", shared) == ["hello", "reads", "helper", "helped"]
    other = make(LESSON, OTHER, name="another")
    other.write("models/data.txt", "abc")
    assert ran(other, "--cache", shared) == []
    third = make(LESSON, OTHER, name="third")
    third.write("models/data.txt", "xyz")
    assert ran(third, "--cache", shared) == ["reads"]


def test_a_failure_is_remembered_and_told_again(make: Make) -> None:
    folder = make("## A\n\n" + block("bad.py", 'x = 1\nraise ValueError("no good")\n'))
    first = folder.main("check")
    assert first.status == 1
    again = folder.main("check")
    assert "failed   examples/bad.py  cached" in again.out
    assert again.out.splitlines()[:11] == first.out.splitlines()[:11]
    assert "ValueError: no good" in again.out


def test_no_cache_runs_everything(course: Folder) -> None:
    ran(course)
    assert ran(course, "--no-cache") == ["hello", "reads", "helper", "helped"]
    assert ran(course) == []


def test_damaged_entry_is_told_on_standard_error(course: Folder) -> None:
    ran(course)
    (path, *_) = sorted(p for p in (course.root / ".coursebuild/scripts").rglob("*") if p.is_file())
    path.write_bytes(path.read_bytes()[:-1])
    done = course.main("check", "--shard", "1/1")
    assert done.status == 0
    (line,) = [line for line in done.err.splitlines() if "damaged" in line]
    assert re.fullmatch(
        r"the entry scripts/[0-9a-f]{12}… in \.coursebuild is damaged: it is made again", line
    )


def test_an_unreachable_cache_is_told_once_and_no_mistake(course: Folder) -> None:
    done = course.main("check", "--cache", "/not/mounted/cache")
    assert done.status == 0
    told = [line for line in done.err.splitlines() if "shared cache" in line]
    said = "the shared cache /not/mounted/cache cannot be used: no such file or directory"
    assert told == [said]


def test_environment_variable_names_a_shared_cache(course: Folder, tmp_path: Path) -> None:
    shared = tmp_path / "shared"
    done = course.run("check", env={"COURSEBUILD_CACHE": str(shared)})
    assert done.status == 0, done.err
    assert any(path.is_file() for path in shared.rglob("*"))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--cache", ""], "--cache names no place"),
        (["--cache-size", "much"],
         "--cache-size: 'much' is no size: a whole number, perhaps with K, M, G or T"),
        (["--cache-size", "-1"], None),
        (["--cache", "gopher://x/y"], None),
    ],
)  # fmt: skip
def test_wrong_cache_arguments_give_2(
    course: Folder, arguments: list[str], said: str | None
) -> None:
    done = course.main("check", *arguments)
    assert done.status == 2
    if said is not None:
        assert done.err == f"coursebuild: {said}\n"


# --- update


def test_update_runs_again_what_is_remembered_and_differs(course: Folder) -> None:
    """A remembered result is one of them, so that what varies is still found."""
    course.write("models/count.txt", "0")
    lesson = "## A\n\n" + block(
        "dice.py", "import os\nprint(os.getpid())\n", "one of many", info=""
    )
    course.write(course.lesson(1), lesson)
    assert course.main("check").status == 1
    done = course.main("update", "1.1")
    assert done.status == 1
    assert "error[output-unstable]" in done.out
    assert course.text(course.lesson(1)) == lesson


def test_update_takes_a_remembered_result_that_holds(course: Folder) -> None:
    course.main("check")
    done = course.main("update")
    assert done.status == 0
    assert "every recorded output is up to date" in done.out
    assert "running scripts" not in done.err


# --- explain


def test_explain_script_that_never_ran(course: Folder) -> None:
    assert explained(course, "examples/hello.py") == (
        "examples/hello.py would run\n"
        "  because there is no result of it on this machine\n"
        "  of 1.1, not run yet on this machine\n"
    )


def test_explain_remembered_script(course: Folder) -> None:
    course.main("check")
    told = explained(course, "examples/reads.py")
    assert told.startswith(
        "examples/reads.py is remembered\n  of 1.1, last run WHEN: ok\n\n"
        "its last result depends on:\n  models/data.txt\n"
    )
    assert told.endswith("shown, linked or quoted in:\n  content/lessons/1.1-one.md\n")
    assert re.search(r"^  Python: CPython \d", told, re.MULTILINE)


@pytest.mark.parametrize(
    ("path", "old", "new", "reason"),
    [
        ("models/data.txt", "abc", "xyz", "models/data.txt changed"),
        ("content/lessons/1.1-one.md", "read_text()))", "read_text() ))", "its text changed"),
        ("content/lessons/1.1-one.md", "file=examples/reads.py", "file=examples/reads.py timeout=9",
         "its option `timeout` changed: 60 → 9"),
    ],
)  # fmt: skip
def test_explain_says_why_a_script_would_run_again(
    course: Folder, path: str, old: str, new: str, reason: str
) -> None:
    course.main("check")
    course.replace(path, old, new)
    told = explained(course, "examples/reads.py")
    assert told.startswith(
        f"examples/reads.py would run again\n  because {reason}\n  of 1.1, last run WHEN: ok\n"
    )


def test_explain_names_a_file_that_is_gone(course: Folder) -> None:
    course.main("check")
    (course.root / "models/data.txt").unlink()
    assert "  because models/data.txt is gone\n" in explained(course, "examples/reads.py")


def test_explain_names_a_changed_environment_variable(
    course: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    course.main("check")
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    told = explained(course, "examples/hello.py")
    assert "  because environment variable MUJOCO_GL: unset → osmesa\n" in told


def test_explain_script_that_starts_other_programs(make: Make) -> None:
    code = 'import subprocess, sys\nsubprocess.run([sys.executable, "-c", ""])\nprint(1)\n'
    folder = make("## A\n\n" + block("starts.py", code, "1"))
    folder.main("check")
    assert explained(folder, "examples/starts.py").startswith(
        "examples/starts.py would run again\n"
        "  because its last result is not remembered: it starts other programs\n"
    )


def test_explain_script_that_was_stopped_after_its_time(make: Make) -> None:
    code = "import time\ntime.sleep(60)\n"
    folder = make("## A\n\n" + block("slow.py", code, info="timeout=0.3"))
    folder.main("check")
    told = explained(folder, "examples/slow.py")
    assert "because its last result is not remembered: it was stopped after its time limit" in told


def test_explain_script_that_is_never_run(make: Make) -> None:
    folder = make("## A\n\n" + block("idle.py", "print(1)\n", info="norun"))
    told = explained(folder, "examples/idle.py")
    assert told.startswith("examples/idle.py is never run: its lesson says `norun`\n")


@pytest.mark.parametrize("name", ["1.1", "one", "1.1-one", "content/lessons/1.1-one.md"])
def test_explain_lesson_by_any_of_its_names(course: Folder, name: str) -> None:
    course.main("check")
    course.write("models/data.txt", "changed")
    assert explained(course, name) == (
        "content/lessons/1.1-one.md: 2 scripts, of which 1 would run\n\n"
        "examples/hello.py is remembered\n\n"
        "examples/reads.py would run again\n"
        "  because models/data.txt changed\n"
    )


def test_explain_file_lists_what_depends_on_it(course: Folder) -> None:
    course.main("check")
    assert explained(course, "models/data.txt") == (
        "models/data.txt\n\n"
        "depending on it:\n"
        "  examples/reads.py is remembered\n\n"
        "shown, linked or quoted in:\n"
        "  content/lessons/1.1-one.md\n"
    )
    assert "  examples/helped.py is remembered\n" in explained(course, "examples/helper.py")
    assert explained(course, "content/course.toml") == (
        "content/course.toml\n\nno result of a script or lab depends on it\n"
    )


def test_explain_takes_a_path_from_the_working_directory(course: Folder) -> None:
    course.main("check")
    done = course.main("explain", "data.txt", cwd=course.root / "models")
    assert done.status == 0
    assert done.out.startswith("models/data.txt\n")


def test_explain_as_json(course: Folder) -> None:
    course.main("check")
    course.write("models/data.txt", "changed")
    value = json.loads(course.main("explain", "examples/reads.py", "--format", "json").out)
    assert value["path"] == "examples/reads.py"
    assert value["kind"] == "script"
    (own,) = value["own"]
    assert own["state"] == "would run"
    assert own["reasons"] == ["models/data.txt changed"]
    assert own["owner"] == "1.1"
    assert own["outcome"] == "ok"
    assert isinstance(own["made"], int)


def test_explain_unknown_name_proposes_a_near_one(course: Folder) -> None:
    done = course.main("explain", "examples/helo.py")
    said = "nothing of this course is called `examples/helo.py`; did you mean `examples/hello.py`?"
    assert (done.status, done.err) == (2, f"coursebuild: {said}\n")


def test_explain_with_broken_map_gives_2(course: Folder) -> None:
    course.write("content/course.toml", "[")
    done = course.main("explain", "1.1")
    said = "the course map cannot be read; `coursebuild check` says why"
    assert (done.status, done.err) == (2, f"coursebuild: {said}\n")


def test_explaining_changes_nothing_and_imports_little(course: Folder) -> None:
    course.main("check")
    before = {p: p.read_bytes() for p in course.root.rglob("*") if p.is_file()}
    code = (
        "import sys\nfrom coursebuild.cli import main\nmain(['explain', 'examples/hello.py'])\n"
        "print(sorted(set(sys.modules) & {'numpy', 'mujoco', 'coursebuild.core.run.v8', 'jinja2'}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=course.root,
        env=course.environment({"PYTHONPATH": str(ROOT)}),
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines()[-1] == "[]"
    after = {p: p.read_bytes() for p in course.root.rglob("*") if p.is_file()}
    assert after == before
