"""The store under attack: bytes flipped, entries cut, writers killed, many processes, pruned."""

from __future__ import annotations

import errno
import hashlib
import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.effects import prune as pruning
from coursebuild.effects import store as module
from coursebuild.effects.prune import prune, prune_if_due
from coursebuild.effects.store import Store, sealed, unsealed

ROOT = Path(__file__).parents[2]
KEY = hashlib.sha256(b"a key").hexdigest()
NAME = f"kind/{KEY}"


def key(number: int) -> str:
    return hashlib.sha256(str(number).encode()).hexdigest()


def entry(root: Path, name: str = NAME) -> Path:
    return root / ".coursebuild" / name


def heard(store: Store) -> list[str]:
    lines: list[str] = []
    store.listen(lines.append)
    return lines


# --- damage


@given(st.binary(max_size=300), st.data())
def test_no_flipped_byte_is_ever_served(data: bytes, draw: st.DataObject) -> None:
    whole = bytearray(sealed(NAME, data))
    at = draw.draw(st.integers(0, len(whole) - 1))
    whole[at] ^= draw.draw(st.integers(1, 255))
    assert unsealed(NAME, bytes(whole)) is None


@given(st.binary(max_size=200))
def test_no_cut_or_longer_entry_is_served(data: bytes) -> None:
    whole = sealed(NAME, data)
    assert unsealed(NAME, whole) == data
    for end in range(len(whole)):
        assert unsealed(NAME, whole[:end]) is None
    assert unsealed(NAME, whole + b"\0") is None


def test_every_position_of_an_entry_on_the_disk(tmp_path: Path) -> None:
    """Each time the damage is told, the entry is gone, and the next result takes its place."""
    store = Store(tmp_path)
    store.keep("kind", KEY, b"the result")
    whole = entry(tmp_path).read_bytes()
    for at in range(len(whole)):
        entry(tmp_path).write_bytes(whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1 :])
        fresh = Store(tmp_path)
        lines = heard(fresh)
        assert fresh.load("kind", KEY) is None
        said = f"the entry kind/{KEY[:12]}… in .coursebuild is damaged: it is made again"
        assert lines == [said]
        assert not entry(tmp_path).exists()
        assert fresh.kept("kind", KEY, lambda: b"made again") == b"made again"
        assert Store(tmp_path).load("kind", KEY) == b"made again"


def test_an_entry_under_another_name_is_not_served(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.keep("kind", KEY, b"one")
    entry(tmp_path, f"kind/{key(2)}").write_bytes(entry(tmp_path).read_bytes())
    (tmp_path / ".coursebuild/other").mkdir()
    entry(tmp_path, f"other/{KEY}").write_bytes(entry(tmp_path).read_bytes())
    assert store.load("kind", key(2)) is None
    assert store.load("other", KEY) is None
    assert store.load("kind", KEY) == b"one"


def test_damage_found_before_anybody_listens_is_told_later(tmp_path: Path) -> None:
    entry(tmp_path).parent.mkdir(parents=True)
    entry(tmp_path).write_bytes(b"nonsense")
    store = Store(tmp_path)
    assert store.load("kind", KEY) is None
    assert len(heard(store)) == 1


# --- several processes


def write_many(root: str, seed: int) -> None:
    store = Store(Path(root))
    for number in range(40):
        data = f"{number % 5}".encode() * 20_000
        store.keep("kind", key(number % 5), data)
        found = store.load("kind", key((number + seed) % 5))
        if found is not None:
            assert found == found[:1] * 20_000


@pytest.mark.site
def test_several_processes_write_read_and_prune_at_once(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    workers = [context.Process(target=write_many, args=(str(tmp_path), i)) for i in range(3)]
    for worker in workers:
        worker.start()
    while any(worker.is_alive() for worker in workers):
        if (tmp_path / ".coursebuild").is_dir():
            prune(tmp_path / ".coursebuild", 50_000)
        time.sleep(0.002)
    for worker in workers:
        worker.join()
    assert [worker.exitcode for worker in workers] == [0, 0, 0]
    names = {path.name for path in (tmp_path / ".coursebuild/kind").iterdir()}
    assert names <= {key(number) for number in range(5)}


KILLED = """
import os, sys
from pathlib import Path
from coursebuild.effects import store
def stop(self, target):
    print("writing", flush=True)
    sys.stdin.read()
store.Path.replace = stop
store.Store(Path(sys.argv[1])).keep("kind", sys.argv[2], b"x" * 100_000)
"""


def test_a_writer_that_was_killed_leaves_nothing_that_is_served_or_stays(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path), KEY],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert process.stdout is not None and process.stdin is not None
    with process.stdout, process.stdin:
        assert process.stdout.readline() == b"writing\n"
        folder = tmp_path / ".coursebuild/kind"
        assert [path.name[:5] for path in folder.iterdir()] == [".new-"]
        prune(tmp_path / ".coursebuild", 1 << 30)
        assert len(list(folder.iterdir())) == 1, "its writer lives"
        process.kill()
        process.wait()
    store = Store(tmp_path)
    assert store.load("kind", KEY) is None
    left = list(folder.iterdir())
    store.keep("kind", key(2), b"")
    assert [path.name for path in folder.iterdir()] == [key(2)], "the next writer tidies up"
    left[0].write_bytes(b"x" * 100)
    prune(tmp_path / ".coursebuild", 1 << 30)
    assert [path.name for path in folder.iterdir()] == [key(2)]


# --- places that take nothing


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EDQUOT])
def test_a_store_that_cannot_be_written_costs_time_and_is_told_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    def refuse(*_: object, **__: object) -> int:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(module.os, "open", refuse)
    store = Store(tmp_path)
    lines = heard(store)
    assert store.kept("kind", KEY, lambda: b"a") == b"a"
    assert store.kept("kind", key(2), lambda: b"b") == b"b"
    words = os.strerror(code)
    said = f"results cannot be kept in .coursebuild: {words[0].lower()}{words[1:]}"
    assert lines == [said]


