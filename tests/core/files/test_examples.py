"""Extracted scripts: derived files that somebody may have put work into."""

from __future__ import annotations

import json
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError, OutsideProjectError
from coursebuild.core.files.examples import (
    MANIFEST,
    BlockedFile,
    ExamplesReport,
    Obstacle,
    unified_diff,
    write_examples,
)

A = ("examples/a.py", b"print(1)\n")
B = ("examples/sub/deep/b.py", b"print(2)\n")
NEXT = (A[0], b"next\n")
Summary = tuple[tuple[str, ...], ...]


def summary(report: ExamplesReport) -> Summary:
    return report.written, report.unchanged, report.removed, tuple(b.path for b in report.blocked)


def write(root: Path, *scripts: tuple[str, bytes]) -> Summary:
    return summary(write_examples(root, dict(scripts)))


def test_edited_by_hand(tmp_path: Path) -> None:
    write(tmp_path, A, B)
    (tmp_path / A[0]).write_bytes(b"print(1)\nprint('mine')")
    for script, diverged in ((A, False), (NEXT, True)):
        for _ in range(2):  # it stays so until somebody decides
            report = write_examples(tmp_path, dict([script, B]))
            assert summary(report) == ((), (B[0],), (), (A[0],))
            (blocked,) = report.blocked
            assert (blocked.obstacle, blocked.diverged) == (Obstacle.EDITED, diverged)
            assert blocked.current == "print(1)\nprint('mine')"
            assert blocked.diff.endswith("+print('mine')\n\\ No newline at end of file\n")
            assert (tmp_path / A[0]).read_bytes() == b"print(1)\nprint('mine')"


def test_edit_that_was_brought_into_the_lesson_or_taken_back(tmp_path: Path) -> None:
    write(tmp_path, A)
    (tmp_path / A[0]).write_bytes(b"mine\n")
    write(tmp_path, A)
    assert write(tmp_path, (A[0], b"mine\n")) == ((), (A[0],), (), ())
    (tmp_path / A[0]).write_bytes(b"edited again\n")
    assert write(tmp_path, NEXT) == ((), (), (), (A[0],))
    (tmp_path / A[0]).write_bytes(b"mine\n")
    assert write(tmp_path, NEXT) == ((A[0],), (), (), ())


def test_scripts_that_no_lesson_has_go_unless_they_were_edited(tmp_path: Path) -> None:
    write(tmp_path, A, B)
    (tmp_path / A[0]).write_bytes(b"mine\n")
    (tmp_path / "examples/sub/own.txt").write_text("the author's")
    assert write(tmp_path) == ((), (), (B[0],), (A[0],))
    assert sorted(p.name for p in (tmp_path / "examples/sub").iterdir()) == ["own.txt"]
    (blocked,) = write_examples(tmp_path, {}).blocked
    assert blocked.obstacle is Obstacle.ORPHAN and "+mine" in blocked.diff
    assert (tmp_path / A[0]).read_bytes() == b"mine\n"
    (tmp_path / A[0]).unlink()
    assert write(tmp_path) == ((), (), (), ())


def test_the_authors_own_files_are_left_alone(tmp_path: Path) -> None:
    (tmp_path / "examples").mkdir()
    (tmp_path / "examples/own.py").write_bytes(b"own\n")
    (tmp_path / A[0]).write_bytes(b"own too\n")
    report = write_examples(tmp_path, dict([A, B]))
    assert summary(report) == ((B[0],), (), (), (A[0],))
    diff = (
        "--- examples/a.py (in the lesson)\n+++ examples/a.py (on the disk)\n"
        "@@ -1 +1 @@\n-print(1)\n+own too\n"
    )
    assert report.blocked == (BlockedFile(A[0], Obstacle.FOREIGN, "own too\n", diff),)
    assert (tmp_path / "examples/own.py").read_bytes() == b"own\n"
    assert (tmp_path / A[0]).read_bytes() == b"own too\n"


DAMAGED_MANIFESTS = [
    *(b"", b"{", b"[]", b"null", b"\xff", b'{"files": 3}'),
    b'{"files": {"examples/a.py": 3}}',
    b'{"files": {"examples/a.py": [3]}}',
    b'{"files": {"../secret": ["x"]}}',
    b'{"files": {"examples/../../secret": ["x"]}}',
]


