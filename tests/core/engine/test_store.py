"""Kept results: flipped bytes, cut entries, killed writers, many processes, pruning."""

from __future__ import annotations

import errno
import hashlib
import multiprocessing
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from coursebuild.core.engine.store import Store, prune
from support.run_code import program

ROOT = Path(__file__).parents[3]
KEY = hashlib.sha256(b"a key").hexdigest()
NAME = f"kind/{KEY}"


def key(number: int) -> str:
    return hashlib.sha256(str(number).encode()).hexdigest()


def entry(root: Path, name: str = NAME) -> Path:
    return root / ".coursebuild" / name


def messages_of(store: Store) -> list[str]:
    lines: list[str] = []
    store.listen(lines.append)
    return lines


# --- damage


def test_every_position_of_an_entry_on_the_disk(tmp_path: Path) -> None:
    """Nothing is found, nothing is said, and the next result takes its place."""
    store = Store(tmp_path)
    store.put("kind", KEY, b"the result")
    whole = entry(tmp_path).read_bytes()
    for position in range(len(whole)):
        entry(tmp_path).write_bytes(
            whole[:position] + bytes([whole[position] ^ 0x10]) + whole[position + 1 :]
        )
        fresh = Store(tmp_path)
        assert fresh.get("kind", KEY, bytes) is None
        assert messages_of(fresh) == []
        assert fresh.get_or_make("kind", KEY, lambda: b"made again") == b"made again"
        assert Store(tmp_path).get("kind", KEY, bytes) == b"made again"


# --- several processes


def write_many(root: str, seed: int) -> None:
    store = Store(Path(root))
    for number in range(40):
        data = f"{number % 5}".encode() * 20_000
        store.put("kind", key(number % 5), data)
        result = store.get("kind", key((number + seed) % 5), bytes)
        if result is not None:
            assert result == result[:1] * 20_000


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


