"""`coursebuild import`: courses of five kinds, and folders that cannot be imported.

A case is a folder beside this file with `source/`, a course of another tool, and `expected/`: what
an author finds in the new one, with the report in `report.txt`. The case `markup` holds what
several dialects write alike. `pytest --rewrite-fixtures` writes `expected/`.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from coursebuild.cli import main

HERE = Path(__file__).parent
CASES = sorted(path.parent.name for path in HERE.glob("*/source"))
GENERATED = ("public", "examples", ".coursebuild")


def texts(folder: Path) -> dict[str, bytes]:
    """Return all files of a folder except generated ones."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.relative_to(folder).parts[0] not in GENERATED
    }


def test_there_is_a_course_of_each_kind() -> None:
    assert CASES == ["levels", "markup", "mkdocs", "myst", "notebooks", "quarto"]


@pytest.mark.site
@pytest.mark.parametrize("case", CASES)
def test_imported_course_builds_without_an_edit(
    case: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    rewriting: bool,
) -> None:
    source, expected = tmp_path / case, HERE / case / "expected"
    shutil.copytree(HERE / case / "source", source)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert main(["import", str(source)]) == 0
    report = capsys.readouterr().out.split("\n\n")[1].replace(str(tmp_path), "…") + "\n"
    files = {**texts(tmp_path / "here" / case), "report.txt": report.encode()}
    assert main(["-C", case, "build", "--quiet"]) == 0, capsys.readouterr().out
    assert texts(source) == texts(HERE / case / "source")  # only read
    if rewriting:
        shutil.rmtree(expected, ignore_errors=True)
        for path, data in files.items():
            (expected / path).parent.mkdir(parents=True, exist_ok=True)
            (expected / path).write_bytes(data)
    assert files == texts(expected)


def import_refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["import", *arguments]) == 2
    return capsys.readouterr().err


def test_folder_that_cannot_be_imported_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    course = tmp_path / "old"
    stderr = import_refused(capsys, "old")
    assert stderr == "coursebuild: there is no folder old\n"
    course.mkdir()
    stderr = import_refused(capsys, "old")
    empty_message = "there is nothing to import: no course.json, no notebook and no Markdown file"
    assert stderr == f"coursebuild: {empty_message}\n"
    for name, text, message in [
        (
            "course.json",
            "{",
            "course.json is no JSON: Expecting property name enclosed in double "
            "quotes: line 1 column 2 (char 1)",
        ),
        ("course.json", "[" * 100_000, "course.json is no JSON: the text is nested too deeply"),
        ("course.json", '{"levels": []}', "course.json has no `levels`"),
        ("course.json", '{"levels": [7]}', "course.json: a level or a lesson is no object"),
        ("one.ipynb", '{"cells": 7}', "one.ipynb is no notebook of format 4"),
        ("one.ipynb", '{"cells": [7]}', "one.ipynb is no notebook of format 4"),
        ("_toc.yml", "a: [", "_toc.yml is no YAML"),
        ("_quarto.yml", "book: 7\nwebsite: [x]", empty_message),
    ]:
        (course / name).write_text(text)
        assert import_refused(capsys, "old") == f"coursebuild: {message}\n", name
        (course / name).unlink()
    (course / "one.md").write_bytes(b"\xff")
    assert import_refused(capsys, "old") == "coursebuild: one.md is not UTF-8\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["old"]


def test_nothing_is_written_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "one.md").write_text("# One\n\nText.\n")
    message_inside = "is in the folder that is imported, which is only read"
    for out in ("old", "old/new"):
        assert f"{message_inside}\n" in import_refused(capsys, "old", "--out", out)
    (tmp_path / "there" / "content").mkdir(parents=True)
    (tmp_path / "there" / "content" / "course.toml").write_text("mine")
    message = import_refused(capsys, "old", "--out", "there")
    reason = "has content/course.toml already; name an empty folder with --out"
    assert message == f"coursebuild: {tmp_path / 'there'} {reason}\n"
    assert texts(tmp_path / "there") == {"content/course.toml": b"mine"}


def test_import_that_fails_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "one.md").write_text("# One\n\nText.\n")
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "content").write_text("mine")
    assert main(["import", "old", "--out", "there"]) == 1
    assert "content" in capsys.readouterr().err
    assert texts(tmp_path / "there") == {"content": b"mine"}
