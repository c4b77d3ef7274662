"""Several files changed together: all of them or none; killed: `pipeline/test_killing.py`."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.trust import seal, store_key
from coursebuild.core.files.write import FileChange, change_files, journal_path, undo_changes


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
        (FileChange("b.md", None, b"x"), "b.md was made by somebody else in the meantime"),
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
        "a command that was interrupted has left a damaged journal, so nothing was undone: "
        "look at what it was changing"
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
    change_files(root, GOOD)
    assert files(root) == {"a.md": b"A\r\n", "new/folder/c.md": b"c"}
