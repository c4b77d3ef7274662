"""What an installation without extras lacks is said by the command that needs it."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import pytest

from support.fixture_cases import fixture_text
from support.scratch_course import Folder

LESSONS = tomllib.loads(fixture_text("documents/extras.toml"))


@pytest.mark.engine
@pytest.mark.parametrize(
    ("package", "lesson", "command", "message"),
    [
        ("scipy", "motion", "check", "a trial of a lab's equations needs the package scipy"),
        ("mjbench", "formula", "bench", "`coursebuild bench` needs the package mjbench"),
        ("mjbench", "formula", "stability", "`coursebuild stability` needs the package mjbench"),
        ("mjbench", "formula", "diet", "`coursebuild diet` needs the package mjbench"),
        ("PIL", "picture", "update", "`dot.png` needs the package Pillow"),
    ],
)
def test_command_names_the_extra_that_it_needs(
    package: str,
    lesson: str,
    command: str,
    message: str,
    tmp_path: Path,
    stores: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = Folder(tmp_path / "course")
    folder.fill([LESSONS[lesson]], stores)
    monkeypatch.setitem(sys.modules, package, None)
    result = folder.main(command, "--quiet")
    advice = "\n  help: run `pip install 'coursebuild[measure]'`\n"
    if package == "PIL":
        advice = ": run `pip install 'coursebuild[figures]'`\n"
    assert message + advice in result.out + result.err
    assert result.status == 1


@pytest.mark.engine
def test_lab_of_formulas_and_build_need_no_extra(
    tmp_path: Path, stores: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Folder(tmp_path / "course")
    folder.fill([LESSONS["formula"]], stores)
    for package in ("mjbench", "scipy", "matplotlib", "PIL", "pygls", "fsspec"):
        monkeypatch.setitem(sys.modules, package, None)
    result = folder.main("build")
    assert result.status == 0, result.out + result.err
    assert (folder.root / "public/index.html").is_file()