@pytest.mark.parametrize("manifest", [None, *DAMAGED_MANIFESTS])
def test_a_lost_manifest_makes_it_careful(tmp_path: Path, manifest: bytes | None) -> None:
    root = tmp_path / "course"
    root.mkdir()
    write(root, A, B)
    path = root / MANIFEST
    path.unlink() if manifest is None else path.write_bytes(manifest)
    (tmp_path / "secret").write_bytes(b"x")
    report = write_examples(root, dict([NEXT, B]))
    assert summary(report) == ((), (B[0],), (), (A[0],))
    assert report.blocked[0].obstacle is Obstacle.FOREIGN
    assert (tmp_path / "secret").exists()
    assert json.loads(path.read_bytes())["files"].keys() == {B[0]}


def test_what_a_power_cut_emptied_is_written_again_with_its_permissions(tmp_path: Path) -> None:
    write(tmp_path, A)
    (tmp_path / A[0]).write_bytes(b"")
    (tmp_path / A[0]).chmod(0o755)
    assert write(tmp_path, A) == ((A[0],), (), (), ())
    assert stat.S_IMODE((tmp_path / A[0]).stat().st_mode) == 0o755


def test_files_that_are_not_text(tmp_path: Path) -> None:
    write(tmp_path, A)
    (tmp_path / A[0]).write_bytes(b"a\xffb\r\n\x0cc\n")
    (blocked,) = write_examples(tmp_path, dict([A])).blocked
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
    obstacles = {
        "examples/file/x.py": Obstacle.FOLDER,
        "examples/folder.py": Obstacle.FOLDER,
        "examples/inner.py": Obstacle.LINK,
        "examples/link.py": Obstacle.LINK,
        "examples/out/x.py": Obstacle.LINK,
    }
    report = write_examples(root, dict.fromkeys(obstacles, b"new\n") | dict([A]))
    assert report.written == (A[0],)
    assert {b.path: b.obstacle for b in report.blocked} == obstacles
    assert (tmp_path / "outside/x.py").read_bytes() == b"outside"
    assert (root / "examples/file").read_bytes() == b"own"


def test_folder_that_leads_out_or_is_a_file(tmp_path: Path) -> None:
    root = tmp_path / "course"
    for path in (root, tmp_path / "outside"):
        path.mkdir()
    (root / "examples").symlink_to("../outside")
    with pytest.raises(OutsideProjectError):
        write(root, A)
    assert list((tmp_path / "outside").iterdir()) == []
    (root / "examples").unlink()
    (root / "examples").write_bytes(b"own")
    with pytest.raises(EffectError):
        write(root, A)
    assert (root / "examples").read_bytes() == b"own"


class Scripts(dict[str, bytes]):
    """Scripts whose first access, after the disk was read, runs a function."""

    def __init__(self, scripts: list[tuple[str, bytes]], happens: Callable[[], object]) -> None:
        super().__init__(scripts)
        self.happens = happens

    def __getitem__(self, path: str) -> bytes:
        happens, self.happens = self.happens, lambda: None
        happens()
        return super().__getitem__(path)


def test_saved_while_we_work(tmp_path: Path) -> None:
    write(tmp_path, A, B)

    def save() -> None:
        for path, _ in (A, B):
            (tmp_path / path).write_bytes(b"mine\n")

    report = write_examples(tmp_path, Scripts([NEXT], save))
    assert {b.path: b.obstacle for b in report.blocked} == {
        A[0]: Obstacle.EDITED,
        B[0]: Obstacle.ORPHAN,
    }
    assert summary(report)[:3] == ((), (), ())
    assert [(tmp_path / path).read_bytes() for path, _ in (A, B)] == [b"mine\n"] * 2


def test_two_runs_at_once_write_the_same(tmp_path: Path) -> None:
    """As on a file system without locks: nobody edited anything."""
    reports: list[Summary] = []
    scripts = Scripts([A, B], lambda: reports.append(write(tmp_path, A, B)))
    report = summary(write_examples(tmp_path, scripts))
    assert [report, *reports] == [((A[0], B[0]), (), (), ())] * 2
    assert write(tmp_path, A, B) == ((), (A[0], B[0]), (), ())


def test_unified_diff() -> None:
    head = "--- o\n+++ n\n"
    for old, new, diff in (
        ("a\n", "a\n", ""),
        ("a\n", "a", f"{head}@@ -1 +1 @@\n-a\n+a\n\\ No newline at end of file\n"),
        ("", "a\n", f"{head}@@ -0,0 +1 @@\n+a\n"),
        ("a\x0cb\u2028c\n", "d\n", f"{head}@@ -1 +1 @@\n-a\x0cb\u2028c\n+d\n"),
    ):
        assert unified_diff(old, new, "o", "n") == diff
