"""States of files and of the tool: every change shows."""

from __future__ import annotations

import hashlib
import os
import sys
import time
from pathlib import Path

import pytest

from coursebuild.core.engine import digests as module
from coursebuild.core.engine import tool
from coursebuild.core.engine.digests import (
    ABSENT,
    FILE,
    FOLDER,
    SPECIAL,
    Clock,
    file_state,
    folder_state,
    modules_in,
)
from coursebuild.core.engine.store import Store
from coursebuild.core.engine.tool import code_digest


def sha(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "a file"
    path.write_bytes(b"one")
    return path


def test_states(tmp_path: Path, file: Path) -> None:
    assert file_state(str(file)) == sha(b"one")
    assert file_state(str(tmp_path / "not there")) == ABSENT
    assert file_state(str(file / "below a file")) == ABSENT
    assert file_state(str(tmp_path)) == FOLDER
    assert file_state("/dev/zero") == SPECIAL
    assert file_state("a\0b") == ABSENT
    os.mkfifo(tmp_path / "pipe")
    assert file_state(str(tmp_path / "pipe")) == SPECIAL
    assert file_state(str(tmp_path / ("x" * 5000))).startswith("unreadable: file name too long")


def test_states_of_folders(tmp_path: Path, file: Path) -> None:
    assert (folder_state(str(file)), folder_state(str(file / "x"))) == (FILE, FILE)
    assert folder_state(str(tmp_path / "not there")) == ABSENT
    states = {folder_state(str(tmp_path))}
    file.write_bytes(b"two")
    assert states == {folder_state(str(tmp_path))}, "only names count"
    file.unlink()
    states.add(folder_state(str(tmp_path)))
    file.mkdir()
    states.add(folder_state(str(tmp_path)))
    assert len(states) == 3


def test_modules_of_a_folder(tmp_path: Path) -> None:
    (tmp_path / "one.py").touch()
    for name in ("two", "three"):
        (tmp_path / name).mkdir()
    (tmp_path / "two/__init__.py").touch()
    assert modules_in(str(tmp_path), ("two", "three", "one", "four")) == "two one"
    assert modules_in(str(tmp_path / "four"), ("one",)) == ""


def test_a_file_that_may_not_be_read(held_back: Path) -> None:
    file = held_back / "a file"
    file.write_bytes(b"one")
    assert file_state(str(file)) == sha(b"one")
    file.chmod(0)
    assert file_state(str(file)) == "unreadable: permission denied"


@pytest.mark.parametrize("hours", [0, 1])
def test_an_edit_of_the_same_size_and_time(
    file: Path, monkeypatch: pytest.MonkeyPatch, hours: int
) -> None:
    """A change shows in a file just written, and in one old enough to be judged by its times."""
    real = time.time_ns
    monkeypatch.setattr(module.time, "time_ns", lambda: real() + hours * 3_600_000_000_000)
    status = file.stat()
    assert file_state(str(file)) == sha(b"one")
    file.write_bytes(b"two")
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert file.stat().st_mtime_ns == status.st_mtime_ns
    assert file_state(str(file)) == sha(b"two")


def test_where_the_clock_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / ".coursebuild").write_text("in the way")
    clock = Clock(Store(tmp_path))
    before = time.time_ns()
    clock.tick()
    assert before - 1_000_000_000 <= clock.now() <= time.time_ns()


def fill(folder: Path) -> Path:
    (folder / "inner").mkdir(parents=True)
    for name in ("a.py", "inner/b.html"):
        (folder / name).write_text("x")
        os.utime(folder / name, ns=(1, 1))
    return folder


def test_it_depends_on_every_file_and_not_on_their_place(tmp_path: Path) -> None:
    folder, second = fill(tmp_path / "one"), fill(tmp_path / "two")
    names = {tool._digest(str(folder))}
    (second / "__pycache__").mkdir()
    (second / "__pycache__" / "a.pyc").write_text("x")
    assert names == {tool._digest(str(second))}
    os.utime(folder / "inner" / "b.html", ns=(2, 2))
    names.add(tool._digest(str(folder)))
    (folder / "a.py").write_text("xy")
    os.utime(folder / "a.py", ns=(1, 1))
    names.add(tool._digest(str(folder)))
    (folder / "c.py").write_text("")
    names.add(tool._digest(str(folder)))
    (folder / "a.py").unlink()
    names.add(tool._digest(str(folder)))
    assert len(names) == 5


def test_every_installed_package_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [str(tmp_path / "nowhere"), str(tmp_path)])
    for name in ("numpy-2.3.dist-info", "black-26.1.dist-info", "black"):
        (tmp_path / name).mkdir()
    assert tool._packages.__wrapped__() == ("black-26.1.dist-info", "numpy-2.3.dist-info")


def test_content_counts_and_times_do_not(tmp_path: Path) -> None:
    (tmp_path / "part" / "inner").mkdir(parents=True)
    module, file = tmp_path / "part" / "inner" / "a.py", tmp_path / "other.py"
    module.write_text("x = 1\n")
    file.write_text("y = 1\n")
    first = code_digest("part", root=tmp_path)
    module.touch()
    file.write_text("y = 2\n")
    assert code_digest("part", root=tmp_path) == first
    digest = code_digest("part", "other.py", root=tmp_path)
    file.write_text("y = 3\n")
    assert code_digest("part", "other.py", root=tmp_path) != digest
    module.rename(tmp_path / "part" / "a.py")
    assert code_digest("part", root=tmp_path) != first
