"""Results shared between machines: folders, fsspec's places, and places that fail."""

from __future__ import annotations

import hashlib
import sys
import threading
import uuid
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core.engine.shared_place import FolderFiles, SharedPlace, shared_place
from coursebuild.core.engine.store import Store
from coursebuild.core.files.errors import EffectError
from support.waiting import wait_until

KEY = hashlib.sha256(b"a key").hexdigest()
GROUP = hashlib.sha256(b"a group").hexdigest()
UPPER = "coursebuild-1"


def machine(
    tmp_path: Path, name: str, shared: SharedPlace, timeout: float = 15.0
) -> tuple[Store, list[str]]:
    (tmp_path / name).mkdir(exist_ok=True)
    store = Store(tmp_path / name, shared=shared, timeout=timeout)
    lines: list[str] = []
    store.listen(lines.append)
    return store, lines


def get_or_make(store: Store, key: str, make: Callable[[], bytes]) -> bytes:
    """A result of a kind that is shared."""
    data = store.get("labs", key, bytes, shared=True)
    if data is None:
        data = make()
        store.put("labs", key, data, shared=True)
    return data


def never() -> bytes:
    raise AssertionError("it is in the shared cache")


@pytest.fixture(params=["folder", "file", "memory"])
def address(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    folder = tmp_path / "sha red"
    return {
        "folder": str(folder),
        "file": f"file://{str(folder).replace(' ', '%20')}",
        "memory": f"memory://{uuid.uuid4()}/cache",
    }[request.param]


def test_what_one_machine_makes_another_has(tmp_path: Path, address: str) -> None:
    first, first_messages = machine(tmp_path, "one", shared_place(address))
    assert get_or_make(first, KEY, lambda: b"\0made\xff") == b"\0made\xff"
    first.put("scripts", f"{GROUP}/{KEY}", b"a result", shared=True)
    first.put("digests", KEY, b"of this machine")
    first.close()
    second, second_messages = machine(tmp_path, "two", shared_place(address))
    assert second.get("labs", KEY, bytes) is None  # of others is only what is asked for so
    assert get_or_make(second, KEY, never) == b"\0made\xff"
    assert second.shared_group("scripts", GROUP) == [f"{GROUP}/{KEY}"]
    assert second.get("scripts", f"{GROUP}/{KEY}", bytes, shared=True) == b"a result"
    assert second.get("digests", KEY, bytes, shared=True) is None
    assert second.shared_group("scripts", KEY) == []
    alone = Store(tmp_path / "two")  # what was fetched is kept here too
    assert alone.get("labs", KEY, bytes, shared=True) == b"\0made\xff"
    assert alone.group("scripts", GROUP) == [f"{GROUP}/{KEY}"]
    assert first_messages == second_messages == []


def test_a_damaged_shared_entry_is_not_served_and_made_good(tmp_path: Path) -> None:
    place = tmp_path / "shared"
    first, _ = machine(tmp_path, "one", shared_place(str(place)))
    first.put("labs", KEY, b"made", shared=True)
    first.close()
    path = place / UPPER / "labs" / KEY
    whole = path.read_bytes()
    for position in range(len(whole)):
        path.write_bytes(whole[:position] + bytes([whole[position] ^ 1]) + whole[position + 1 :])
        second, messages = machine(tmp_path, f"two{position}", shared_place(str(place)))
        assert get_or_make(second, KEY, lambda: b"made") == b"made"
        second.close()
        message = f"the entry labs/{KEY[:12]}… in the shared cache is damaged: it is made again"
        assert messages == [message]
        assert path.read_bytes() == whole


class Broken(FolderFiles):
    """A place where every call runs into trouble."""

    def __init__(self, trouble: Callable[[], object]) -> None:
        self.trouble, self.calls = trouble, 0

    def read(self, path: str) -> bytes | None:
        self.calls += 1
        self.trouble()
        return None

    def write(self, path: str, data: bytes) -> None:
        self.calls += 1
        self.trouble()

    def names(self, folder: str) -> list[str]:
        self.calls += 1
        self.trouble()
        return []


class CloudError(Exception):
    """An exception that the library of a cloud raises."""


def failing(error: Exception) -> Callable[[], object]:
    def fail() -> object:
        raise error

    return fail


def test_signed_entries_are_believed_by_those_who_have_the_key(tmp_path: Path) -> None:
    place = tmp_path / "shared"
    for name, key, result in (("one", b"secret", b"ours"), ("other", b"", b"theirs")):
        store, _ = machine(tmp_path, name, shared_place(str(place), key))
        store.put("labs", KEY, result, shared=True)
        store.close()
    signed, plain = (place / f"{UPPER}{end}/labs" / KEY for end in ("-signed", ""))
    damage = [f"the entry labs/{KEY[:12]}… in the shared cache is damaged: it is made again"]
    readers = {b"secret": (b"ours", []), b"": (b"theirs", []), b"guess": (None, damage)}
    for key, (expected, messages) in readers.items():
        store, lines = machine(tmp_path, f"reader {key!r}", shared_place(str(place), key))
        assert (store.get("labs", KEY, bytes, shared=True), lines) == (expected, messages)
    signed.write_bytes(plain.read_bytes())
    store, lines = machine(tmp_path, "victim", shared_place(str(place), b"secret"))
    assert (store.get("labs", KEY, bytes, shared=True), lines) == (None, damage)
    assert Store(tmp_path / "victim").get("labs", KEY, bytes) is None


def test_a_place_that_fails_or_hangs_is_reported_once_and_left_alone(tmp_path: Path) -> None:
    stop = threading.Event()
    troubles: dict[str, Callable[[], object]] = {
        "network is unreachable": failing(OSError(101, "Network is unreachable")),
        "an error occurred (403)": failing(CloudError("An error\noccurred (403).")),
        "CloudError": failing(CloudError()),
        "TimeoutError": failing(TimeoutError()),
        "no answer within 0.2 s": lambda: stop.wait(600),
    }
    for words, trouble in troubles.items():
        place = Broken(trouble)
        store, messages = machine(tmp_path, words, SharedPlace("s3://there", place), 0.2)
        for number in range(20):
            assert get_or_make(store, f"{number:064x}", lambda: b"made") == b"made"
        assert store.shared_group("scripts", GROUP) == []
        store.close()
        assert messages == [f"the shared cache s3://there cannot be used: {words}"]
        assert place.calls == 1
    stop.set()


def test_sending_ends_when_it_takes_too_long(tmp_path: Path) -> None:
    stop = threading.Event()
    shared = SharedPlace("s3://there", Broken(lambda: stop.wait(600)))
    store, messages = machine(tmp_path, "one", shared)
    store.put("labs", KEY, b"made", shared=True)
    store.flush(0.2)
    stop.set()
    trouble = "results could not be sent in 0.2 s"
    assert messages == [f"the shared cache s3://there cannot be used: {trouble}"]


def test_all_that_is_written_arrives_and_no_thread_stays(tmp_path: Path) -> None:
    before = threading.active_count()
    place = tmp_path / "shared"
    store, messages = machine(tmp_path, "one", shared_place(str(place)))
    for number in range(300):
        store.put("labs", f"{number:064x}", b"x", shared=True)
    store.close()
    assert len(list((place / UPPER / "labs").iterdir())) == 300
    wait_until(lambda: threading.active_count() <= before, "the end of the threads")
    assert messages == []


def test_a_folder_whose_parent_is_not_there_is_not_made(tmp_path: Path) -> None:
    """If a network folder is not mounted, nothing is written to its mount point."""
    place = tmp_path / "not mounted" / "cache"
    store, messages = machine(tmp_path, "one", shared_place(str(place)))
    assert get_or_make(store, KEY, lambda: b"made") == b"made"
    store.close()
    assert messages == [f"the shared cache {place} cannot be used: no such file or directory"]
    assert not place.parent.exists()


def test_other_users_can_read_what_is_shared(tmp_path: Path) -> None:
    FolderFiles(tmp_path / "shared").write("kind/key", b"x")
    assert (tmp_path / "shared/kind/key").stat().st_mode & 0o044 == 0o044


def test_no_such_kind_of_place_and_no_fsspec(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with pytest.raises(EffectError) as caught:
        shared_place("nowhere://there")
    assert caught.value.message.startswith(
        "there is no such place as nowhere://there: protocol not"
    )
    monkeypatch.setitem(sys.modules, "fsspec", None)
    with pytest.raises(EffectError) as caught:
        shared_place("s3://bucket/cache")
    assert caught.value.message == "the cache s3://bucket/cache needs the package fsspec"
    assert caught.value.help == "run `pip install 'coursebuild[cache]'`"
    shared_place(str(tmp_path))
