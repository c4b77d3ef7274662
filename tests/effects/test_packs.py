"""Packs: cut, flipped, left by killed writers, written by several processes, put together."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.effects import pack_files, packs
from coursebuild.effects.packs import Packs
from coursebuild.effects.store import Store
from support.store_packs import KEY, ROOT, files, heard, key

pytestmark = pytest.mark.site

ACTS = st.lists(
    st.one_of(
        st.tuples(st.sampled_from("abcdefgh"), st.binary(max_size=50)),
        st.sampled_from(["close", "leave", "another"]),
    ),
    max_size=60,
)


@given(ACTS)
@settings(deadline=None)
def test_what_was_put_last_is_there(acts: list[tuple[str, bytes] | str]) -> None:
    """Whether packs are closed, left as by a killed process, read by others, or put together."""
    with tempfile.TemporaryDirectory() as scratch, pytest.MonkeyPatch.context() as patch:
        patch.setattr(packs, "_MANY", 3)
        patch.setattr(packs, "LONG", 7)
        patch.setattr(pack_files, "_FEW", 2)
        folder = Path(scratch)
        mine, reader = Packs(folder), Packs(folder)
        expected: dict[str, bytes] = {}
        for act in acts:
            if isinstance(act, tuple):
                mine.put(*act)
                expected[act[0]] = act[1]
            elif act == "close":
                mine.close()
            elif act == "leave":
                mine = Packs(folder)
            else:
                reader = Packs(folder)
            for name in "abcdefgh":
                assert mine.get(name) == expected.get(name)
                if act == "another":
                    assert reader.get(name) == expected.get(name)


@given(st.data(), st.booleans())
@settings(deadline=None)
def test_no_damaged_byte_is_ever_served(draw: st.DataObject, closed: bool) -> None:
    """Whatever is flipped or cut off: an entry is whole, or not there."""
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch)
        store = Store(root)
        for number in range(6):
            store.keep("kind", key(number), str(number).encode() * 20, packed=True)
        if closed:
            store._packs.close()
        (path,) = files(root / ".coursebuild")
        data = bytearray(path.read_bytes())
        at = draw.draw(st.integers(0, len(data) - 1))
        if draw.draw(st.booleans()):
            data[at] ^= draw.draw(st.integers(1, 255))
        else:
            del data[at:]
        path.write_bytes(data)
        fresh = Store(root)
        told = heard(fresh)
        found = [fresh.load("kind", key(number)) for number in range(6)]
        assert all(f in (None, str(n).encode() * 20) for n, f in enumerate(found))
        assert len(told) <= found.count(None)
        for number in range(6):
            fresh.keep("kind", key(number), b"again", packed=True)
        assert {Store(root).load("kind", key(n)) for n in range(6)} == {b"again"}


def test_damage_is_told_and_mended(tmp_path: Path) -> None:
    Store(tmp_path).keep("kind", KEY, b"the result", packed=True)
    (path,) = files(tmp_path / ".coursebuild")
    path.write_bytes(path.read_bytes()[:-1] + b"!")
    store = Store(tmp_path)
    told = heard(store)
    assert store.load("kind", KEY) is None
    assert told == [f"the entry kind/{KEY[:12]}… in .coursebuild is damaged: it is made again"]
    assert store.kept("kind", KEY, lambda: b"made again", packed=True) == b"made again"
    assert store.load("kind", KEY) == Store(tmp_path).load("kind", KEY) == b"made again"


def test_an_entry_is_cut_only_where_it_is_cut(tmp_path: Path) -> None:
    """Of a pack that lost its end, what lies before is there."""
    store = Store(tmp_path)
    for number in range(5):
        store.keep("kind", key(number), b"x" * 100, packed=True)
    store.close()
    (path,) = files(tmp_path / ".coursebuild")
    each = pack_files._HEAD.size + 32 + 100
    path.write_bytes(path.read_bytes()[: 3 * each + 50])
    found = [Store(tmp_path).load("kind", key(number)) for number in range(5)]
    assert found == [b"x" * 100] * 3 + [None] * 2


def test_packed_entries_are_not_shared(tmp_path: Path) -> None:
    from coursebuild.effects.shared import shared_cache

    place = tmp_path / "shared"
    store = Store(tmp_path / "here", shared=shared_cache(str(place)))
    (tmp_path / "here").mkdir()
    store.keep("kind", KEY, b"x", packed=True)
    store.close()
    assert not place.exists()
    assert store.load("kind", KEY) == b"x"


def test_a_fresh_store_makes_again_and_says_what_differs(tmp_path: Path) -> None:
    Store(tmp_path).keep("kind", KEY, b"old", packed=True)
    fresh = Store(tmp_path, fresh=True)
    told = heard(fresh)
    assert fresh.load("kind", KEY) is None
    assert fresh.kept("kind", KEY, lambda: b"new", packed=True) == b"new"
    assert told == [f"the entry kind/{KEY[:12]}… was made again and is not what was kept"]
    assert Store(tmp_path).load("kind", KEY) == b"new"


# --- several processes


def test_copies_of_the_process_write_and_this_one_reads(tmp_path: Path) -> None:
    mine = Packs(tmp_path)
    mine.put("before", b"b")
    children = []
    for number in range(3):
        child = os.fork()
        if child == 0:
            assert mine.get("before") == b"b"
            for n in range(50):
                mine.put(f"{number}/{n}", b"%d" % n * 100)
                assert mine.get(f"{number}/{n}") == b"%d" % n * 100
            os._exit(0)
        children.append(child)
    mine.put("meanwhile", b"m")
    for child in children:
        assert os.waitpid(child, 0)[1] == 0
    for number in range(3):
        for n in range(50):
            assert mine.get(f"{number}/{n}") == b"%d" % n * 100
    assert mine.get("meanwhile") == b"m"
    assert len(files(tmp_path)) == 4
    mine.close()
    assert Packs(tmp_path).get("2/49") == b"49" * 100


KILLED = """
import os, signal, sys
from pathlib import Path
from coursebuild.effects.store import Store
store = Store(Path(sys.argv[1]))
real = os.pwritev
for n in range(20):
    store.keep("kind", f"{n:064x}", bytes([n]) * 1000, packed=True)
