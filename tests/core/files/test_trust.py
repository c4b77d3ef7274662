"""Which stores are believed: the key, the mark of the owner, what came with a course."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from coursebuild.core.engine.store import Store
from coursebuild.core.files import trust
from coursebuild.pipeline.options import open_store

KEY = "a" * 64


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The state folder of a user who has none yet."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state/coursebuild"


@pytest.fixture
def root(tmp_path: Path, state: Path) -> Path:
    (tmp_path / "course").mkdir()
    return tmp_path / "course"


def fill(root: Path) -> Path:
    """Keep a result; returns the file in which it lies."""
    Store(root).put("kind", KEY, b"kept")
    return Path(trust.find_store(str(root))[0], "kind", KEY)


def look_up(root: Path) -> tuple[bytes | None, list[str]]:
    """What is found under the key, and what is said."""
    output = io.StringIO()
    with contextlib.redirect_stderr(output):
        store = open_store(root, None, None)
    return store.get("kind", KEY, bytes), output.getvalue().splitlines()


def become_another_user(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "another state"))


# --- the key


def test_key_is_made_once_and_for_its_user_alone(root: Path, state: Path) -> None:
    key = trust.store_key(str(root))
    assert len(key) == 32 and trust.store_key(str(root)) == key
    assert (state / "key").stat().st_mode & 0o777 == 0o600
    assert state.stat().st_mode & 0o777 == 0o700
    assert [path.name for path in state.iterdir()] == ["key"]


def test_key_in_a_course_or_of_another_user_is_none(
    root: Path, state: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert len(trust.store_key(str(root))) == 32
    for course in (state, state.parent, state.parent.parent):
        assert trust.store_key(str(course)) == b"", course
    assert len(trust.store_key(f"{state}2")) == 32
    another_user = os.geteuid() + 1
    monkeypatch.setattr(os, "geteuid", lambda: another_user)
    assert trust.store_key(str(root)) == b""


def test_seal_is_of_a_name_and_of_a_key() -> None:
    sealed = trust.seal("labs/a", b"data", b"key")
    assert trust.unseal("labs/a", sealed, b"key") == b"data"
    for name, data, key in (
        ("labs/b", sealed, b"key"),
        ("labs/a", sealed + b"x", b"key"),
        ("labs/a", sealed, b"another"),
        ("labs/a", trust.seal("labs/a", b"data", b""), b""),
    ):
        assert trust.unseal(name, data, key) is None


@pytest.mark.parametrize("damage", ["empty", "cut", "link", "folder"])
def test_damaged_key_is_replaced_or_done_without(root: Path, state: Path, damage: str) -> None:
    fill(root)
    (state / "key").unlink()
    match damage:
        case "empty":
            (state / "key").write_bytes(b"")
        case "cut":
            (state / "key").write_bytes(b"x" * 31)
        case "link":
            (root / "key").write_bytes(b"x" * 32)
            (state / "key").symlink_to(root / "key")
        case _:
            (state / "key").mkdir()
    assert look_up(root)[0] is None
    assert Store(root).get_or_make("kind", KEY, lambda: b"made") == b"made"
    assert trust.store_key(str(root)) != b"x" * 32


def test_processes_that_begin_at_once_have_one_key(root: Path, state: Path) -> None:
    code = "import sys; from coursebuild.core.files.trust import store_key\n"
    code += "sys.stdin.read(); print(store_key(sys.argv[1]).hex())"
    command = [sys.executable, "-c", code, str(root)]
    pipe = subprocess.PIPE
    processes = [subprocess.Popen(command, stdin=pipe, stdout=pipe) for _ in range(6)]
    for process in processes:
        assert process.stdin is not None
        process.stdin.close()
    keys = set()
    for process in processes:
        assert process.stdout is not None
        with process.stdout:
            keys.add(process.stdout.read())
        assert process.wait() == 0
    assert len(keys) == 1


@pytest.mark.parametrize("place", ["course", "course/deep", "/dev/null", "public", "of another"])
def test_without_a_place_of_ones_own_outside_of_the_course_nothing_is_kept(
    root: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    for name, mode in (("public", 0o777), ("of another", 0o700)):
        folder = root.parent / name / "coursebuild"
        folder.mkdir(parents=True)
        folder.chmod(mode)
    if place == "of another":
        user = os.geteuid() + 1
        monkeypatch.setattr(os, "geteuid", lambda: user)
    monkeypatch.setenv("XDG_STATE_HOME", str(root.parent / place))
    Store(root).put("kind", KEY, b"kept")
    warning = "warning: .coursebuild needs a key of its user's own, and there is nowhere to keep it"
    advice = "set HOME, XDG_STATE_HOME or COURSEBUILD_STORE_KEY; it is set aside"
    assert look_up(root) == (None, [f"{warning}: {advice}"])
    assert list(root.iterdir()) == []


def test_store_travels_with_a_secret_and_is_nothing_without(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setenv("COURSEBUILD_STORE_KEY", "secret")
        fill(root)
    shutil.move(root, tmp_path / "there")
    become_another_user(monkeypatch, tmp_path)
    assert look_up(tmp_path / "there") == (None, [])
    monkeypatch.setenv("COURSEBUILD_STORE_KEY", "another secret")
    assert look_up(tmp_path / "there") == (None, [])
    monkeypatch.setenv("COURSEBUILD_STORE_KEY", "secret")
    assert look_up(tmp_path / "there") == (b"kept", [])


def test_store_moves_and_is_copied_with_its_course(root: Path, tmp_path: Path) -> None:
    fill(root)
    shutil.copytree(root, tmp_path / "copy")
    root.rename(tmp_path / "moved")
    assert look_up(tmp_path / "copy") == look_up(tmp_path / "moved") == (b"kept", [])


# --- stores of others


def times(*folders: Path) -> dict[str, int]:
    """When each file in the folders was changed last."""
    paths = (path for folder in folders for path in folder.rglob("*"))
    return {str(path): os.lstat(path).st_mtime_ns for path in paths}


def test_store_of_another_machine_is_a_miss_without_a_word(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entry = fill(root)
    foreign = entry.read_bytes()
    become_another_user(monkeypatch, tmp_path)
    assert look_up(root) == (None, [])
    assert fill(root) != entry
    assert look_up(root) == (b"kept", []), "it has a place of its own"
    assert entry.read_bytes() == foreign


def test_true_entry_of_another_user_in_ones_own_store_is_a_miss(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    foreign = fill(root).read_bytes()
    become_another_user(monkeypatch, tmp_path)
    shutil.rmtree(root / ".coursebuild")
    fill(root).write_bytes(foreign)
    assert look_up(root) == (None, [])


@pytest.mark.parametrize("kind", ["file", "link", "link to a store", "pipe", "folder", "mark"])
def test_nothing_in_a_strange_store_is_read_or_written(
    root: Path, tmp_path: Path, kind: str
) -> None:
    """Not through its links either, which lead anywhere."""
    store, victim = root / ".coursebuild", tmp_path / "victim"
    victim.mkdir()
    (victim / "lock").write_text("dear")
    match kind:
        case "file":
            store.write_text("dear")
        case "link":
            store.symlink_to(victim)
        case "link to a store":
            (tmp_path / "other").mkdir()
            fill(tmp_path / "other")
            store.symlink_to(tmp_path / "other/.coursebuild")
        case "pipe":
            os.mkfifo(store)
        case _:
            store.mkdir()
            for name in ("kind", "published", "unchanged"):
                (store / name).symlink_to(victim)
            for name in ("lock", "clock", "pruned"):
                (store / name).symlink_to(victim / "lock")
            if kind == "mark":
                (store / "owner").write_bytes(b"x" * 32)
    before = times(root, victim)
    fill(root)
    assert look_up(root) == (b"kept", [])
    assert times(root, victim) == before
    assert (victim / "lock").read_text() == "dear"


def test_store_of_another_user_is_set_aside_with_a_warning(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COURSEBUILD_STORE_KEY", "of both")
    fill(root)
    user = os.geteuid() + 1
    monkeypatch.setattr(os, "geteuid", lambda: user)
    warning = "warning: .coursebuild belongs to another user; it is set aside"
    assert look_up(root) == (None, [warning])
