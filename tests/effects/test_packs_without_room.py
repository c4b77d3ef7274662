"""Packs in places that take nothing, that are taken away, or that are full."""

from __future__ import annotations

import errno
import os
import shutil
import time
from pathlib import Path

import pytest

from coursebuild.effects import packs
from coursebuild.effects.packs import Packs
from coursebuild.effects.prune import prune
from coursebuild.effects.store import Store
from support.store_packs import KEY, files, heard, key


def test_a_disk_that_fills_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was written half is gone, and what comes later is whole."""
    store = Store(tmp_path)
    told = heard(store)
    store.keep("kind", key(0), b"0" * 100, packed=True)
    real = os.pwritev

    def full(fd: int, parts: tuple[bytes, ...], at: int) -> int:
        return real(fd, [b"".join(parts)[:70]], at)

    def fuller(fd: int, data: bytes, at: int) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "pwritev", full)
        patch.setattr(os, "pwrite", fuller)
        store.keep("kind", key(1), b"1" * 100, packed=True)
    assert told == ["results cannot be kept in .coursebuild: no space left on device"]
    store.keep("kind", key(2), b"2" * 100, packed=True)
    for reader in (store, Store(tmp_path)):
        found = [reader.load("kind", key(number)) for number in range(3)]
        assert found == [b"0" * 100, None, b"2" * 100]


def test_what_is_written_piece_by_piece(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "pwritev")
    real = os.pwrite
    monkeypatch.setattr(os, "pwrite", lambda fd, data, at: real(fd, data[:7], at))
    mine = Packs(tmp_path)
    mine.put("a", b"text of some length")
    mine.close()
    assert Packs(tmp_path).get("a") == b"text of some length"


@pytest.mark.parametrize("where", [".coursebuild", ".coursebuild/packs"])
def test_a_file_in_the_place_of_the_folder(tmp_path: Path, where: str) -> None:
    (tmp_path / where).parent.mkdir(exist_ok=True)
    (tmp_path / where).write_text("in the way")
    store = Store(tmp_path)
    told = heard(store)
    assert store.kept("kind", KEY, lambda: b"a", packed=True) == b"a"
    assert store.kept("kind", KEY, lambda: b"b", packed=True) == b"b"
    assert len(told) == 1 and told[0].startswith("results cannot be kept in .coursebuild: ")
    store.close()


def test_a_folder_that_is_removed_meanwhile(tmp_path: Path) -> None:
    """As with `serve`, which lives long."""
    store = Store(tmp_path)
    store.keep("kind", KEY, b"a", packed=True)
    shutil.rmtree(tmp_path / ".coursebuild")
    assert store.load("kind", KEY) is None
    store.keep("kind", KEY, b"b", packed=True)
    assert store.load("kind", KEY) == Store(tmp_path).load("kind", KEY) == b"b"


def test_strange_things_among_the_packs(tmp_path: Path) -> None:
    folder = tmp_path / packs.FOLDER
    folder.mkdir()
    (folder / key(1)).mkdir()
    (folder / key(2)).write_bytes(b"")
    (folder / key(3)).write_bytes(b"nonsense" * 100)
    (folder / "notes").write_text("mine")
    mine = Packs(tmp_path)
    mine.put("a", b"1")
    mine.close()
    assert Packs(tmp_path).get("a") == b"1"


def test_packs_that_were_not_used_for_longest_go_first(tmp_path: Path) -> None:
    folder = tmp_path / ".coursebuild"
    for number in range(4):
        store = Store(tmp_path)
        store.keep("kind", key(number), bytes([number]) * 1000, packed=True)
        store._packs.close()
    long_ago = time.time() - 10_000
    for number, path in enumerate(files(folder)):
        os.utime(path, (long_ago + number, long_ago + number))
    used = Store(tmp_path)
    assert used.load("kind", key(0)) is not None
    assert prune(folder, 2700) == 2
    found = [Store(tmp_path).load("kind", key(number)) is not None for number in range(4)]
    assert found == [True, False, False, True]
    assert used.load("kind", key(1)) is None, "where it was, there is nothing any more"


def test_a_store_with_little_room_keeps_what_was_made_last(tmp_path: Path) -> None:
    store = Store(tmp_path, size=1 << 20)
    for number in range(200):
        store.keep("kind", key(number), bytes(10_000), packed=True)
        (path, *_) = reversed(files(tmp_path / ".coursebuild"))
        os.utime(path, (1000 + number, 1000 + number))
    store.close()
    left = [n for n in range(200) if Store(tmp_path).load("kind", key(n)) is not None]
    assert left == list(range(200 - len(left), 200))
    assert 80 < len(left) < 105
