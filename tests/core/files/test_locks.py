"""One writer at a time, and no lock outlives its holder."""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from coursebuild.core.files.locks import is_abandoned, project_lock
from support.runners import SOURCE_TREE
from support.scratch_course import without_locks
from support.waiting import wait_until

HOLD = """
import sys
from pathlib import Path
from coursebuild.core.files.locks import project_lock
with project_lock(Path(sys.argv[1]), lambda said: print(said, flush=True)):
    print("held", flush=True)
    sys.stdin.read()
print("done", flush=True)
"""
"""Holds the lock of a course until its input is closed."""


def holder(root: Path, before: str = "") -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", before + HOLD, str(root)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=SOURCE_TREE,
    )


def line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


def test_free_lock_says_nothing(tmp_path: Path) -> None:
    with project_lock(tmp_path, pytest.fail):
        pass
    assert (tmp_path / ".coursebuild/.gitignore").read_bytes() == b"*\n"
    with pytest.raises(KeyboardInterrupt), project_lock(tmp_path, pytest.fail):
        raise KeyboardInterrupt
    with project_lock(tmp_path, pytest.fail):  # freed by the exception
        pass
    with project_lock(tmp_path / ".coursebuild/lock", pytest.fail):  # which is no folder
        pass


@pytest.mark.site
@pytest.mark.parametrize("is_removed", [False, True])
def test_second_run_says_so_and_waits(tmp_path: Path, is_removed: bool) -> None:
    """Also where somebody removes the lock meanwhile; a lock dies with its holder."""
    with holder(tmp_path) as first:
        assert line(first) == "held"
        with holder(tmp_path) as second:
            holder_name = f"another coursebuild (process {first.pid})"
            assert line(second) == f"{holder_name} is at work on this course; waiting for it"
            assert second.poll() is None
            if is_removed:
                shutil.rmtree(tmp_path / ".coursebuild")
            first.send_signal(signal.SIGKILL)
            assert line(second) == "held"
            assert (tmp_path / ".coursebuild/lock").read_text() == f"{second.pid}\n"
            assert second.communicate()[0] == "done\n"


@pytest.mark.site
@pytest.mark.parametrize("error", ["ENOLCK", "ENOSYS", "EOPNOTSUPP"])
def test_second_run_says_so_and_waits_without_locks(tmp_path: Path, error: str) -> None:
    """A file that a killed run has left is no lock, and none is left by one that ends."""
    before = without_locks(error)
    with holder(tmp_path, before) as first:
        assert line(first) == "held"
        with holder(tmp_path, before) as second:
            message, _, cure = line(second).partition(" (if there is none, ")
            holder_name = f"another coursebuild (process {first.pid})"
            assert message == f"{holder_name} is at work on this course; waiting for it"
            assert cure == f"remove {tmp_path / '.coursebuild/lock-held'})"
            first.send_signal(signal.SIGKILL)
            first.wait()
            assert line(second) == "held"
            second.send_signal(signal.SIGKILL)
            second.wait()
            with holder(tmp_path, before) as third:
                assert third.communicate()[0].splitlines()[-2:] == ["held", "done"]
    assert sorted(path.name for path in (tmp_path / ".coursebuild").iterdir()) == [
        ".gitignore",
        "lock",
        "owner",
    ]


def test_another_thread_waits(tmp_path: Path) -> None:
    order: list[str] = []

    def work() -> None:
        with project_lock(tmp_path, lambda message: order.append("waits")):
            order.append("second")

    with project_lock(tmp_path):
        thread = threading.Thread(target=work)
        thread.start()
        wait_until(lambda: "waits" in order, "the wait")
        order.append("first")
    thread.join()
    assert order == ["waits", "first", "second"]


def test_file_system_without_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(fd: int, operation: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with project_lock(tmp_path, pytest.fail), project_lock(tmp_path / ".coursebuild", pytest.fail):
        pass
    path = tmp_path / "temporary"
    path.touch()
    fd = os.open(path, os.O_RDONLY)
    try:
        assert not is_abandoned(fd)
        os.utime(path, (0, 0))
        assert is_abandoned(fd)
    finally:
        os.close(fd)


@pytest.mark.site
def test_children_do_not_inherit_it(tmp_path: Path) -> None:
    with project_lock(tmp_path):
        child = subprocess.Popen(
            [sys.executable, "-c", "import sys; sys.stdin.read()"], stdin=subprocess.PIPE
        )
    with child:
        with project_lock(tmp_path, pytest.fail):
            pass
        child.communicate()