def test_a_disk_that_fills_up_while_an_entry_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.fdopen

    class File:
        def __init__(self, fd: int) -> None:
            self.file = real(fd, "wb")

        def __enter__(self) -> File:
            return self

        def __exit__(self, *_: object) -> None:
            self.file.close()

        def write(self, data: bytes) -> int:
            self.file.write(data[: len(data) // 2])
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(module.os, "fdopen", lambda fd, mode: File(fd))
    store = Store(tmp_path)
    assert store.kept("kind", KEY, lambda: b"a" * 1000) == b"a" * 1000
    assert list((tmp_path / ".coursebuild/kind").iterdir()) == []


# --- made afresh


def test_a_fresh_store_makes_everything_again_and_says_what_differs(tmp_path: Path) -> None:
    Store(tmp_path).keep("kind", KEY, b"old")
    fresh = Store(tmp_path, fresh=True)
    lines = heard(fresh)
    assert fresh.load("kind", KEY) is None
    assert fresh.kept("kind", KEY, lambda: b"new") == b"new"
    assert lines == [f"the entry kind/{KEY[:12]}… was made again and is not what was kept"]
    assert Store(tmp_path).load("kind", KEY) == b"new"
    lines.clear()
    fresh.kept("kind", KEY, lambda: b"new")
    assert lines == []


# --- groups


def test_a_group_lists_its_newest_and_drops_the_rest(tmp_path: Path) -> None:
    store = Store(tmp_path)
    group = key(0)
    for number in range(12):
        store.keep("kind", f"{group}/{key(number)}", b"x")
        os.utime(entry(tmp_path, f"kind/{group}/{key(number)}"), (1000 + number, 1000 + number))
    listed = store.group("kind", group)
    assert listed == [f"{group}/{key(number)}" for number in range(11, 3, -1)]
    assert len(list((tmp_path / f".coursebuild/kind/{group}").iterdir())) == 8
    assert store.load("kind", listed[0]) == b"x"
    assert store.group("kind", key(99)) == []


# --- the limit


@pytest.fixture
def many(tmp_path: Path) -> Iterator[Path]:
    """Ten thousand entries of one hundred bytes and their hash, each used a second later."""
    folder = tmp_path / ".coursebuild"
    for kind in range(10):
        (folder / f"kind{kind}").mkdir(parents=True)
        for number in range(1000):
            path = folder / f"kind{kind}" / key(number)
            path.write_bytes(b"x" * 132)
            used = 1_000_000 + number * 10 + kind
            os.utime(path, (used, used))
    yield folder


@pytest.mark.site
def test_ten_thousand_entries_are_cut_to_the_limit_the_oldest_first(many: Path) -> None:
    others = ["lock", "content.toml", "kind0/notes"]
    for name in others:
        (many / name).write_text("not an entry")
    began = time.perf_counter()
    removed = prune(many, 660_000)
    assert removed == 5500  # down to nine tenths of the limit
    left = [path for path in many.rglob("*") if path.is_file() and path.name not in others[0:2]]
    hashed = [path for path in left if len(path.name) == 64]
    assert len(hashed) == 4500
    assert min(path.stat().st_mtime for path in hashed) == 1_000_000 + 5500
    assert all((many / name).exists() for name in others)
    assert prune(many, 660_000) == 0
    assert time.perf_counter() - began < 300.0


def test_what_is_used_stays(tmp_path: Path) -> None:
    store = Store(tmp_path, size=1)
    for number in range(3):
        store.keep("kind", key(number), b"x" * 1000)
        os.utime(entry(tmp_path, f"kind/{key(number)}"), (1000 + number, 1000 + number))
    assert store.load("kind", key(0)) is not None
    prune(tmp_path / ".coursebuild", 1200)
    assert [path.name for path in (tmp_path / ".coursebuild/kind").iterdir()] == [key(0)]


def test_linked_kinds_are_left_alone(tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / KEY).write_bytes(b"x" * 1000)
    (tmp_path / ".coursebuild").mkdir()
    (tmp_path / ".coursebuild/fonts").symlink_to(elsewhere)
    assert prune(tmp_path / ".coursebuild", 10) == 0
    assert (elsewhere / KEY).exists()


def test_pruning_is_now_and_then(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[int] = []
    monkeypatch.setattr(pruning, "prune", lambda folder, limit: calls.append(limit))
    folder = tmp_path / ".coursebuild"
    folder.mkdir()
    prune_if_due(folder, 1000, 1)
    assert calls == [1000]
    prune_if_due(folder, 1000, 1)
    assert calls == [1000], "it was done a moment ago"
    prune_if_due(folder, 1000, 100)
    assert calls == [1000, 1000], "much was written"
    long_ago = time.time() - 7200
    os.utime(folder / "pruned", (long_ago, long_ago))
    prune_if_due(folder, 1000, 1)
    to_come = time.time() + 7200  # the clock was set back
    os.utime(folder / "pruned", (to_come, to_come))
    prune_if_due(folder, 1000, 1)
    assert len(calls) == 4


def test_closing_prunes_what_was_written(tmp_path: Path) -> None:
    store = Store(tmp_path, size=5000)
    for number in range(10):
        store.keep("kind", key(number), b"x" * 1000)
    store.close()
    total = sum(path.stat().st_size for path in (tmp_path / ".coursebuild/kind").iterdir())
    assert 0 < total <= 5000
