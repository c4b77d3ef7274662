"""Replacing an author's files, one or several: whole, with permissions, and only if untouched.

Killed meanwhile: `pipeline/test_killing.py`.
"""

from __future__ import annotations

import errno
import os
import stat
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
import pytest

from coursebuild.core.files import write
from coursebuild.core.files.errors import EffectError, FileChangedError, OutsideProjectError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.trust import seal, store_key
from coursebuild.core.files.write import (
    PREFIX,
    FileChange,
    change_files,
    check_writable,
    journal_path,
    remove_leftovers,
    undo_changes,
    write_atomic,
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "a.md"
    path.write_bytes(b"old")
    return path


def names(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir())


def test_makes_and_replaces_a_file_and_leaves_nothing_else(tmp_path: Path) -> None:
    for durable in (True, False):
        write_atomic(tmp_path, "a.md", b"", expected=None, durable=durable)
        write_atomic(tmp_path, "a.md", b"new\r\n\xff", expected=b"", durable=durable)
        assert (tmp_path / "a.md").read_bytes() == b"new\r\n\xff"
        write_atomic(tmp_path, "b.md", b"x" * 3_000_000, expected=None, durable=durable)
        assert (tmp_path / "b.md").stat().st_size == 3_000_000
        assert names(tmp_path) == ["a.md", "b.md"]
        for path in tmp_path.iterdir():
            path.unlink()


def test_permissions_and_owner_stay(tmp_path: Path, path: Path) -> None:
    if os.geteuid() == 0:  # who else cannot give files away, and cannot be asked to keep another's
        os.chown(path, 12345, 23456)
    for mode in (0o600, 0o644, 0o755, 0o640, 0o664):
        path.chmod(mode)
        before = path.stat()
        write_atomic(tmp_path, "a.md", b"old", expected=b"old")
        after = path.stat()
        assert stat.S_IMODE(after.st_mode) == mode
        assert (after.st_uid, after.st_gid) == (before.st_uid, before.st_gid)


@pytest.mark.parametrize("mode", [0o444, 0o555, 0o464, 0])
def test_an_authors_read_only_file_is_left_alone(tmp_path: Path, path: Path, mode: int) -> None:
    """By root too, who may write it; a derived one can be made again."""
    (tmp_path / "link.md").symlink_to("a.md")
    path.chmod(mode)
    for name in ("a.md", "link.md"):
        with pytest.raises(EffectError, match=f"^{name} is read-only$") as caught:
            write_atomic(tmp_path, name, b"new", expected=b"old")
        assert caught.value.help == (
            "nothing was written to it; make it writable, and run the command again"
        )
        with pytest.raises(EffectError, match=f"^{name} is read-only$"):
            check_writable(tmp_path, name)
    assert names(tmp_path) == ["a.md", "link.md"]
    path.chmod(mode | 0o400)
    assert path.read_bytes() == b"old"
    write_atomic(tmp_path, "a.md", b"new", expected=b"old", durable=False)
    assert path.read_bytes() == b"new"


def test_a_link_stays_and_one_out_of_the_project_is_refused(tmp_path: Path) -> None:
    root = tmp_path / "course"
    (root / "real").mkdir(parents=True)
    for file in (root / "real/a.md", tmp_path / "other.md"):
        file.write_bytes(b"old")
    (root / "a.md").symlink_to("real/a.md")
    (root / "out.md").symlink_to("../other.md")
    write_atomic(root, "a.md", b"new", expected=b"old")
    assert (root / "a.md").is_symlink() and (root / "real/a.md").read_bytes() == b"new"
    with pytest.raises(OutsideProjectError):
        write_atomic(root, "out.md", b"new", expected=b"old")
    assert (tmp_path / "other.md").read_bytes() == b"old"
    assert [names(root / "real"), names(tmp_path)] == [["a.md"], ["course", "other.md"]]


@pytest.mark.parametrize(
    ("now", "expected", "message"),
    [
        (b"changed", b"old", "a.md was changed in the meantime"),
        (None, b"old", "a.md was removed in the meantime"),
        (b"changed", None, "a.md was created by another program in the meantime"),
    ],
)
def test_somebody_elses_work_is_not_lost(
    tmp_path: Path, now: bytes | None, expected: bytes | None, message: str
) -> None:
    if now is not None:
        (tmp_path / "a.md").write_bytes(now)
    with pytest.raises(FileChangedError) as caught:
        write_atomic(tmp_path, "a.md", b"new", expected=expected)
    assert caught.value.message == message
    assert [p.read_bytes() for p in tmp_path.iterdir()] == ([] if now is None else [now])


def test_saved_at_the_last_moment(
    tmp_path: Path, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An editor saves while the new text is on its way to the disk, or makes the file."""
    monkeypatch.setattr(os, "fsync", lambda fd: path.write_bytes(b"by an editor"))
    with pytest.raises(FileChangedError):
        write_atomic(tmp_path, "a.md", b"new", expected=b"old")
    path.unlink()
    real_link = os.link

    def link(source: str, target: Path) -> None:
        path.write_bytes(b"by an editor")
        real_link(source, target)

    monkeypatch.setattr(os, "link", link)
    with pytest.raises(FileChangedError):
        write_atomic(tmp_path, "a.md", b"new", expected=None, durable=False)
    assert path.read_bytes() == b"by an editor"
    assert names(tmp_path) == ["a.md"]


def test_file_system_without_hard_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(errno.EPERM, "no links here")

    monkeypatch.setattr(os, "link", refuse)
    write_atomic(tmp_path, "a.md", b"new", expected=None)
    assert (tmp_path / "a.md").read_bytes() == b"new"
    assert names(tmp_path) == ["a.md"]


def full(*_: object) -> int:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def interrupt(*_: object) -> int:
    raise KeyboardInterrupt


@pytest.mark.parametrize("call", ["write", "fsync", "replace"])
@pytest.mark.parametrize("trouble", [full, interrupt])
def test_the_system_refuses_or_somebody_interrupts(
    tmp_path: Path,
    path: Path,
    monkeypatch: pytest.MonkeyPatch,
    call: str,
    trouble: Callable[..., int],
) -> None:
    monkeypatch.setattr(os, call, trouble)
    with pytest.raises((EffectError, KeyboardInterrupt)) as caught:
        write_atomic(tmp_path, "a.md", b"new", expected=b"old")
    message = "a.md cannot be written: no space left on device" if trouble is full else ""
    assert str(caught.value) == message
    assert path.read_bytes() == b"old"
    assert names(tmp_path) == ["a.md"]


def test_no_folder_and_no_file(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "fifo")
    for path in ("none/a.md", "folder", "fifo"):
        with pytest.raises(EffectError):
            write_atomic(tmp_path, path, b"new", expected=b"")
    assert names(tmp_path) == ["fifo", "folder"]


def test_leftovers_go_and_files_in_use_stay(tmp_path: Path, path: Path) -> None:
    (tmp_path / f"{PREFIX}dead").write_bytes(b"half")
    (tmp_path / f"{PREFIX}folder").mkdir()
    (tmp_path / f"{PREFIX}link").symlink_to("a.md")
    files = {"a.md", f"{PREFIX}folder", f"{PREFIX}link"}
    fd, alive = write._open_temporary(tmp_path)
    remove_leftovers([tmp_path, tmp_path / "none"])
    assert set(names(tmp_path)) == {*files, Path(alive).name}
    os.close(fd)
    remove_leftovers([tmp_path])
    assert set(names(tmp_path)) == files


def files(root: Path) -> dict[str, bytes]:
    paths = (path for path in root.rglob("*") if ".coursebuild" not in path.parts)
    return {p.relative_to(root).as_posix(): p.read_bytes() for p in paths if p.is_file()}


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "course").mkdir()
    (tmp_path / "course/a.md").write_bytes(b"a\r\n")
    (tmp_path / "course/b.md").write_bytes(b"b")
    return tmp_path / "course"


GOOD = (
    FileChange("a.md", b"a\r\n", b"A\r\n"),
    FileChange("new/folder/c.md", None, b"c"),
    FileChange("b.md", b"b", None),
)


def journal_of(root: Path) -> Path:
    journal = journal_path(root)
    assert journal is not None
    return journal


def leave_journal(root: Path, changes: Sequence[FileChange]) -> Path:
    """What a command leaves that was killed."""
    journal = journal_of(root)
    journal.parent.mkdir(parents=True, exist_ok=True)
    journal.write_bytes(seal("changes", msgspec.msgpack.encode(changes), store_key(str(root))))
    return journal


def undo(root: Path) -> list[str]:
    lines: list[str] = []
    undo_changes(root, lines.append)
    return lines


def test_all_are_changed(root: Path) -> None:
    change_files(root, GOOD)
    assert files(root) == {"a.md": b"A\r\n", "new/folder/c.md": b"c"}
    assert undo(root) == []
    assert files(root) == {"a.md": b"A\r\n", "new/folder/c.md": b"c"}


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (FileChange("b.md", b"other", b"x"), "b.md was changed in the meantime"),
        (FileChange("b.md", b"other", None), "b.md was changed in the meantime"),
        (FileChange("b.md", None, b"x"), "b.md was created by another program in the meantime"),
        (FileChange("gone.md", b"x", b"y"), "gone.md was removed in the meantime"),
        (FileChange("gone.md", b"x", None), "gone.md was removed in the meantime"),
        (FileChange("a.md/d.md", None, b"x"), "a.md/d.md cannot be written: file exists"),
        (FileChange("../d.md", None, b"x"), "../d.md leads out of the project"),
        (FileChange("../d.md", b"x", None), "../d.md leads out of the project"),
        (FileChange("/etc/d.md", b"x", None), "/etc/d.md leads out of the project"),
        (FileChange(".git/x", None, b"x"), ".git/x is not a file that a command may change"),
        (FileChange("x/.git/x", None, b"x"), "x/.git/x is not a file that a command may change"),
        (FileChange(".venv/x", None, b"x"), ".venv/x is not a file that a command may change"),
        (FileChange(".hidden", b"x", b"y"), ".hidden is not a file that a command may change"),
    ],
)
def test_where_one_cannot_be_changed_none_is(root: Path, bad: FileChange, message: str) -> None:
    before = files(root)
    with pytest.raises(EffectError) as caught:
        change_files(root, (*GOOD[:2], bad))
    assert caught.value.message == message
    assert files(root) == before
    assert not (root / "new").exists()
    assert not journal_of(root).exists()


def test_read_only_file_is_not_replaced(root: Path) -> None:
    (root / "b.md").chmod(0o444)
    with pytest.raises(EffectError, match=r"^b\.md is read-only$"):
        change_files(root, GOOD)
    assert files(root) == {"a.md": b"a\r\n", "b.md": b"b"}


def test_undoing_waits_for_a_command_at_work_spares_later_edits_and_says_so(root: Path) -> None:
    change_files(root, GOOD[:1])
    (root / "b.md").write_bytes(b"edited since")
    lines: list[str] = []
    with project_lock(root):
        journal = leave_journal(root, (*GOOD[:1], FileChange("b.md", b"b", b"B")))
        thread = threading.Thread(target=undo_changes, args=(root, lines.append))
        thread.start()
        assert journal.exists()
    thread.join()
    assert files(root) == {"a.md": b"a\r\n", "b.md": b"edited since"}
    assert not journal.exists()
    assert lines == ["undid a change that was interrupted: a.md; left as edited since: b.md"]


def test_next_change_first_undoes_that_of_a_killed_command(root: Path) -> None:
    leave_journal(root, GOOD[:1])
    (root / "a.md").write_bytes(b"A\r\n")
    change_files(root, GOOD[2:])
    assert files(root) == {"a.md": b"a\r\n"}
    assert undo(root) == []


def test_changes_are_taken_back_last_one_first(root: Path) -> None:
    into_folder = FileChange("b.md", b"b", None), FileChange("b.md/c.md", None, b"c")
    with pytest.raises(EffectError, match=r"a\.md/d\.md"):
        change_files(root, (*into_folder, FileChange("a.md/d.md", None, b"x")))
    assert files(root) == {"a.md": b"a\r\n", "b.md": b"b"}


def test_journal_of_a_change_that_had_not_begun_is_removed_in_silence(root: Path) -> None:
    journal = leave_journal(root, GOOD)
    assert undo(root) == []
    assert files(root) == {"a.md": b"a\r\n", "b.md": b"b"}
    assert not journal.exists()


def test_no_journal_lies_in_the_course(root: Path) -> None:
    """Whatever a folder brings along, no file of it is taken for orders."""
    (root.parent / "victim").write_bytes(b"dear")
    orders = msgspec.msgpack.encode((FileChange("../victim", None, b"dear"), *GOOD))
    for data in (orders, seal("changes", orders, store_key(str(root)))):
        for name in ("changes", "journal", "journals/changes", journal_of(root).name):
            file = root / ".coursebuild" / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(data)
    before = files(root)
    assert undo(root) == []
    assert files(root) == before
    assert (root.parent / "victim").read_bytes() == b"dear"


@pytest.mark.parametrize("kind", ["empty", "cut", "garbage", "another key", "no changes", "path"])
def test_damaged_journal_is_told_of_once_and_set_aside(root: Path, kind: str) -> None:
    journal = leave_journal(root, GOOD)
    whole = journal.read_bytes()
    damaged = {
        "empty": b"",
        "cut": whole[:-1],
        "garbage": whole[:40] + b"garbage",
        "another key": seal("changes", whole[32:], b"of somebody else"),
        "path": seal(
            "changes",
            msgspec.msgpack.encode([*GOOD, FileChange("../b.md", None, b"b")]),
            store_key(str(root)),
        ),
        "no changes": seal("changes", msgspec.msgpack.encode(["?"]), store_key(str(root))),
    }
    journal.write_bytes(damaged[kind])
    assert undo(root) == [
        "an interrupted command left a damaged journal, so nothing was undone: "
        "check the files that it was changing"
    ]
    assert undo(root) == []
    assert files(root) == {"a.md": b"a\r\n", "b.md": b"b"}
    change_files(root, GOOD)
    assert files(root) == {"a.md": b"A\r\n", "new/folder/c.md": b"c"}


def test_without_a_state_folder_all_are_changed_or_none(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(root / "in the course"))
    with pytest.raises(EffectError):
        change_files(root, (*GOOD[:2], FileChange("a.md/d.md", None, b"x")))
    assert files(root) == {"a.md": b"a\r\n", "b.md": b"b"}
    lines: list[str] = []
    change_files(root, GOOD, lines.append)
    assert lines == [
        "there is no place for a journal: if this command is killed, it stays half done "
        "(set HOME or XDG_STATE_HOME to a folder outside the course)"
    ]
    assert files(root) == {"a.md": b"A\r\n", "new/folder/c.md": b"c"}


def test_what_is_saved_in_place_at_the_last_moment_is_kept(root: Path) -> None:
    """Just before a file is taken away, an editor saves it, without a rename."""
    file, saves = root / "a.md", [b"saved\n"]

    def save(event: str, arguments: tuple[object, ...]) -> None:
        if saves and event in ("os.rename", "os.remove") and arguments[0] in (file, str(file)):
            file.write_bytes(saves.pop())

    sys.addaudithook(save)
    text = file.read_bytes()
    with pytest.raises(FileChangedError):
        change_files(root, [FileChange("new.md", None, text), FileChange("a.md", text, None)])
    assert (saves, files(root)) == ([], {"a.md": b"saved\n", "b.md": b"b"})
