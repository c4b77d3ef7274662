"""`update`: it changes outputs, figures and no other byte, and overwrites nobody's work."""

from __future__ import annotations

import ctypes
import platform
import re
import stat
import subprocess

import pytest

from support.fixture_cases import fixture_text
from support.lab_lessons import BALL, RIGHT
from support.lab_lessons import fence as lab_fence
from support.scratch_course import GOOD, WAIT_FOR_GO, Make, block, command, kill_at_end
from support.waiting import wait_until

pytestmark = pytest.mark.site


FULL_LESSON = fixture_text("documents/updated.md")

UPDATED_LESSON = (
    FULL_LESSON.replace(
        "```text\nOLD\n```\n\n> [!note]", "```text\nalpha 1.5\n\nbeta    -0.25\n```\n\n> [!note]"
    )
    .replace("> ```text\n> OLD\n> lines\n", "> ```text\n> quoted\n>\n>     indented\n")
    .replace("~~~output digits\n", "~~~output digits\n   listed\n")
)


def test_update_changes_outputs_and_no_other_byte(make: Make) -> None:
    """Not even line ends of Windows or a byte order mark."""
    folder = make(("\ufeff" + FULL_LESSON).replace("\n", "\r\n").encode())
    folder.main("update").require_success()
    text = folder.text(folder.lesson())
    assert text == ("\ufeff" + UPDATED_LESSON).replace("\n", "\r\n").replace("never", clock(text))
    assert folder.main("check").status == 0
    assert folder.main("update").status == 0
    assert folder.text(folder.lesson()) == text  # volatile text too


def clock(text: str) -> str:
    """What stands in the volatile block."""
    return text[text.rindex("volatile") :].split()[1]


def test_update_writes_what_drifted_in_the_chosen_lessons_and_nothing_the_second_time(
    make: Make,
) -> None:
    stale = [f"## {n}\n\n" + block(f"{n}.py", f"print('{n}')", "OLD") for n in "abc"]
    folder = make(*stale, GOOD)
    assert folder.main("check").status == 1
    result = folder.main("update", "1.2", "three", "four")
    assert "\n3 lessons, 0 scripts run, 3 cached" in result.out
    assert folder.text(folder.lesson(1)) == stale[0]
    assert folder.text(folder.lesson(2)) == stale[1].replace("OLD", "b")
    assert folder.text(folder.lesson(3)) == stale[2].replace("OLD", "c")
    once = folder.tree("content")
    times = {path: (folder.root / "content" / path).stat().st_mtime_ns for path in once}
    result = folder.main("update", "1.2", "three", "four")
    assert result.status == 0
    assert "\nevery recorded output is up to date\n" in result.out
    assert "\n3 lessons, 0 scripts run, 3 cached" in result.out
    assert folder.tree("content") == once
    assert {p: (folder.root / "content" / p).stat().st_mtime_ns for p in once} == times


def test_what_was_neither_run_nor_tried_does_not_hold(make: Make) -> None:
    folder = make(GOOD, f"## Two\n\n{lab_fence(RIGHT)}" + block("two.py", "print(2)"))
    folder.write("models/ball.xml", BALL)
    for arguments, counts, claim in (
        (("extract",), "2 lessons, 0 scripts run", "2 scripts that were not run and 1 lab"),
        (("update",), "2 lessons, 1 script run", "1 script that was not run and 1 lab"),
        (("update", "1.1"), "1 lesson, 0 scripts run, 1 cached", ""),
    ):
        result = folder.main(*arguments)
        last = result.out.splitlines()[-1]
        assert result.status == 0 and last.startswith(f"{counts}: "), result.out
        assert (claim in last, "everything holds" in last) == (True, not claim), last
        assert "unasked" not in result.out


def test_dry_run_shows_the_difference_and_writes_nothing(make: Make) -> None:
    folder = make(GOOD.replace("hello 3.14159\n", "hello 3.14158\n"), GOOD.replace("hello", "two"))
    folder.main("extract")
    before = folder.tree()
    result = folder.main("update", "--dry-run")
    assert result.status == 1
    assert result.out.endswith("\n2 lessons, 2 scripts run: 1 file to update\n")
    assert (
        f"would update {folder.lesson()}\n"
        f"--- {folder.lesson()}\n"
        f"+++ {folder.lesson()}\n"
        "@@ -9,3 +9,3 @@\n"
        " ```text\n"
        "-hello 3.14158\n"
        "+hello 3.14159\n"
        " ```\n"
    ) in result.out
    assert folder.tree() == before


def test_a_script_that_fails_is_told_at_its_line_as_it_is_now(make: Make) -> None:
    folder = make(
        "## One\n\n"
        + block("grows.py", "for i in range(9):\n    print(i)", "0")
        + block("fails.py", "print('a')\n1/0", "OLD")
    )
    result = folder.main("update")
    assert result.status == 1
    line = folder.text(folder.lesson()).splitlines().index("1/0") + 1
    assert line > 20
    assert f"--> {folder.lesson()}:{line}:1\n" in result.out
    assert "OLD" in folder.text(folder.lesson())
    assert "up to date" not in result.out


