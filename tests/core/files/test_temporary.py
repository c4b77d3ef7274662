"""Temporary folders: gone at the end, and after a kill with the next."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from coursebuild.core.files.temporary import temporary_folder

WAIT = """
from coursebuild.core.files.temporary import temporary_folder
with temporary_folder() as folder:
    print(folder, flush=True)
    input()
"""


def test_folders_of_killed_processes_are_removed_and_no_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    (tmp_path / "coursebuild-notes").mkdir()
    (tmp_path / "coursebuild-notes/mine.txt").touch()
    (tmp_path / "another").mkdir()
    (tmp_path / "coursebuild-file").touch()
    (tmp_path / "coursebuild-link").symlink_to(tmp_path / "another")
    foreign = set(tmp_path.iterdir())
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", WAIT], **pipes, text=True) as process:
        assert process.stdout is not None
        theirs = Path(process.stdout.readline().strip())
        with temporary_folder() as ours:
            (Path(ours) / "file").touch()
            assert set(tmp_path.iterdir()) == {*foreign, theirs, Path(ours)}
        assert set(tmp_path.iterdir()) == {*foreign, theirs}
        process.kill()
        process.wait()
        assert theirs.exists()
        with temporary_folder() as ours:
            assert set(tmp_path.iterdir()) == {*foreign, Path(ours)}
