"""States of files: what changes shows, what does not change is not read again."""

from __future__ import annotations

import builtins
import hashlib
import os
import socket
import time
from pathlib import Path

import pytest

from coursebuild.core.engine import digests as module
from coursebuild.core.engine.digests import (
    ABSENT,
    FILE,
    FOLDER,
    SPECIAL,
    Clock,
    Digests,
    changed_since,
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


def test_links_count_by_what_they_lead_to(tmp_path: Path, file: Path) -> None:
    link, broken, circle = tmp_path / "link", tmp_path / "broken", tmp_path / "circle"
    link.symlink_to(file)
    broken.symlink_to(tmp_path / "nothing")
    circle.symlink_to(circle)
    digests = Digests(Memo(tmp_path))
    assert digests.file(str(link)) == sha(b"one")
    assert digests.file(str(broken)) == ABSENT
    assert digests.file(str(circle)).startswith("unreadable: too many levels")
    other = tmp_path / "other"
    other.write_bytes(b"two")
    link.unlink()
    link.symlink_to(other)
    assert Digests(Memo(tmp_path)).file(str(link)) == sha(b"two")


def test_a_file_that_may_not_be_read(held_back: Path) -> None:
    file = held_back / "a file"
    file.write_bytes(b"one")
    assert Digests(Memo(held_back)).file(str(file)) == sha(b"one")
    file.chmod(0)
    assert Digests(Memo(held_back)).file(str(file)) == "unreadable: permission denied"


def test_names_that_are_no_text(tmp_path: Path) -> None:
    path = os.fsdecode(os.fsencode(tmp_path) + b"/\xff\xfe.bin")
    Path(path).write_bytes(b"x")
    store = Memo(tmp_path)
    before = Digests(store).folder(str(tmp_path))
    digests = Digests(store)
    assert digests.file(path) == sha(b"x")
    digests.save()
    assert Digests(store).file(path) == sha(b"x")
    Path(path).unlink()
    assert Digests(store).folder(str(tmp_path)) != before


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
def test_a_file_put_in_the_place_of_another(tmp_path: Path, file: Path) -> None:
    store = Memo(tmp_path)
    first = Digests(store)
    first.file(str(file))
    first.save()
    status = file.stat()
    other = tmp_path / "new"
    other.write_bytes(b"two")
    os.utime(other, ns=(status.st_atime_ns, status.st_mtime_ns))
    other.replace(file)
    assert Digests(store).file(str(file)) == sha(b"two")
    file.unlink()
    file.mkdir()
    assert Digests(store).file(str(file)) == FOLDER


def test_a_clock_that_was_set_back(
    tmp_path: Path, file: Path, reads: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The times of files lie in the future: nothing is trusted that they say."""
    monkeypatch.setattr(module.time, "time_ns", lambda: 1_000_000_000)
    store = Memo(tmp_path)
    for _ in range(2):
        digests = Digests(store)
        assert digests.file(str(file)) == sha(b"one")
        digests.save()
    assert len(reads) == 2


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


def test_a_listing_is_the_names_and_which_are_folders(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    digests = Digests(Memo(tmp_path))
    seen = [digests.folder(str(folder))]
    (folder / "a").write_text("x")
    seen.append(digests.folder(str(folder)))
    (folder / "a").write_text("something else")
    assert digests.folder(str(folder)) == seen[-1], "what is in the files is no part of a listing"
    (folder / "a").rename(folder / "A")
    seen.append(digests.folder(str(folder)))
    (folder / "A").unlink()
    (folder / "A").mkdir()
    seen.append(digests.folder(str(folder)))
    assert len(set(seen)) == 4
    assert digests.folder(str(tmp_path / "none")) == ABSENT
    (tmp_path / "file").write_text("x")
    assert digests.folder(str(tmp_path / "file")) == FILE


def test_sockets_and_the_like_in_a_listing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as end:
        end.bind("socket")
        assert len(Digests(Memo(tmp_path)).folder(str(tmp_path))) == 64


# --- since when


def test_changed_since(tmp_path: Path, file: Path) -> None:
    clock = Clock(Memo(tmp_path))
    clock.tick()
    start = clock.now()
    assert not changed_since(str(file), start)
    clock.tick()
    file.write_bytes(b"two")
    assert changed_since(str(file), start)


def test_what_is_gone_shows_in_its_folder(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "file").write_text("x")
    clock = Clock(Memo(tmp_path))
    clock.tick()
    start = clock.now()
    assert not changed_since(str(folder / "never there"), start)
    clock.tick()
    (folder / "file").unlink()
    assert changed_since(str(folder / "file"), start)
    assert changed_since(str(folder / "sub/never there"), start)


def test_a_time_of_content_in_the_future_is_no_change(tmp_path: Path, file: Path) -> None:
    os.utime(file, (4_000_000_000, 4_000_000_000))
    clock = Clock(Memo(tmp_path))
    clock.tick()
    assert not changed_since(str(file), clock.now())


def test_where_the_clock_cannot_be_read(tmp_path: Path, file: Path) -> None:
    (tmp_path / ".coursebuild").write_text("in the way")
    clock = Clock(Memo(tmp_path))
    before = time.time_ns()
    assert before - module._LAG <= clock.now() <= time.time_ns()
    clock.tick()