def test_an_update_of_a_course_with_other_mistakes(make: Make) -> None:
    latin = b"## One\n\ncaf\xe9\n\n" + block("x.py", "print(1)", "OLD").encode()
    folder = make(latin, GOOD.replace("hello 3.14159\n", "OLD\n") + "[gone](lesson:7.7)\n")
    result = folder.main("update")
    assert result.status == 1
    assert "error[link-lesson]" in result.out
    assert "error[file-encoding]: byte 0xe9 is not UTF-8" in result.out
    assert folder.read(folder.lesson(1)) == latin
    assert "hello 3.14159\n" in folder.text(folder.lesson(2))


def test_update_writes_the_parts_of_files_that_a_lesson_shows(make: Make) -> None:
    fence = "   ```python show=src/ball.py#Ball.fall\n{}   ```\n"
    folder = make("## One\n\n1. It falls:\n\n" + fence.format("") + "\n" + GOOD)
    folder.write(
        "src/ball.py", "class Ball:\n    @property\n    def fall(self):\n\n        return 1\n"
    )
    result = folder.main("check")
    assert (result.status, result.out.count("error[")) == (1, 1)
    assert "this differs from what `src/ball.py` holds" in result.out
    assert folder.main("update").status == 0
    part = "   @property\n   def fall(self):\n\n       return 1\n"
    assert fence.format(part) in folder.text(folder.lesson())
    assert folder.main("build").status == 0
    assert "src/ball.py" in folder.text("public/lessons/1.1-one.html")
    folder.replace("src/ball.py", "return 1", "return 2")
    result = folder.main("build")
    assert "it has `return 2` here" in result.out


TRAIN = fixture_text("documents/train.md")


def test_long_work_is_run_only_when_that_is_asked_for(make: Make) -> None:
    info = "record=once writes=runs/"
    folder = make(
        "## One\n\n" + block("train.py", TRAIN, "12 0", info=info) + "It has `12`{out}.\n"
    )
    folder.write("models/data.txt", "12")

    def rules(*command: str) -> list[str]:
        return re.findall(r"error\[([\w-]+)\]", folder.main(*command).out)

    assert rules("check") == ["recorded-run"]
    assert rules("update") == ["recorded-run"]
    assert not (folder.root / "runs").exists()
    assert rules("update", "--long") == []
    assert "12 1\n" in folder.text(folder.lesson())
    assert folder.text("runs/count") == "+", "it runs once"
    assert folder.main("build", "--no-cache").status == 0
    assert folder.text("runs/count") == "+"
    page = folder.text("public/lessons/1.1-one.html")
    assert "Recorded once (" in page and platform.machine() in page
    lesson = folder.text(folder.lesson())
    for path, old, new, rule in (
        (folder.lesson(), "len(os", "1 * len(os", "recorded-run"),
        ("models/data.txt", "12", "13", "recorded-run"),
        (folder.lesson(), "12 1", "12 2", "output-drift"),
        (folder.lesson(), "`12`", "`15`", "binding-mismatch"),
    ):
        folder.replace(path, old, new)
        assert rules("check") == [rule], new
        folder.replace(path, new, old)
    assert rules("update") == [] and folder.text(folder.lesson()) == lesson
    folder.write("models/data.txt", "13")
    assert rules("check", "--long") == ["recorded-run", "output-drift"]
    assert rules("update", "--long") == []
    assert "It has `13`{out}." in folder.text(folder.lesson())
    assert folder.text("runs/count") == "++"


STALE = GOOD.replace("hello 3.14159\n", "OLD\n")


def test_a_lesson_saved_or_removed_meanwhile_is_not_written(make: Make) -> None:
    saves = "from pathlib import Path\np = Path('{}')\np.write_text(p.read_text() + 'saved')\n"
    removes = "from pathlib import Path\nPath('{}').unlink(missing_ok=True)\nprint(3)"
    first, third = "content/lessons/1.1-one.md", "content/lessons/1.3-three.md"
    folder = make(
        "## One\n\n" + block("x.py", "print(1)", "OLD"),
        "## Two\n\n" + block("y.py", saves.format(first) + "print(2)", "OLD"),
        "## Three\n\n" + block("z.py", removes.format(third), "OLD"),
    )
    before = folder.text(first)
    result = folder.main("update")
    assert result.status == 1
    assert f"{first} was changed in the meantime" in result.out
    assert "run the command again" in result.out
    assert folder.text(first) == before + "saved"
    assert "2\n```" in folder.text(folder.lesson(2))
    assert f"updated {folder.lesson(2)}" in result.out
    assert f"{third} was removed in the meantime" in result.out
    assert not (folder.root / third).exists()


def test_a_lesson_with_a_merge_conflict_is_neither_updated_nor_formatted(make: Make) -> None:
    conflict = "<<<<<<< HEAD\nIt  is two.\n=======\nIt is  three.\n>>>>>>> three\n"
    folder = make(STALE + "\n" + conflict)
    before = folder.text(folder.lesson())
    for command_name in ("check", "update", "fmt"):
        result = folder.main(command_name)
        assert result.status == 1, result.out
        assert "output-drift" not in result.out
        assert folder.text(folder.lesson()) == before
    folder.write(folder.lesson(), STALE)
    assert folder.main("update").status == 0


