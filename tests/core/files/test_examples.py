"""Extracted scripts: derived files that somebody may have put work into."""

from __future__ import annotations

import errno
import json
import os
import stat
from pathlib import Path

import pytest

from coursebuild.core.files import examples
from coursebuild.core.files.errors import EffectError, OutsideProjectError
from coursebuild.core.files.examples import (
    MANIFEST,
    Blocked,
    ExamplesReport,
    Obstacle,
    unified_diff,
    write_examples,
)

A = ("examples/a.py", b"print(1)\n")
B = ("examples/sub/deep/b.py", b"print(2)\n")


def listing(root: Path) -> list[str]:
    folder = root / "examples"
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*"))


def summary(report: ExamplesReport) -> tuple[tuple[str, ...], ...]:
    return report.written, report.unchanged, report.removed, tuple(b.path for b in report.blocked)


def test_no_scripts_no_folder(tmp_path: Path) -> None:
    assert summary(write_examples(tmp_path, [])) == ((), (), (), ())
    assert list(tmp_path.iterdir()) == []


def test_unchanged_files_are_not_touched(tmp_path: Path) -> None:
    write_examples(tmp_path, [A, B])
    before = {p: p.stat().st_mtime_ns for p in (tmp_path / "examples").rglob("*")}
    assert summary(write_examples(tmp_path, [A, B])) == ((), (A[0], B[0]), (), ())
    assert {p: p.stat().st_mtime_ns for p in (tmp_path / "examples").rglob("*")} == before


def test_edited_by_hand(tmp_path: Path) -> None:
    write_examples(tmp_path, [A, B])
    (tmp_path / A[0]).write_bytes(b"print(1)\nprint('mine')")
    for wanted in (A[1], b"print(3)\n"):
        for _ in range(2):  # it stays so until somebody decides
            report = write_examples(tmp_path, [(A[0], wanted), B])
            assert summary(report) == ((), (B[0],), (), (A[0],))
            (blocked,) = report.blocked
            assert blocked.obstacle is Obstacle.EDITED
            assert blocked.current == "print(1)\nprint('mine')"
            assert blocked.diff.endswith("+print('mine')\n\\ No newline at end of file\n")
            assert (tmp_path / A[0]).read_bytes() == b"print(1)\nprint('mine')"


def test_the_edit_was_brought_into_the_lesson(tmp_path: Path) -> None:
    write_examples(tmp_path, [A])
    (tmp_path / A[0]).write_bytes(b"mine\n")
    write_examples(tmp_path, [A])
    assert summary(write_examples(tmp_path, [(A[0], b"mine\n")])) == ((), (A[0],), (), ())
    assert summary(write_examples(tmp_path, [(A[0], b"next\n")])) == ((A[0],), (), (), ())


def test_the_edit_was_taken_back(tmp_path: Path) -> None:
    write_examples(tmp_path, [A])
    (tmp_path / A[0]).write_bytes(b"mine\n")
    write_examples(tmp_path, [(A[0], b"next\n")])
    (tmp_path / A[0]).write_bytes(A[1])
    assert summary(write_examples(tmp_path, [(A[0], b"next\n")])) == ((A[0],), (), (), ())


def test_scripts_that_no_lesson_has_go(tmp_path: Path) -> None:
    write_examples(tmp_path, [A, B])
    (tmp_path / "examples/sub/own.txt").write_text("the author's")
    assert summary(write_examples(tmp_path, [])) == ((), (), (A[0], B[0]), ())
    assert listing(tmp_path) == [".extracted.json", "sub", "sub/own.txt"]
    assert summary(write_examples(tmp_path, [])) == ((), (), (), ())


