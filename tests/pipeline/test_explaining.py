"""`coursebuild explain`, and which edits make scripts run again, through the commands."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from coursebuild.core.text.rules import RULES
from support.fixture_cases import fixture_tables, fixture_text
from support.scratch_course import HELLO, ROOT, Folder, Make, block

pytestmark = pytest.mark.site

READS = 'from pathlib import Path\nprint(len(Path("models/data.txt").read_text()))\n'
HELPER = 'word = "help"\nif __name__ == "__main__":\n    print(word)\n'
HELPED_SCRIPT = "from helper import word\nprint(word)\n"
LESSON = (
    "## A\n\n"
    + block("hello.py", HELLO, "hello 3.14159")
    + block("reads.py", READS, "3")
    + "It has `3`{out=examples/reads.py} letters, see [the data](../../models/data.txt).\n"
)
SECOND_LESSON = (
    "## B\n\n" + block("helper.py", HELPER, "help") + block("helped.py", HELPED_SCRIPT, "help")
)


@pytest.fixture
def course(make: Make) -> Folder:
    folder = make(LESSON, SECOND_LESSON)
    folder.write("models/data.txt", "abc")
    return folder


def run_paths(folder: Folder, *arguments: str) -> list[str]:
    """The scripts that a check ran, without those with a remembered result."""
    result = folder.main("check", "--format", "json", *arguments)
    scripts = json.loads(result.out)["scripts"]
    return [Path(script["path"]).stem for script in scripts if not script["cached"]]


def explain(folder: Folder, path: str) -> str:
    result = folder.main("explain", path)
    assert (result.status, result.err) == (0, "")
    return re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC, \d+\.\d\d s", "WHEN", result.out)


def verbose(folder: Folder, *arguments: str) -> str:
    return folder.main("check", "-v", *arguments).err


EDITS = fixture_tables("explaining")["edits"]


def test_an_edit_runs_again_what_depends_on_it(course: Folder) -> None:
    assert run_paths(course) == ["hello", "reads", "helper", "helped"]
    assert run_paths(course) == []
    result = course.main("check", "--shard", "1/1")
    assert "2 lessons, 0 scripts run, 4 cached: part 1/1 of the work holds" in result.out
    assert result.out.count("  cached\n") == 4
    assert "running scripts" not in result.err
    for path, old, new, again in EDITS:
        course.replace(path, old, new)
        assert run_paths(course) == again, new
        course.replace(path, new, old)
        assert run_paths(course) == [], "this was so before"
    assert run_paths(course.duplicate(course.root.with_name("elsewhere"))) == []
    # Imports of scripts may be found elsewhere from now on.
    course.write("examples/pathlib.py", "raise ValueError\n")
    assert run_paths(course) == ["hello", "reads", "helper", "helped"]
    assert run_paths(course) == []


QUESTIONS = fixture_tables("explaining")["questions"]


def test_what_a_script_asked_about_files_runs_it_again_when_the_answer_changes(make: Make) -> None:
    imports = "import glob, importlib.util, os, subprocess\nfrom pathlib import Path\n"
    scripts = [
        block(f"ask{n}.py", f"{imports}print({question})", "False")
        for n, question in enumerate(QUESTIONS)
    ]
    folder = make("## Questions\n\n" + "\n".join(scripts))
    folder.write("content/table.csv", "1\n")
    assert folder.main("check").status == 0
    again = folder.main("check", "-v")
    assert "1 script run, 11 cached: everything holds" in again.out, "all but who starts programs"
    folder.write("content/extra.csv", "")
    folder.write("content/table.csv", "1,2\n")
    folder.write("examples/extra.py", "")
    assert "because content/extra.csv appeared" in folder.main("explain", "examples/ask0.py").out
    result = folder.main("check")
    assert result.out.count("error[output-drift]") == len(QUESTIONS)
    (folder.root / "content/extra.csv").unlink()
    (folder.root / "examples/extra.py").unlink()
    folder.write("content/table.csv", "1\n")
    assert folder.main("check").status == 0


def test_damaged_entry_and_unreachable_cache_are_no_mistake(course: Folder) -> None:
    result = course.main("check", "--cache", "/not/mounted/cache")
    assert result.status == 0
    warnings = [line for line in result.err.splitlines() if "shared cache" in line]
    warning = "the shared cache /not/mounted/cache cannot be used: no such file or directory"
    assert warnings == [warning]
    (path, *_) = sorted(p for p in (course.root / ".coursebuild/scripts").rglob("*") if p.is_file())
    path.write_bytes(path.read_bytes()[:-1])
    result = course.main("check", "--shard", "1/1")
    assert result.status == 0
    assert result.err.count("running scripts (1)\n") == 1, "it is made again, without a word more"


# --- explain


REASONS = fixture_tables("explaining")["reasons"]


def test_explain_says_why_a_script_would_run(
    course: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    assert explain(course, "examples/hello.py") == (
        "examples/hello.py would run\n"
        "  because there is no result of it on this machine\n"
        "  of 1.1, not run yet on this machine\n"
    )
    assert "examples/hello.py: there is no result of it on this machine\n" in verbose(course)
    text = explain(course, "examples/reads.py")
    assert text.startswith(
        "examples/reads.py is remembered\n  of 1.1, last run WHEN: ok\n\n"
        "its last result depends on:\n  models/data.txt\n"
    )
    assert text.endswith("shown, linked or quoted in:\n  content/lessons/1.1-one.md\n")
    assert re.search(r"^  Python: CPython \d", text, re.MULTILINE)
    for path, old, new, reason in REASONS:
        course.replace(path, old, new)
        assert explain(course, "examples/reads.py").startswith(
            f"examples/reads.py would run again\n  because {reason}\n  of 1.1, last run WHEN: ok\n"
        )
        course.replace(path, new, old)
    (course.root / "models/data.txt").unlink()
    assert "  because models/data.txt is gone\n" in explain(course, "examples/reads.py")
    lines = verbose(course)
    assert "examples/reads.py: models/data.txt is gone\n" in lines
    assert "examples/hello.py" not in lines
    all_again = "examples/helper.py: everything was asked to run again\n"
    assert all_again in verbose(course, "1.2", "--no-cache")
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    text = explain(course, "examples/hello.py")
    assert "  because environment variable MUJOCO_GL: unset → osmesa\n" in text


def test_explain_says_why_a_result_is_not_remembered(make: Make) -> None:
    starts = 'import subprocess, sys\nsubprocess.run([sys.executable, "-c", ""])\nprint(1)\n'
    folder = make(
        "## A\n\n"
        + block("starts.py", starts, "1")
        + block("slow.py", "import time\ntime.sleep(60)\n", info="timeout=0.3")
        + block("idle.py", "print(1)\n", info="norun")
    )
    folder.main("check")
    assert explain(folder, "examples/starts.py").startswith(
        "examples/starts.py would run again\n"
        "  because its last result is not remembered: it starts other programs\n"
    )
    text = explain(folder, "examples/slow.py")
    assert "because its last result is not remembered: it was stopped after its time limit" in text
    text = explain(folder, "examples/idle.py")
    assert text.startswith("examples/idle.py is never run\n  because its lesson says `norun`\n")


def test_explain_lessons_and_files_by_any_of_their_names(course: Folder) -> None:
    course.main("check")
    before = course.tree()
    assert explain(course, "models/data.txt") == (
        "models/data.txt\n\n"
        "depending on it:\n"
        "  examples/reads.py is remembered\n\n"
        "shown, linked or quoted in:\n"
        "  content/lessons/1.1-one.md\n"
    )
    assert "  examples/helped.py is remembered\n" in explain(course, "examples/helper.py")
    assert explain(course, "content/course.toml") == (
        "content/course.toml\n\nno result of a script or lab depends on it\n"
    )
    result = course.main("explain", "data.txt", cwd=course.root / "models")
    assert (result.status, result.out.startswith("models/data.txt\n")) == (0, True)
    assert course.tree() == before, "nothing is written"
    course.write("examples/pathlib.py", "")  # scripts would import it from now on
    assert "  examples/reads.py would run again\n" in explain(course, "examples/pathlib.py")
    (course.root / "examples/pathlib.py").unlink()
    course.write("models/data.txt", "changed")
    for name in ("1.1", "one", "1.1-one", "content/lessons/1.1-one.md"):
        assert explain(course, name) == (
            "content/lessons/1.1-one.md: 2 scripts, of which 1 would run\n\n"
            "examples/hello.py is remembered\n\n"
            "examples/reads.py would run again\n"
            "  because models/data.txt changed\n"
        )
    value = json.loads(course.main("explain", "examples/reads.py", "--format", "json").out)
    assert (value["path"], value["kind"]) == ("examples/reads.py", "script")
    (run,) = value["own"]
    assert (run["state"], run["reasons"]) == ("would run", ["models/data.txt changed"])
    assert (run["owner"], run["outcome"]) == ("1.1", "ok")
    assert isinstance(run["made"], int)


def test_explain_tells_what_a_rule_means_anywhere(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    result = folder.main("explain", "footnote-unused")
    assert (result.status, result.err) == (0, "")
    assert result.out.startswith("footnote-unused\n\nA footnote is defined but not used.\n\n")
    assert "\n    warning[footnote-unused]: " in result.out
    page = (ROOT / "docs/reference/rules.md").read_text()
    texts = "".join(folder.main("explain", name).out for name in RULES)
    assert len(re.findall(r"^    (error|warning|hint)\[", texts, re.MULTILINE)) == len(RULES)
    assert all(line in page for line in texts.splitlines())
    rule = json.loads(folder.main("explain", "footnote-unused", "--format", "json").out)
    assert (rule["name"], rule["severity"]) == ("footnote-unused", "warning")


def test_explain_what_cannot_be_explained_gives_2(course: Folder) -> None:
    result = course.main("explain", "output-drif")
    message = "nothing in this course is called `output-drif`; did you mean `output-drift`?"
    assert (result.status, result.err) == (2, f"coursebuild: {message}\n")
    result = course.main("explain", "examples/helo.py")
    message = (
        "nothing in this course is called `examples/helo.py`; did you mean `examples/hello.py`?"
    )
    assert (result.status, result.err) == (2, f"coursebuild: {message}\n")
    course.write("content/course.toml", "[")
    result = course.main("explain", "1.1")
    message = "the course map cannot be read; `coursebuild check` says why"
    assert (result.status, result.err) == (2, f"coursebuild: {message}\n")


PACKAGE_SCRIPT = fixture_text("scripts/uses_package.txt")


def test_scripts_import_from_the_folders_of_the_course(make: Make) -> None:
    """They come before our folders, and count as inputs, as do variables that the course sets."""
    output = "word mjcourse True 1"
    folder = make(
        "## A\n\n" + block("a.py", PACKAGE_SCRIPT, output, info="writes=runs/ requires=pkg")
    )
    folder.write("src/pkg/__init__.py", "")
    folder.write("src/pkg/part.py", 'word = "word"\n')
    folder.write("src/mjcourse/__init__.py", "OWN = True\n")
    plain = folder.text("content/course.toml")
    ours = plain.replace("[course]\n", '[course]\npackages = ["src", "gone"]\n')
    folder.write("content/course.toml", f'{ours}\n[verify]\nenv = {{FAST = "1", PATH = "x"}}\n')
    result = folder.main("check")
    assert "there is no folder `gone`" not in result.out  # the map cannot be read yet
    assert "`PATH` cannot be set for scripts" in result.out
    folder.replace("content/course.toml", ', PATH = "x"', "")
    assert "error[field-value]: there is no folder `gone`" in folder.main("check").out
    folder.replace("content/course.toml", ', "gone"', "")
    assert run_paths(folder) == ["a"]
    assert folder.main("check").status == 0, folder.main("check").out
    assert run_paths(folder) == []
    for path, old, new in (
        ("src/pkg/part.py", '"word"', '"word" ""'),
        ("content/course.toml", 'FAST = "1"', 'FAST = "2"'),
        ("content/course.toml", '["src"]', '["src/pkg", "src"]'),
        ("content/lessons/1.1-one.md", "writes=runs/", "writes=runs,out"),
    ):
        folder.replace(path, old, new)
        assert run_paths(folder) == ["a"], new
        folder.replace(path, new, old)
        assert run_paths(folder) == [], old
    assert folder.text("runs/a/word.txt") == "word"
    folder.replace(folder.lesson(), "writes=runs/ ", "")
    assert run_paths(folder) == run_paths(folder) == ["a"], "it writes into the project"
