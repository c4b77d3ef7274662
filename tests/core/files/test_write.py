"""Replacing an author's file: whole, with its permissions, and only if nobody else touched it."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

import pytest

from coursebuild.core.files import write
from coursebuild.core.files.errors import EffectError, FileChangedError, OutsideProjectError
from coursebuild.core.files.write import PREFIX, check_writable, remove_leftovers, write_atomic


def names(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir())


def test_replaces_and_leaves_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "a.md").write_bytes(b"old\r\n")
    write_atomic(tmp_path, "a.md", b"new\r\n\xff", expected=b"old\r\n")
    assert (tmp_path / "a.md").read_bytes() == b"new\r\n\xff"
    assert names(tmp_path) == ["a.md"]


@pytest.mark.parametrize("durable", [True, False])
def test_makes_a_new_file(tmp_path: Path, durable: bool) -> None:
    write_atomic(tmp_path, "a.md", b"", expected=None, durable=durable)
    write_atomic(tmp_path, "b.md", b"x" * 3_000_000, expected=None, durable=durable)
    assert (tmp_path / "b.md").stat().st_size == 3_000_000
    assert names(tmp_path) == ["a.md", "b.md"]


@pytest.mark.parametrize("mode", [0o600, 0o644, 0o755, 0o640, 0o664])
def test_permissions_stay(tmp_path: Path, mode: int) -> None:
    path = tmp_path / "a.md"
    path.write_bytes(b"old")
    path.chmod(mode)
    write_atomic(tmp_path, "a.md", b"new", expected=b"old")
    assert stat.S_IMODE(path.stat().st_mode) == mode


@pytest.mark.parametrize("mode", [0o444, 0o555, 0o464, 0])
def test_an_authors_read_only_file_is_left_alone(tmp_path: Path, mode: int) -> None:
    """By root too, who may write it; a derived one can be made again."""
    path = tmp_path / "a.md"
    path.write_bytes(b"old")
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


def test_owner_stays(tmp_path: Path) -> None:
    path = tmp_path / "a.md"
    path.write_bytes(b"old")
    if os.geteuid() == 0:  # who else cannot give files away, and cannot be asked to keep another's
        os.chown(path, 12345, 23456)
    owner = (path.stat().st_uid, path.stat().st_gid)
    write_atomic(tmp_path, "a.md", b"new", expected=b"old")
    assert (path.stat().st_uid, path.stat().st_gid) == owner


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "real/a.md").write_bytes(b"old")
    (tmp_path / "a.md").symlink_to("real/a.md")
    write_atomic(tmp_path, "a.md", b"new", expected=b"old")
    assert (tmp_path / "a.md").is_symlink()
    assert (tmp_path / "real/a.md").read_bytes() == b"new"
    assert names(tmp_path / "real") == ["a.md"]


def test_a_link_out_of_the_project_is_refused(tmp_path: Path) -> None:
    root = tmp_path / "course"
    root.mkdir()
    (tmp_path / "other.md").write_bytes(b"old")
    (root / "a.md").symlink_to("../other.md")
    with pytest.raises(OutsideProjectError):
        write_atomic(root, "a.md", b"new", expected=b"old")
    assert (tmp_path / "other.md").read_bytes() == b"old"
    assert names(tmp_path) == ["course", "other.md"]


@pytest.mark.parametrize(
    ("now", "expected", "message"),
    [
        (b"changed", b"old", "a.md was changed in the meantime"),
        (None, b"old", "a.md was removed in the meantime"),
        (b"changed", None, "a.md was made by somebody else in the meantime"),
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
    assert names(tmp_path) == ([] if now is None else ["a.md"])
    if now is not None:
        assert (tmp_path / "a.md").read_bytes() == now


def test_saved_at_the_last_moment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An editor saves while the new text is on its way to the disk."""
    path = tmp_path / "a.md"
    path.write_bytes(b"old")
    monkeypatch.setattr(os, "fsync", lambda fd: path.write_bytes(b"saved by an editor"))
    with pytest.raises(FileChangedError):
        write_atomic(tmp_path, "a.md", b"new", expected=b"old")
    assert path.read_bytes() == b"saved by an editor"
    assert names(tmp_path) == ["a.md"]


def test_made_after_the_last_look(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    really = write.check_unchanged

    def look(target: Path, path: str, expected: bytes | None) -> None:
        really(target, path, expected)
        target.write_bytes(b"made by somebody")

    monkeypatch.setattr(write, "check_unchanged", look)
    with pytest.raises(FileChangedError):
        write_atomic(tmp_path, "a.md", b"new", expected=None)
    assert (tmp_path / "a.md").read_bytes() == b"made by somebody"
    assert names(tmp_path) == ["a.md"]


def test_file_system_without_hard_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(errno.EPERM, "no links here")

    monkeypatch.setattr(os, "link", refuse)
    write_atomic(tmp_path, "a.md", b"new", expected=None)
    assert (tmp_path / "a.md").read_bytes() == b"new"
    assert names(tmp_path) == ["a.md"]


@pytest.mark.parametrize("call", ["write", "fsync", "replace"])
def test_the_system_refuses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str) -> None:
    (tmp_path / "a.md").write_bytes(b"old")

    def fail(*_: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, call, fail)
    with pytest.raises(EffectError) as caught:
        write_atomic(tmp_path, "a.md", b"new", expected=b"old")
    assert caught.value.message == "a.md cannot be written: no space left on device"
    assert (tmp_path / "a.md").read_bytes() == b"old"
    assert names(tmp_path) == ["a.md"]


def test_no_folder_and_no_file(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "fifo")
    for path in ("none/a.md", "folder", "fifo"):
        with pytest.raises(EffectError):
            write_atomic(tmp_path, path, b"new", expected=b"")
    assert names(tmp_path) == ["fifo", "folder"]


def test_an_interrupt_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.md").write_bytes(b"old")

    def interrupt(fd: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_atomic(tmp_path, "a.md", b"new", expected=b"old")
    assert names(tmp_path) == ["a.md"]


def test_leftovers_go_and_files_in_use_stay(tmp_path: Path) -> None:
    (tmp_path / f"{PREFIX}dead").write_bytes(b"half")
    (tmp_path / "a.md").write_bytes(b"author")
    (tmp_path / f"{PREFIX}folder").mkdir()
    (tmp_path / f"{PREFIX}link").symlink_to("a.md")
    fd, alive = write._open_temporary(tmp_path)
    try:
        remove_leftovers([tmp_path, tmp_path / "none"])
        assert Path(alive).exists()
        assert names(tmp_path) == sorted(
            ["a.md", f"{PREFIX}folder", f"{PREFIX}link", Path(alive).name]
        )
    finally:
        os.close(fd)
    remove_leftovers([tmp_path])
    assert names(tmp_path) == [f"{PREFIX}folder", f"{PREFIX}link", "a.md"]