def test_edited_scripts_that_no_lesson_has_stay(tmp_path: Path) -> None:
    write_examples(tmp_path, [A, B])
    (tmp_path / A[0]).write_bytes(b"mine\n")
    for _ in range(2):
        report = write_examples(tmp_path, [B])
        assert summary(report) == ((), (B[0],), (), (A[0],))
        assert report.blocked[0].obstacle is Obstacle.ORPHAN
        assert "+mine" in report.blocked[0].diff
        assert (tmp_path / A[0]).read_bytes() == b"mine\n"
    (tmp_path / A[0]).unlink()
    assert summary(write_examples(tmp_path, [B])) == ((), (B[0],), (), ())


def test_the_authors_own_files_are_left_alone(tmp_path: Path) -> None:
    (tmp_path / "examples").mkdir()
    (tmp_path / "examples/own.py").write_bytes(b"own\n")
    (tmp_path / A[0]).write_bytes(b"own too\n")
    report = write_examples(tmp_path, [A, B])
    assert summary(report) == ((B[0],), (), (), (A[0],))
    assert report.blocked == (
        Blocked(
            A[0],
            Obstacle.FOREIGN,
            "own too\n",
            "--- examples/a.py (in the lesson)\n+++ examples/a.py (on the disk)\n"
            "@@ -1 +1 @@\n-print(1)\n+own too\n",
        ),
    )
    assert (tmp_path / "examples/own.py").read_bytes() == b"own\n"
    assert (tmp_path / A[0]).read_bytes() == b"own too\n"


@pytest.mark.parametrize(
    "manifest",
    [
        None,
        b"",
        b"{",
        b"[]",
        b"null",
        b"\xff",
        b'{"files": 3}',
        b'{"files": {"examples/a.py": 3}}',
        b'{"files": {"examples/a.py": [3]}}',
        b'{"files": {"../secret": ["x"]}}',
        b'{"files": {"examples/../../secret": ["x"]}}',
    ],
)
def test_a_lost_manifest_makes_it_careful(tmp_path: Path, manifest: bytes | None) -> None:
    write_examples(tmp_path, [A, B])
    path = tmp_path / MANIFEST
    path.unlink() if manifest is None else path.write_bytes(manifest)
    (tmp_path.parent / "secret").write_bytes(b"x")
    report = write_examples(tmp_path, [(A[0], b"next\n"), B])
    assert summary(report) == ((), (B[0],), (), (A[0],))
    assert report.blocked[0].obstacle is Obstacle.FOREIGN
    assert (tmp_path.parent / "secret").exists()
    assert json.loads(path.read_bytes())["files"].keys() == {B[0]}


def test_what_a_power_cut_emptied_is_written_again(tmp_path: Path) -> None:
    write_examples(tmp_path, [A])
    (tmp_path / A[0]).write_bytes(b"")
    assert summary(write_examples(tmp_path, [A])) == ((A[0],), (), (), ())


def test_files_that_are_not_text(tmp_path: Path) -> None:
    write_examples(tmp_path, [A])
    (tmp_path / A[0]).write_bytes(b"a\xffb\r\n\x0cc\n")
    (blocked,) = write_examples(tmp_path, [A]).blocked
    assert blocked.current == "a\\xffb\r\n\x0cc\n"
    assert "+a\\xffb\r\n+\x0cc\n" in blocked.diff


def test_links_and_folders_in_the_way(tmp_path: Path) -> None:
    root = tmp_path / "course"
    (root / "examples/folder.py").mkdir(parents=True)
    (root / "examples/file").write_bytes(b"own")
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside/x.py").write_bytes(b"outside")
    (root / "examples/link.py").symlink_to("../../outside/x.py")
    (root / "examples/inner.py").symlink_to("file")
    (root / "examples/out").symlink_to("../../outside")
    paths = ["examples/folder.py", "examples/file/x.py", "examples/link.py", "examples/out/x.py"]
    paths.append("examples/inner.py")
    report = write_examples(root, [(p, b"new\n") for p in paths] + [A])
    assert report.written == (A[0],)
    assert {b.path: b.obstacle for b in report.blocked} == {
        "examples/file/x.py": Obstacle.FOLDER,
        "examples/folder.py": Obstacle.FOLDER,
        "examples/inner.py": Obstacle.LINK,
        "examples/link.py": Obstacle.LINK,
        "examples/out/x.py": Obstacle.LINK,
    }
    assert (tmp_path / "outside/x.py").read_bytes() == b"outside"
    assert (root / "examples/file").read_bytes() == b"own"