def test_merge_conflicts_are_found_in_files_that_lessons_only_use(make: Make) -> None:
    folder = make(GOOD)
    conflict = "x = 1\n<<<<<<< HEAD\ny = 2\n=======\ny = 3\n>>>>>>> three\n"
    files = ("lib/helper.py", "theme/look.css", "content/data.csv")
    for path in files:
        folder.write(path, conflict)
    course_map = folder.text("content/course.toml")
    course_map = course_map.replace("[course]\n", '[course]\npackages = ["lib"]\n', 1)
    folder.write("content/course.toml", course_map + '\n[theme]\ncss = ["theme/look.css"]\n')
    result = folder.main("check")
    assert result.out.count("error[merge-conflict]") == 3, result.out
    assert all(f"--> {path}:2:1" in result.out for path in files), result.out


def test_update_keeps_permissions_and_leaves_a_read_only_lesson_alone(make: Make) -> None:
    """Even as root, who could write it."""
    folder = make(STALE, "## Two\n\n" + block("y.py", "print(2)", "OLD"))
    path, second = folder.root / folder.lesson(), folder.root / folder.lesson(2)
    path.chmod(0o444)
    second.chmod(0o640)
    before = path.stat()
    for options in (["--dry-run"], []):
        result = folder.main("update", *options)
        assert result.status == 1
        assert (
            f"""error[output-not-updatable]: {folder.lesson()} is read-only
  --> {folder.lesson()}:10:1
    |
 10 | OLD
    | ^^^
    = help: nothing was written to it; make it writable, and run the command again
"""
            in result.out
        )
        assert f"update {folder.lesson()}" not in result.out
    after = path.stat()
    assert (after.st_ino, after.st_mode) == (before.st_ino, before.st_mode)
    assert folder.text(folder.lesson()) == STALE
    assert "2\n```" in folder.text(folder.lesson(2))
    assert stat.S_IMODE(second.stat().st_mode) == 0o640
    assert f"updated {folder.lesson(2)}" in result.out
    path.chmod(0o644)
    folder.write(folder.lesson(), GOOD)
    path.chmod(0o444)
    assert folder.main("update").status == 0  # there is nothing to write


def _as_an_ordinary_user() -> None:
    """Drop the capabilities by which root may write everywhere, from the next `exec` on."""
    drop, override, search = 24, 1, 2  # PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
    libc = ctypes.CDLL(None)
    for capability in (override, search):
        libc.prctl(drop, capability, 0, 0, 0)


def test_update_tells_what_cannot_be_read_or_written(make: Make) -> None:
    unreadable = "## Two\n\n" + block("y.py", "print(2)", "OLD")
    folder = make(STALE, unreadable)
    folder.main("extract")
    lessons = folder.root / "content/lessons"
    (folder.root / folder.lesson(2)).chmod(0)
    lessons.chmod(0o555)
    try:
        result = subprocess.run(
            command("update"),
            cwd=folder.root,
            env=folder.environment(),
            capture_output=True,
            text=True,
            preexec_fn=_as_an_ordinary_user,
        )
    finally:
        lessons.chmod(0o755)
    assert result.returncode == 1, result.stdout + result.stderr
    assert f"{folder.lesson()} cannot be written: permission denied" in result.stdout
    message = f"error[file-unreadable]: {folder.lesson(2)} cannot be read: permission denied"
    assert message in result.stdout
    assert "error[lesson-missing]" not in result.stdout
    assert folder.text(folder.lesson()) == STALE
    assert len(list(lessons.iterdir())) == 2


def test_build_and_update_begun_together_take_turns(make: Make) -> None:
    """A build and an update at once: one waits for the other, and both succeed."""
    folder = make(
        "## One\n\n" + block("x.py", WAIT_FOR_GO + "print(1)", "OLD", info="timeout=600"), GOOD
    )
    outputs = folder.tmp / "update", folder.tmp / "build"
    quiet = {"stdout": subprocess.DEVNULL}

    def waits() -> list[bool]:
        return [b"waiting for it" in path.read_bytes() for path in outputs]

    with (
        outputs[0].open("wb") as to_update,
        outputs[1].open("wb") as to_build,
        kill_at_end(folder.start("update", **quiet, stderr=to_update.fileno())) as update,
        kill_at_end(folder.start("build", **quiet, stderr=to_build.fileno())) as build,
    ):
        wait_until(lambda: any(waits()), "one that waits for the other")
        folder.write("go", "")
        assert update.wait(600) == 0
        build.wait(600)
    waited = waits()
    assert waited.count(True) == 1
    assert build.returncode == (0 if waited[1] else 1)  # drift, if the build came first
    assert "1\n```" in folder.text(folder.lesson())
    assert folder.main("build").status == 0
    assert not [name for name in folder.entries() if "tmp" in name or ".new" in name]
