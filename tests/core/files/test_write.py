"""Replacing an author's file: whole, with its permissions, and only if nobody else touched it."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core.files import write
from coursebuild.core.files.errors import EffectError, FileChangedError, OutsideProjectError
from coursebuild.core.files.write import PREFIX, check_writable, remove_leftovers, write_atomic


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file of an author."""
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