def test_folder_leads_out(tmp_path: Path) -> None:
    root = tmp_path / "course"
    root.mkdir()
    (tmp_path / "outside").mkdir()
    (root / "examples").symlink_to("../outside")
    with pytest.raises(OutsideProjectError):
        write_examples(root, [A])
    assert list((tmp_path / "outside").iterdir()) == []


def test_folder_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "examples").write_bytes(b"own")
    with pytest.raises(EffectError):
        write_examples(tmp_path, [A])
    assert (tmp_path / "examples").read_bytes() == b"own"


def test_saved_while_we_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_examples(tmp_path, [A, B])
    really = examples._save_manifest

    def save(root: Path, manifest: dict[str, tuple[str, ...]]) -> None:
        really(root, manifest)
        (root / A[0]).write_bytes(b"mine\n")
        (root / B[0]).write_bytes(b"mine too\n")

    monkeypatch.setattr(examples, "_save_manifest", save)
    report = write_examples(tmp_path, [(A[0], b"next\n")])
    assert {b.path: b.obstacle for b in report.blocked} == {
        A[0]: Obstacle.EDITED,
        B[0]: Obstacle.ORPHAN,
    }
    assert summary(report)[:3] == ((), (), ())
    assert (tmp_path / A[0]).read_bytes() == b"mine\n"
    assert (tmp_path / B[0]).read_bytes() == b"mine too\n"


def test_two_runs_at_once_write_the_same(tmp_path: Path) -> None:
    """As they do where a file system has no locks: nobody edited anything."""
    other: list[ExamplesReport] = []

    class Scripts(dict[str, bytes]):
        asked = 0

        def __getitem__(self, path: str) -> bytes:
            self.asked += 1
            if self.asked == 3:  # both files were looked at, and the first is about to be written
                other.append(write_examples(tmp_path, [A, B]))
            return super().__getitem__(path)

    report = write_examples(tmp_path, Scripts([A, B]))
    assert [summary(one) for one in (report, *other)] == [((A[0], B[0]), (), (), ())] * 2
    assert summary(write_examples(tmp_path, [A, B])) == ((), (A[0], B[0]), (), ())


def test_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_examples(tmp_path, [A])

    def fail(*_: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", fail)
        with pytest.raises(EffectError, match="no space left on device"):
            write_examples(tmp_path, [(A[0], b"next\n")])
    assert (tmp_path / A[0]).read_bytes() == A[1]
    assert summary(write_examples(tmp_path, [(A[0], b"next\n")])) == ((A[0],), (), (), ())


def test_permissions_that_somebody_gave_stay(tmp_path: Path) -> None:
    write_examples(tmp_path, [A])
    (tmp_path / A[0]).chmod(0o755)
    write_examples(tmp_path, [(A[0], b"next\n")])
    assert stat.S_IMODE((tmp_path / A[0]).stat().st_mode) == 0o755


@pytest.mark.parametrize(
    ("old", "new", "diff"),
    [
        ("a\n", "a\n", ""),
        ("a\n", "a", "--- o\n+++ n\n@@ -1 +1 @@\n-a\n+a\n\\ No newline at end of file\n"),
        ("", "a\n", "--- o\n+++ n\n@@ -0,0 +1 @@\n+a\n"),
        ("a\x0cb\u2028c\n", "d\n", "--- o\n+++ n\n@@ -1 +1 @@\n-a\x0cb\u2028c\n+d\n"),
    ],
)
def test_unified_diff(old: str, new: str, diff: str) -> None:
    assert unified_diff(old, new, "o", "n") == diff