def test_a_writer_that_was_killed_leaves_nothing_that_is_served_or_stays(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", program("write_half"), str(tmp_path), KEY],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert process.stdout is not None and process.stdin is not None
    with process.stdout, process.stdin:
        assert process.stdout.readline() == b"writing\n"
        folder = tmp_path / ".coursebuild/kind"
        assert [path.name[:5] for path in folder.iterdir()] == [".new-"]
        process.kill()
        process.wait()
    assert Store(tmp_path).get("kind", KEY, bytes) is None
    [left] = folder.iterdir()
    prune(tmp_path / ".coursebuild", 1 << 30)
    assert left.exists(), "its writer may live"
    os.utime(left, (1000, 1000))
    prune(tmp_path / ".coursebuild", 1 << 30)
    assert list(folder.iterdir()) == []


# --- places that take nothing


@pytest.mark.parametrize("call", ["makedirs", "replace"])
def test_a_disk_that_takes_nothing_costs_time_and_is_reported_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    store = Store(tmp_path)
    monkeypatch.setattr(os, call, refuse)
    lines = messages_of(store)
    assert store.get_or_make("kind", KEY, lambda: b"a") == b"a"
    assert store.get_or_make("kind", key(2), lambda: b"b") == b"b"
    assert lines == ["results cannot be kept in .coursebuild: no space left on device"]
    assert [path for path in tmp_path.rglob("*") if path.name.startswith(".new-")] == []


def test_a_place_that_cannot_be_written(held_back: Path) -> None:
    in_the_way = held_back / "course"
    in_the_way.mkdir()
    (in_the_way / ".coursebuild").write_text("in the way")
    held_back.chmod(0o500)
    for root in (in_the_way, held_back):
        for text in (b"made", b"made again"):
            assert Store(root).get_or_make("kind", KEY, lambda text=text: text) == text
    assert list(held_back.iterdir()) == [in_the_way]
    held_back.chmod(0o700)


def test_what_fails_is_not_kept_and_nothing_is_a_result(tmp_path: Path) -> None:
    def fail() -> bytes:
        raise RuntimeError("no")

    store = Store(tmp_path)
    with pytest.raises(RuntimeError):
        store.get_or_make("kind", KEY, fail)
    assert store.get_or_make("kind", KEY, lambda: b"") == b""
    assert store.get_or_make("kind", KEY, fail) == b""
    assert (tmp_path / ".coursebuild/.gitignore").read_text() == "*\n"


# --- made afresh


def test_a_fresh_store_makes_everything_again_and_says_what_differs(tmp_path: Path) -> None:
    Store(tmp_path).put("kind", KEY, b"old")
    fresh = Store(tmp_path, fresh=True)
    lines = messages_of(fresh)
    assert fresh.get("kind", KEY, bytes) is None
    assert fresh.get_or_make("kind", KEY, lambda: b"new") == b"new"
    assert lines == [f"the entry kind/{KEY[:12]}… was made again and is not what was kept"]
    assert Store(tmp_path).get("kind", KEY, bytes) == b"new"
    lines.clear()
    fresh.get_or_make("kind", KEY, lambda: b"new")
    assert lines == []


# --- groups


def test_a_group_lists_its_newest_and_drops_the_rest(tmp_path: Path) -> None:
    store = Store(tmp_path)
    group = key(0)
    for number in range(12):
        store.put("kind", f"{group}/{key(number)}", b"x")
        os.utime(entry(tmp_path, f"kind/{group}/{key(number)}"), (1000 + number, 1000 + number))
    keys = store.group("kind", group)
    assert keys == [f"{group}/{key(number)}" for number in range(11, 3, -1)]
    assert len(list((tmp_path / f".coursebuild/kind/{group}").iterdir())) == 8
    assert store.get("kind", keys[0], bytes) == b"x"
    assert store.group("kind", key(99)) == []


# --- the limit


def test_entries_are_cut_to_the_limit_the_oldest_first(tmp_path: Path) -> None:
    folder = tmp_path / ".coursebuild"
    for number in range(1000):
        path = folder / f"kind{number % 10}" / key(number)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x" * 132)
        os.utime(path, (1000 + number, 1000 + number))
    foreign = [folder / name for name in ("lock", "content.toml", "kind0/notes")]
    for path in foreign:
        path.write_text("not an entry")
    for _ in range(2):
        prune(folder, 66_000)
        left = [path for path in folder.rglob("*") if path.is_file() and path not in foreign]
        assert len(left) == 450, "down to nine tenths of the limit, and then no further"
        assert min(path.stat().st_mtime for path in left) == 1000 + 550
    assert all(path.exists() for path in foreign)


def test_what_is_used_stays(tmp_path: Path) -> None:
    store = Store(tmp_path, size=1)
    for number in range(3):
        store.put("kind", key(number), b"x" * 1000)
        os.utime(entry(tmp_path, f"kind/{key(number)}"), (1000 + number, 1000 + number))
    assert store.get("kind", key(0), bytes) is not None
    prune(tmp_path / ".coursebuild", 1200)
    assert [path.name for path in (tmp_path / ".coursebuild/kind").iterdir()] == [key(0)]


def test_pruning_is_now_and_then(tmp_path: Path) -> None:
    folder = tmp_path / ".coursebuild"

    def prunes(size: int) -> bool:
        """Whether a command that wrote so many bytes prunes as it ends."""
        store = Store(tmp_path, size=100_000)
        store.put("kind", key(size), b"x" * size)
        (folder / "kind" / key(0)).write_bytes(b"x" * 200_000)
        store.close()
        return not (folder / "kind" / key(0)).exists()

    assert prunes(1)
    assert not prunes(2), "it was done a moment ago"
    assert prunes(10_000), "much was written"
    for hours in (-2, 2):  # long ago; to come, since the clock was set back
        moment = time.time() + hours * 3600
        os.utime(folder / "pruned", (moment, moment))
        assert prunes(3)
