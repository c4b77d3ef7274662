"""Scripts in other languages than Python: run where the map names a runner, else only shown."""

from __future__ import annotations

import re

import pytest

from support.fixture_cases import fixture_text
from support.scratch_course import Folder, Make, block

pytestmark = pytest.mark.site

RUNNERS = fixture_text("documents/runners.toml")
SUM = fixture_text("documents/shell.md")


@pytest.fixture
def course(make: Make) -> Folder:
    """A course with a script of the shell, and runners for it and others."""
    folder = make(SUM)
    folder.write("content/course.toml", folder.text("content/course.toml") + RUNNERS)
    return folder


def test_an_output_is_verified_and_its_numbers_are_bound(course: Folder) -> None:
    course.run("check", "--strict").require_success()
    assert course.run("build").status == 0
    assert course.text("examples/sum.sh").startswith("echo")
    page = course.text("public/lessons/1.1-one.html")
    assert "language-sh" in page
    assert re.search(r"Verified[^<]* with sh", page)
    course.replace(course.lesson(), "the sum is 42", "the sum is 43")
    result = course.run("check")
    assert result.status == 1
    assert "this run printed 42" in result.out
    course.replace(course.lesson(), "2 40", "2 41")
    assert course.run("update").status == 0
    assert "It is `43`{out}" in course.text(course.lesson())


def test_without_a_runner_it_is_shown_and_said_to_be_not_run(course: Folder) -> None:
    text = '```r file=examples/mean.R\ncat(mean(c(1, 3)), "\\n")\n```\n\n```output\n7\n```\n'
    course.write(course.lesson(), f"## Mean\n\n{text}")
    result = course.run("build").require_success()
    assert "norun    examples/mean.R  (no runner for `r`; " in result.out
    page = course.text("public/lessons/1.1-one.html")
    assert "this script is not run when the site is built" in page
    result = course.run("check", "--strict")
    assert result.status == 1
    assert "`[runners]` of the map has nothing for `r`" in result.out


def test_a_file_that_a_script_reads_is_no_script_that_was_not_run(course: Folder) -> None:
    data = "```csv file=examples/fall.csv\n1,4.905\n```\n\n"
    reads = block("read.py", 'print(open("examples/fall.csv").read().strip())', "1,4.905")
    course.write(course.lesson(), f"## Fall\n\n{data}{reads}")
    result = course.run("check", "--strict")
    assert (result.status, "fall.csv" in result.out) == (0, False), result.out
    course.write(course.lesson(), f"## Fall\n\n{data}{block('read.py', 'print(1)', '1')}")
    assert "norun    examples/fall.csv  (no runner for `csv`)" in course.run("check").out


def test_a_runner_that_is_not_installed_skips_its_scripts(course: Folder) -> None:
    course.write(course.lesson(), "## List\n\n```lisp file=examples/a.lisp\n(print 1)\n```\n")
    result = course.run("check")
    assert result.status == 0
    assert "skipped  examples/a.lisp  (needs no-such-lisp" in result.out
    assert course.run("check", "--strict").status == 1


def test_commands_follow_each_other_in_a_folder_of_the_run(course: Folder) -> None:
    script = '```made file=examples/x.made\necho "made"\n```\n\n```output\n```\n'
    course.write(course.lesson(), f"## Made\n\n{script}")
    before = course.tree()
    assert course.run("update").status == 0
    assert "```output\nmade\n```" in course.text(course.lesson())
    assert set(course.tree()) - set(before) == {
        "examples/.extracted.json",
        "examples/x.made",
        course.lesson().replace(".md", ".recorded.txt"),
    }


def test_a_failure_is_shown_at_the_line_that_the_program_names(course: Folder) -> None:
    script = 'echo begun\necho "examples/bad.sh:2: no such body" >&2\nexit 3\n'
    course.write(course.lesson(), f"## Bad\n\n```sh file=examples/bad.sh\n{script}```\n")
    result = course.run("check")
    assert result.status == 1
    assert "error[script-failed]: `examples/bad.sh` exited with status 3" in result.out
    assert f"--> {course.lesson()}:5:1" in result.out
    course.replace(course.lesson(), "exit 3", "kill -SEGV $$")
    assert "`examples/bad.sh` was ended by SIGSEGV" in course.run("check").out
    course.write(course.lesson(), "## Bad\n\n```lost file=examples/a\nx\n```\n")
    course.replace("content/course.toml", "lisp = ", 'lost = [["./nowhere", "{file}"]]\nlisp = ')
    assert "./nowhere cannot be started: No such file or directory" in course.run("check").out


def test_a_sandbox_holds_what_a_runner_starts(course: Folder) -> None:
    script = "echo harm > harm.txt || echo refused\n"
    text = f"## Harm\n\n```sh file=examples/a.sh\n{script}```\n\n```output\nrefused\n```\n"
    course.write(course.lesson(), text)
    course.run("check", "--sandbox").require_success()
    assert not (course.root / "harm.txt").exists()


def test_code_of_other_tools_stays_code(course: Folder) -> None:
    text = "## Code\n\n```js file=./src/say-hi.js\nlet x = \n```\n\n```rust show=tui\nfn\n```\n"
    course.write(course.lesson(), text + '\n```c title="a.c" linenos\nint x;\n```\n')
    course.run("check", "--strict").require_success()


def test_lines_of_a_file_of_any_language_are_shown(course: Folder) -> None:
    course.write("src/step.c", "double x;\n\ndouble v;\n")
    course.write(course.lesson(), "## Step\n\n```c show=src/step.c#L3\n```\n")
    assert course.run("update").status == 0
    assert "```c show=src/step.c#L3\ndouble v;\n```" in course.text(course.lesson())
    course.write("src/step.c", "double x;\n\nfloat v;\n")
    assert "error[source-part]" in course.run("check").out
