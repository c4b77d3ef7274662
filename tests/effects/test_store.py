"""Kept results: damaged, half-written, by two writers at once, in places that take no files."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.effects import store
from coursebuild.effects.store import keep, kept, load

KEY = "0" * 64


class Maker:
    """Counts how often it is asked."""

    def __init__(self, data: bytes = b"made") -> None:
        self.data, self.calls = data, 0

    def __call__(self) -> bytes:
        self.calls += 1
        return self.data


def entry(root: Path) -> Path:
    return root / ".coursebuild" / "kind" / KEY


def test_made_once(tmp_path: Path) -> None:
    maker = Maker(b"\x00\xff" * 1000)
    assert [kept(tmp_path, "kind", KEY, maker) for _ in range(3)] == [maker.data] * 3
    assert maker.calls == 1
    assert (tmp_path / ".coursebuild/.gitignore").read_text() == "*\n"


def test_another_key_or_kind_is_another_result(tmp_path: Path) -> None:
    assert kept(tmp_path, "kind", KEY, Maker(b"a")) == b"a"
    assert kept(tmp_path, "kind", "1" * 64, Maker(b"b")) == b"b"
    assert kept(tmp_path, "other", KEY, Maker(b"c")) == b"c"


def test_nothing_is_a_result_too(tmp_path: Path) -> None:
    maker = Maker(b"")
    assert kept(tmp_path, "kind", KEY, maker) == kept(tmp_path, "kind", KEY, maker) == b""
    assert maker.calls == 1


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: data[:-1],
        lambda data: data + b"x",
        lambda data: data[:31],
        lambda data: data[:32],
        lambda data: bytes([data[0] ^ 1]) + data[1:],
        lambda data: data[:-1] + bytes([data[-1] ^ 1]),
    ],
)
def test_a_damaged_entry_is_made_again(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    kept(tmp_path, "kind", KEY, Maker())
    path = entry(tmp_path)
    path.write_bytes(damage(path.read_bytes()))
    assert load(tmp_path, "kind", KEY) is None
    maker = Maker()
    assert kept(tmp_path, "kind", KEY, maker) == b"made"
    assert kept(tmp_path, "kind", KEY, maker) == b"made"
    assert maker.calls == 1


def test_what_is_not_there(tmp_path: Path) -> None:
    assert load(tmp_path, "kind", KEY) is None
    assert not (tmp_path / ".coursebuild").exists()


def test_an_entry_that_is_a_folder(tmp_path: Path) -> None:
    entry(tmp_path).mkdir(parents=True)
    assert kept(tmp_path, "kind", KEY, Maker()) == b"made"


def test_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    """A file is where the folder should be; permissions would not hold back root."""
    (tmp_path / ".coursebuild").write_text("in the way")
    maker = Maker()
    assert kept(tmp_path, "kind", KEY, maker) == kept(tmp_path, "kind", KEY, maker) == b"made"
    assert maker.calls == 2


def test_a_read_only_folder(held_back: Path) -> None:
    held_back.chmod(0o500)
    maker = Maker()
    try:
        assert kept(held_back, "kind", KEY, maker) == kept(held_back, "kind", KEY, maker) == b"made"
        assert list(held_back.iterdir()) == []
    finally:
        held_back.chmod(0o700)
    assert maker.calls == 2


def test_a_full_disk_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(store.Path, "replace", full)
    assert kept(tmp_path, "kind", KEY, Maker()) == b"made"
    assert list(entry(tmp_path).parent.iterdir()) == []


def test_what_fails_is_not_kept(tmp_path: Path) -> None:
    def fail() -> bytes:
        raise RuntimeError("no")

    with pytest.raises(RuntimeError):
        kept(tmp_path, "kind", KEY, fail)
    assert kept(tmp_path, "kind", KEY, Maker()) == b"made"


def test_writers_and_readers_at_the_same_time(tmp_path: Path) -> None:
    """Whoever reads sees one of the whole entries, and no temporary file stays."""
    datas = [bytes([i]) * 200_000 for i in range(4)]
    wrong: list[bytes] = []
    stop = threading.Event()

    def write(data: bytes) -> None:
        for _ in range(10):
            keep(tmp_path, "kind", KEY, data)

    def read() -> None:
        while not stop.is_set():
            found = load(tmp_path, "kind", KEY)
            if found is not None and found not in datas:
                wrong.append(found)

    reader = threading.Thread(target=read)
    writers = [threading.Thread(target=write, args=(data,)) for data in datas]
    reader.start()
    for thread in writers:
        thread.start()
    for thread in writers:
        thread.join()
    stop.set()
    reader.join()
    assert wrong == []
    assert [path.name for path in entry(tmp_path).parent.iterdir()] == [KEY]
    assert load(tmp_path, "kind", KEY) in datas
