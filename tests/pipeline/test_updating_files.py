"""`update` and the files: which may be written, and what others do to them meanwhile."""

from __future__ import annotations

import ctypes
import stat
import subprocess

import pytest

from support.scratch_course import GOOD, HELD, Make, block, command, kill_at_end
from support.waiting import wait_until

pytestmark = pytest.mark.site
STALE = GOOD.replace("hello 3.14159\n", "OLD\n")


def test_a_lesson_saved_or_removed_meanwhile_is_not_written(make: Make) -> None:
    saves = "from pathlib import Path\np = Path('{}')\np.write_text(p.read_text() + 'saved')\n"
    removes = "from pathlib import Path\nPath('{}').unlink(missing_ok=True)\nprint(3)"
    one, three = "content/lessons/1.1-one.md", "content/lessons/1.3-three.md"
    folder = make(
        "## One\n\n" + block("x.py", "print(1)", "OLD"),
        "## Two\n\n" + block("y.py", saves.format(one) + "print(2)", "OLD"),
        "## Three\n\n" + block("z.py", removes.format(three), "OLD"),
    )
    before = folder.text(one)
    done = folder.main("update")
    assert done.status == 1
    assert f"{one} was changed in the meantime" in done.out
    assert "run the command again" in done.out
    assert folder.text(one) == before + "savedsaved"
    assert "2\n```" in folder.text(folder.lesson(2))
    assert f"updated {folder.lesson(2)}" in done.out
    assert f"{three} was removed in the meantime" in done.out
    assert not (folder.root / three).exists()


def test_update_keeps_permissions_and_leaves_a_read_only_lesson_alone(make: Make) -> None:
    """By root too, who may write it."""
    folder = make(STALE, "## Two\n\n" + block("y.py", "print(2)", "OLD"))
    path, other = folder.root / folder.lesson(), folder.root / folder.lesson(2)
    path.chmod(0o444)
    other.chmod(0o640)
    before = path.stat()
    for how in (["--dry-run"], []):
        done = folder.main("update", *how)
        assert done.status == 1
        assert (
            f"""error[output-not-updatable]: {folder.lesson()} is read-only
  --> {folder.lesson()}:10:1
    |
 10 | OLD
    | ^^^
    = help: nothing was written to it; make it writable, and run the command again
"""
            in done.out
        )
        assert f"update {folder.lesson()}" not in done.out
    after = path.stat()
    assert (after.st_ino, after.st_mode) == (before.st_ino, before.st_mode)
    assert folder.text(folder.lesson()) == STALE
    assert "2\n```" in folder.text(folder.lesson(2))
    assert stat.S_IMODE(other.stat().st_mode) == 0o640
    assert f"updated {folder.lesson(2)}" in done.out
    path.chmod(0o644)
    folder.write(folder.lesson(), GOOD)
    path.chmod(0o444)
    assert folder.main("update").status == 0  # there is nothing to write


def _as_an_ordinary_user() -> None:
    """Root may write everywhere but for these capabilities, which are dropped at exec."""
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
        done = subprocess.run(
            command("update"),
            cwd=folder.root,
            env=folder.environment(),
            capture_output=True,
            text=True,
            preexec_fn=_as_an_ordinary_user,
        )
    finally:
        lessons.chmod(0o755)
    assert done.returncode == 1, done.stdout + done.stderr
    assert f"{folder.lesson()} cannot be written: permission denied" in done.stdout
    said = f"error[file-unreadable]: {folder.lesson(2)} cannot be read: permission denied"
    assert said in done.stdout
    assert "error[lesson-missing]" not in done.stdout
    assert folder.text(folder.lesson()) == STALE
    assert len(list(lessons.iterdir())) == 2


def test_build_and_update_begun_together_take_turns(make: Make) -> None:
    """A build and an update, begun together: one waits, and each is whole."""
    folder = make("## One\n\n" + block("x.py", HELD + "print(1)", "OLD", info="timeout=600"), GOOD)
    said = folder.tmp / "update", folder.tmp / "build"
    quiet = {"stdout": subprocess.DEVNULL}

    def waits() -> list[bool]:
        return [b"waiting for it" in path.read_bytes() for path in said]

    with (
        said[0].open("wb") as to_update,
        said[1].open("wb") as to_build,
        kill_at_end(folder.start("update", **quiet, stderr=to_update.fileno())) as update,
        kill_at_end(folder.start("build", **quiet, stderr=to_build.fileno())) as build,
    ):
        wait_until(lambda: any(waits()), "one that waits for the other")
        folder.write("go", "")
        assert update.wait(600) == 0
        build.wait(600)
    waited = waits()
    assert waited.count(True) == 1
    assert build.returncode == (0 if waited[1] else 1)  # drift, where it came first
    assert "1\n```" in folder.text(folder.lesson())
    assert folder.main("build").status == 0
    assert not [name for name in folder.entries() if "tmp" in name or ".new" in name]
