"""Temporary folders of killed processes are removed by the next one, and nothing else is."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import pytest

from coursebuild.core.files.locks import temporary_folder
from support.run_code import run_code
from support.runners import SOURCE_TREE

MAKE = "from coursebuild.core.files.locks import temporary_folder\n"
HOLD = (
    f"{MAKE}import os, sys\n"
    "with temporary_folder() as folder:\n"
    "    os.mkdir(folder + '/inner', 0o700)\n"
    "    os.chmod(folder + '/inner', 0)\n"
    "    print(folder, flush=True)\n"
    "    sys.stdin.read()\n"
)
NAME = "coursebuild.tmp.abcdefgh"


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """The folder for temporary files."""
    place = tmp_path / "tmp"
    place.mkdir()
    return place


def start(place: Path) -> tuple[subprocess.Popen[str], Path]:
    """A process with a temporary folder, which ends when its input closes."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=SOURCE_TREE,
        env={**os.environ, "TMPDIR": str(place)},
    )
    assert process.stdout is not None
    return process, Path(process.stdout.readline().strip())


def make_another(place: Path) -> None:
    """Make a temporary folder, and remove it."""
    result = run_code(f"{MAKE}with temporary_folder(): pass\n", TMPDIR=str(place))
    assert (result.returncode, result.stderr) == (0, "")


def test_folders_of_killed_processes_go_and_those_of_others_stay(place: Path) -> None:
    living, survivor = start(place)
    killed, left = start(place)
    with living, killed:
        killed.kill()
        killed.wait()
        assert {*place.iterdir()} == {survivor, left}
        make_another(place)
        assert [*place.iterdir()] == [survivor]
        living.communicate("")
    assert [*place.iterdir()] == []


def test_what_is_no_temporary_folder_of_this_user_stays(place: Path, tmp_path: Path) -> None:
    """A link, a file, a folder that others may read, folders of other names or another user."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    (elsewhere / "precious").touch()
    (place / NAME).symlink_to(elsewhere)
    (place / "coursebuild.tmp.aaaaaaaa").touch()
    (place / "coursebuild.tmp.bbbbbbbb").mkdir(mode=0o755)
    for name in ("coursebuild.examples", "coursebuild.tmp.longer_name", "coursebuild"):
        (place / name).mkdir(mode=0o700)
    if os.geteuid() == 0:
        (place / NAME.replace("a", "d")).mkdir(mode=0o700)
        os.chown(place / NAME.replace("a", "d"), 65534, 65534)
    link_holder = place / "coursebuild.tmp.cccccccc"
    link_holder.mkdir(mode=0o700)
    (link_holder / "link").symlink_to(elsewhere)
    before = {*place.iterdir()}
    make_another(place)
    assert {*place.iterdir()} == before - {link_holder}
    assert (elsewhere / "precious").exists()


@pytest.mark.parametrize("mode", [0o777, 0o770])
def test_where_others_can_move_folders_none_is_removed(place: Path, mode: int) -> None:
    (place / NAME).mkdir(mode=0o700)
    place.chmod(mode)
    make_another(place)
    assert [*place.iterdir()] == [place / NAME]
    place.chmod(0o1777)
    make_another(place)
    assert [*place.iterdir()] == []


def test_processes_that_begin_at_once_all_have_their_folders(place: Path) -> None:
    """None takes another's new folder for an abandoned one."""
    code = f"{MAKE}import os\nwith temporary_folder() as at: assert os.path.isdir(at)\n"
    environment = {**os.environ, "TMPDIR": str(place)}
    processes = [
        subprocess.Popen([sys.executable, "-c", code], cwd=SOURCE_TREE, env=environment)
        for _ in range(12)
    ]
    assert [process.wait() for process in processes] == 12 * [0]
    assert [*place.iterdir()] == []


def test_threads_each_have_a_folder(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    barrier = threading.Barrier(3)
    counts: list[int] = []

    def work() -> None:
        with temporary_folder() as folder:
            barrier.wait()
            counts.append(len([*place.iterdir()]))
            barrier.wait()
            assert Path(folder).is_dir()

    threads = [threading.Thread(target=work) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert counts == [3, 3, 3]
    assert [*place.iterdir()] == []