def half(fd, parts, at):
    real(fd, [b"".join(parts)[:500]], at)
    os.kill(os.getpid(), signal.SIGKILL)
os.pwritev = half
store.keep("kind", f"{20:064x}", bytes(1000), packed=True)
"""


def test_of_a_killed_writer_what_is_whole_stays(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], env=environment)
    assert done.returncode == -9
    store = Store(tmp_path)
    told = heard(store)
    found = [store.load("kind", f"{n:064x}") for n in range(21)]
    assert found == [bytes([n]) * 1000 for n in range(20)] + [None]
    assert told == []


def test_a_living_writers_pack_stays_and_a_left_one_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(packs, "_MANY", 2)
    living = Packs(tmp_path)
    living.put("living", b"1")
    child = os.fork()
    if child == 0:
        left = Packs(tmp_path)
        left.put("left", b"2")
        os._exit(0)
    os.waitpid(child, 0)
    mine = Packs(tmp_path)
    mine.put("mine", b"3")
    mine.close()
    assert len(files(tmp_path)) == 2
    living.put("more", b"4")
    for reader in (living, mine, Packs(tmp_path)):
        found = [reader.get(name) for name in ("living", "left", "mine", "more")]
        assert found == [b"1", b"2", b"3", b"4"]


# --- put together


def test_many_small_packs_become_one(tmp_path: Path) -> None:
    old = Packs(tmp_path)
    old.put("0", b"first")
    old.close()
    for number in range(40):
        one = Packs(tmp_path)
        one.put(str(number % 7), b"%d" % number)
        one.put(f"of {number}", b"own")
        one.close()
    assert len(files(tmp_path)) < packs._MANY + 2
    fresh = Packs(tmp_path)
    for number in range(33, 40):
        assert fresh.get(str(number % 7)) == b"%d" % number
    assert all(fresh.get(f"of {number}") == b"own" for number in range(40))
    # Who has listed them before finds them where they are now.
    assert old.get("of 3") == b"own"


def test_what_a_copy_or_a_killed_process_left_is_closed(tmp_path: Path) -> None:
    """So that it need not be walked through each time."""
    child = os.fork()
    if child == 0:
        left = Packs(tmp_path)
        for number in range(100):
            left.put(str(number), b"%d" % number)
        assert left._mine is not None
        os.pwrite(left._fd, b"half an entry" * 100, left._mine.end)
        os._exit(0)
    os.waitpid(child, 0)
    mine, living = Packs(tmp_path), Packs(tmp_path)
    living.put("living", b"is written")
    mine.put("7", b"seven")
    mine.close()
    states = [pack_files.Pack(str(path), 0.0) for path in files(tmp_path)]
    for state in states:
        pack_files.open_pack(state)
    assert [state.is_closed for state in states] == [True, False, True]
    living.put("living", b"again")
    for reader in (mine, Packs(tmp_path)):
        assert all(reader.get(str(n)) == b"%d" % n for n in range(100) if n != 7)
        assert reader.get("7") == b"seven"
    assert reader.get("living") == b"again"


def test_one_that_may_not_be_closed_keeps_no_others_apart(held_back: Path) -> None:
    """A pack that another user left, such as root in a container."""
    child = os.fork()
    if child == 0:
        Packs(held_back).put("left", b"1")
        os._exit(0)
    os.waitpid(child, 0)
    (left,) = files(held_back)
    left.chmod(0o444)
    for number in range(3 * packs._MANY):
        one = Packs(held_back)
        one.put(str(number), b"%d" % number)
        one.close()
    assert len(files(held_back)) <= packs._MANY + 2
    reader = Packs(held_back)
    assert reader.get("left") == b"1"
    assert all(reader.get(str(n)) == b"%d" % n for n in range(3 * packs._MANY))


def test_a_pack_that_was_taken_for_left_before_it_was_locked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, names = packs.try_lock, list[str]()

    def lock(fd: int) -> bool | None:
        names.append(str(Path(f"/proc/self/fd/{fd}").readlink()))
        return False if len(names) == 1 else real(fd)

    monkeypatch.setattr(packs, "try_lock", lock)
    mine = Packs(tmp_path)
    mine.put("mine", b"1")
    assert mine._mine is not None
    assert (len(names), mine._mine.path) == (2, names[1])
    other = Packs(tmp_path)
    other.put("other", b"2")
    other.close()
    mine.put("more", b"3")
    mine.close()
    reader = Packs(tmp_path)
    assert [reader.get(name) for name in ("mine", "other", "more")] == [b"1", b"2", b"3"]


@given(
    st.lists(st.tuples(st.integers(0, 300), st.integers(0, 1 << 40)), max_size=200),
    st.lists(st.tuples(st.integers(0, 300), st.integers(0, 1 << 40)), max_size=200),
)
def test_entries_that_are_noted_at_once(
    first: list[tuple[int, int]], more: list[tuple[int, int]]
) -> None:
    one, all = pack_files.Pack("p", 0.0), pack_files.Pack("p", 0.0)
    keyed = [
        [(hashlib.sha256(b"%d" % n).digest()[:16], (start, n)) for n, start in part]
        for part in (first, more)
    ]
    for part in keyed:
        for name, place in part:
            one.add(name, *place)
        all.add_all(dict(part))
    assert list(all) == list(one)
    assert [all.find(name) for part in keyed for name, _ in part] == [
        one.find(name) for part in keyed for name, _ in part
    ]


def test_a_pack_is_closed_where_it_is_large(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(packs, "_SMALL", 1000)
    mine = Packs(tmp_path, 320_000)
    for number in range(100):
        mine.put(str(number), bytes(1000))
    assert len(files(tmp_path)) == 10
    assert all(mine.get(str(number)) == bytes(1000) for number in range(100))


def test_many_entries_are_found_in_rows(tmp_path: Path) -> None:
    mine = Packs(tmp_path)
    for number in range(3000):
        mine.put(str(number), b"%d" % number)
    mine.close()
    for reader in (mine, Packs(tmp_path)):
        assert all(reader.get(str(number)) == b"%d" % number for number in range(3000))
        assert reader.get("3000") is None


@given(st.lists(st.tuples(st.integers(0, 300), st.integers(0, 1 << 40)), max_size=400))
def test_a_pack_knows_the_latest_place_of_each_entry(added: list[tuple[int, int]]) -> None:
    pack = pack_files.Pack("p", 0.0)
    places: dict[bytes, tuple[int, int]] = {}
    for number, start in added:
        name = hashlib.sha256(b"%d" % number).digest()[:16]
        pack.add(name, start, number)
        places[name] = start, number
    assert list(pack) == [(name, *place) for name, place in sorted(places.items())]
    assert all(pack.find(name) == place for name, place in places.items())
    assert pack.find(b"\xff" * 16) is pack.find(b"\0" * 16) is None
