"""One writer at a time; no lock and no temporary folder outlives its holder."""

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

from coursebuild.core.files.locks import (
    is_abandoned,
    project_lock,
    remove_abandoned_folders,
    temporary_folder,
)
from support.run_code import program
from support.runners import SOURCE_TREE
from support.scratch_course import without_locks
from support.waiting import wait_until


def holder(root: Path, before: str = "") -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", before + program("hold"), str(root)],
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


NAME = "coursebuild.tmp.abcdefgh"


def start(temporary: Path) -> tuple[subprocess.Popen[str], Path]:
    """A process with a temporary folder, which ends when its input closes."""
    process = subprocess.Popen(
        [sys.executable, "-c", program("hold_folder")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=SOURCE_TREE,
        env={**os.environ, "TMPDIR": str(temporary)},
    )
    assert process.stdout is not None
    return process, Path(process.stdout.readline().strip())


def test_folders_of_killed_processes_go_and_those_of_others_stay(temporary: Path) -> None:
    living, survivor = start(temporary)
    killed, left = start(temporary)
    with living, killed:
        killed.kill()
        killed.wait()
        assert {*temporary.iterdir()} == {survivor, left}
        remove_abandoned_folders()
        assert [*temporary.iterdir()] == [survivor]
        living.communicate("")
    assert [*temporary.iterdir()] == []


def test_what_is_no_temporary_folder_of_this_user_stays(temporary: Path, tmp_path: Path) -> None:
    """A link, a file, a folder that others may read, folders of other names or another user."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    (elsewhere / "precious").touch()
    (temporary / NAME).symlink_to(elsewhere)
    (temporary / "coursebuild.tmp.aaaaaaaa").touch()
    (temporary / "coursebuild.tmp.bbbbbbbb").mkdir(mode=0o755)
    for name in ("coursebuild.examples", "coursebuild.tmp.longer_name", "coursebuild"):
        (temporary / name).mkdir(mode=0o700)
    if os.geteuid() == 0:
        (temporary / NAME.replace("a", "d")).mkdir(mode=0o700)
        os.chown(temporary / NAME.replace("a", "d"), 65534, 65534)
    link_holder = temporary / "coursebuild.tmp.cccccccc"
    link_holder.mkdir(mode=0o700)
    (link_holder / "link").symlink_to(elsewhere)
    before = {*temporary.iterdir()}
    remove_abandoned_folders()
    assert {*temporary.iterdir()} == before - {link_holder}
    assert (elsewhere / "precious").exists()


@pytest.mark.parametrize("mode", [0o777, 0o770])
def test_where_others_can_move_folders_none_is_removed(temporary: Path, mode: int) -> None:
    (temporary / NAME).mkdir(mode=0o700)
    temporary.chmod(mode)
    remove_abandoned_folders()
    assert [*temporary.iterdir()] == [temporary / NAME]
    temporary.chmod(0o1777)
    remove_abandoned_folders()
    assert [*temporary.iterdir()] == []


def test_processes_that_begin_at_once_all_have_their_folders(temporary: Path) -> None:
    """None takes another's new folder for an abandoned one."""
    code = """
import os
from coursebuild.core.files.locks import remove_abandoned_folders, temporary_folder
remove_abandoned_folders()
with temporary_folder() as at: assert os.path.isdir(at)
"""
    environment = {**os.environ, "TMPDIR": str(temporary)}
    processes = [
        subprocess.Popen([sys.executable, "-c", code], cwd=SOURCE_TREE, env=environment)
        for _ in range(12)
    ]
    assert [process.wait() for process in processes] == 12 * [0]
    assert [*temporary.iterdir()] == []


def test_threads_each_have_a_folder(temporary: Path) -> None:
    barrier = threading.Barrier(3)
    counts: list[int] = []

    def work() -> None:
        with temporary_folder() as folder:
            barrier.wait()
            counts.append(len([*temporary.iterdir()]))
            barrier.wait()
            assert Path(folder).is_dir()

    threads = [threading.Thread(target=work) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert counts == [3, 3, 3]
    assert [*temporary.iterdir()] == []
