"""States of files: what changes shows, what does not change is not read again."""

from __future__ import annotations

import builtins
import hashlib
import os
import time
from pathlib import Path

import pytest

from coursebuild.core.engine import digests as module
from coursebuild.core.engine.digests import (
    ABSENT,
    FOLDER,
    SPECIAL,
    Clock,
    Digests,
)
from coursebuild.core.engine.memo import Memo


def sha(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "a file"
    path.write_bytes(b"one")
    return path


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The files that are opened."""
    found: list[str] = []
    real = builtins.open

    def opened(path: object, *args: object, **keywords: object) -> object:
        found.append(str(path))
        return real(path, *args, **keywords)  # type: ignore[call-overload]

    monkeypatch.setattr(module, "open", opened, raising=False)
    return found


@pytest.fixture
def later(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock of this process stands an hour ahead, so that no file is too young."""
    real = time.time_ns
    monkeypatch.setattr(module.time, "time_ns", lambda: real() + 3_600_000_000_000)


def test_states(tmp_path: Path, file: Path) -> None:
    digests = Digests(Memo(tmp_path))
    assert digests.file(str(file)) == sha(b"one")
    assert digests.file(str(tmp_path / "not there")) == ABSENT
    assert digests.file(str(file / "below a file")) == ABSENT
    assert digests.file(str(tmp_path)) == FOLDER
    assert digests.file("/dev/zero") == SPECIAL
    assert digests.file("a\0b") == ABSENT
    os.mkfifo(tmp_path / "pipe")
    assert digests.file(str(tmp_path / "pipe")) == SPECIAL
    assert digests.file(str(tmp_path / ("x" * 5000))).startswith("unreadable: file name too long")


def test_a_file_that_may_not_be_read(held_back: Path) -> None:
    file = held_back / "a file"
    file.write_bytes(b"one")
    assert Digests(Memo(held_back)).file(str(file)) == sha(b"one")
    file.chmod(0)
    assert Digests(Memo(held_back)).file(str(file)) == "unreadable: permission denied"


@pytest.mark.usefixtures("later")
def test_an_unchanged_file_is_read_once(tmp_path: Path, file: Path, reads: list[str]) -> None:
    store = Memo(tmp_path)
    for _ in range(3):
        digests = Digests(store)
        assert digests.file(str(file)) == sha(b"one")
        assert digests.file(str(file)) == sha(b"one")
        digests.save()
    assert reads == [str(file)]
    os.utime(file)
    assert Digests(store).file(str(file)) == sha(b"one")
    assert len(reads) == 2, "its times changed, so it is read, and is the same"


def test_a_file_changed_a_moment_ago_is_read_again(
    tmp_path: Path, file: Path, reads: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = file.stat().st_mtime_ns + module._TICK // 2
    monkeypatch.setattr(module.time, "time_ns", lambda: now)
    store = Memo(tmp_path)
    for _ in range(3):
        digests = Digests(store)
        digests.file(str(file))
        digests.save()
    assert len(reads) == 3


@pytest.mark.usefixtures("later")
def test_an_edit_of_the_same_size_and_time(tmp_path: Path, file: Path) -> None:
    store = Memo(tmp_path)
    status = file.stat()
    first = Digests(store)
    first.file(str(file))
    first.save()
    file.write_bytes(b"two")
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert file.stat().st_mtime_ns == status.st_mtime_ns
    assert Digests(store).file(str(file)) == sha(b"two")


@pytest.mark.usefixtures("later")
@pytest.mark.parametrize(
    "data", [b"", b"[]", b"null", b'{"a": 3}', b'{"a": [1]}', b"\xff", b"[" * 99999]
)
def test_a_damaged_memory_of_digests(tmp_path: Path, file: Path, data: bytes) -> None:
    store = Memo(tmp_path)
    store.put(module._KIND, module._KEY, data, local=True)
    digests = Digests(store)
    assert digests.file(str(file)) == sha(b"one")
    digests.save()
    assert Digests(store).file(str(file)) == sha(b"one")


# --- listings


# --- since when


def test_where_the_clock_cannot_be_read(tmp_path: Path, file: Path) -> None:
    (tmp_path / ".coursebuild").write_text("in the way")
    clock = Clock(Memo(tmp_path))
    before = time.time_ns()
    assert before - module._LAG <= clock.now() <= time.time_ns()
    clock.tick()
