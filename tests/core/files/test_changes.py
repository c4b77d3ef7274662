"""Several files changed together: all of them or none; killed: `pipeline/test_killing.py`."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from coursebuild.core.files.changes import JOURNAL, FileChange, change_files, undo_changes
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.locks import project_lock


def files(root: Path) -> dict[str, bytes]:
    paths = (path for path in root.rglob("*") if ".coursebuild" not in path.parts)
    return {p.relative_to(root).as_posix(): p.read_bytes() for p in paths if p.is_file()}


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "a.md").write_bytes(b"a\r\n")
    (tmp_path / "b.md").write_bytes(b"b")
    return tmp_path


GOOD = (
    FileChange("a.md", b"a\r\n", b"A\r\n"),
    FileChange("new/folder/c.md", None, b"c"),
    FileChange("b.md", b"b", None),
)


def test_all_are_changed(root: Path) -> None:
    change_files(root, GOOD)
    assert files(root) == {"a.md": b"A\r\n", "new/folder/c.md": b"c"}
    undo_changes(root)
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
    ],
)
def test_where_one_cannot_be_changed_none_is(root: Path, bad: FileChange, message: str) -> None:
    before = files(root)
    with pytest.raises(EffectError) as caught:
        change_files(root, (*GOOD[:2], bad))
    assert caught.value.message == message
    assert files(root) == before
    assert not (root / "new").exists()
    assert not (root / JOURNAL).exists()


def test_read_only_file_is_not_replaced(root: Path) -> None:
    (root / "b.md").chmod(0o444)
    with pytest.raises(EffectError, match=r"^b\.md is read-only$"):
        change_files(root, GOOD)
    assert files(root) == {"a.md": b"a\r\n", "b.md": b"b"}


def test_undoing_waits_for_a_command_at_work_and_spares_later_edits(root: Path) -> None:
    change_files(root, GOOD[:1])
    journal = root / JOURNAL
    (root / "b.md").write_bytes(b"edited since")
    with project_lock(root):
        journal.write_bytes(encode((*GOOD[:1], FileChange("b.md", b"b", b"B"))))
        thread = threading.Thread(target=undo_changes, args=(root,))
        thread.start()
        assert journal.exists()
    thread.join()
    assert files(root) == {"a.md": b"a\r\n", "b.md": b"edited since"}
    assert not journal.exists()


def encode(changes: tuple[FileChange, ...]) -> bytes:
    import msgspec

    return msgspec.msgpack.encode(changes)
