"""`update` and its files: those that may not be written, and those that change meanwhile."""

from __future__ import annotations

import ctypes
import stat
import subprocess

import pytest

from support.scratch_course import GOOD, WAIT_FOR_GO, Make, block, command, kill_at_end
from support.waiting import wait_until

pytestmark = pytest.mark.site
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
