"""`coursebuild import`: courses of five kinds, and folders that cannot be imported.

A case is a folder beside this file with `source/`, a course of another tool, and `expected/`: what
an author finds in the new one, with the report in `said.txt`. `pytest --rewrite-fixtures` writes
`expected/`.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from coursebuild.cli import main
from coursebuild.features.importer.convert import convert

HERE = Path(__file__).parent
CASES = sorted(path.parent.name for path in HERE.glob("*/source"))
MADE = ("public", "examples", ".coursebuild")


def texts(folder: Path) -> dict[str, bytes]:
    """All files of a folder but for those that the tool makes anew."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.relative_to(folder).parts[0] not in MADE
    }


def test_there_is_a_course_of_each_kind() -> None:
    assert CASES == ["levels", "mkdocs", "myst", "notebooks", "quarto"]


@pytest.mark.site
@pytest.mark.parametrize("case", CASES)
def test_imported_course_builds_without_an_edit(
    case: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    request: pytest.FixtureRequest,
) -> None:
    source, expected = tmp_path / case, HERE / case / "expected"
    shutil.copytree(HERE / case / "source", source)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert main(["import", str(source)]) == 0
    report = capsys.readouterr().out.split("\n\n")[1].replace(str(tmp_path), "…") + "\n"
    made = {**texts(tmp_path / "here" / case), "said.txt": report.encode()}
    assert main(["-C", case, "build", "--quiet"]) == 0, capsys.readouterr().out
    assert texts(source) == texts(HERE / case / "source")  # only read
    if request.config.getoption("--rewrite-fixtures"):
        shutil.rmtree(expected, ignore_errors=True)
        for path, data in made.items():
            (expected / path).parent.mkdir(parents=True, exist_ok=True)
            (expected / path).write_bytes(data)
    assert made == texts(expected)


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["import", *arguments]) == 2
    return capsys.readouterr().err


def test_folder_that_cannot_be_imported_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    course = tmp_path / "old"
    said = refused(capsys, "old")
    assert said == "coursebuild: there is no folder old\n"
    course.mkdir()
    said = refused(capsys, "old")
    nothing = "there is nothing to import: no course.json, no notebook and no Markdown file"
    assert said == f"coursebuild: {nothing}\n"
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
        ("_quarto.yml", "book: 7\nwebsite: [x]", nothing),
    ]:
        (course / name).write_text(text)
        assert refused(capsys, "old") == f"coursebuild: {message}\n", name
        (course / name).unlink()
    (course / "one.md").write_bytes(b"\xff")
    assert refused(capsys, "old") == "coursebuild: one.md is not UTF-8\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["old"]


def test_nothing_is_written_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "one.md").write_text("# One\n\nText.\n")
    inside = "is in the folder that is imported, which is only read"
    for out in ("old", "old/new"):
        assert f"{inside}\n" in refused(capsys, "old", "--out", out)
    (tmp_path / "there" / "content").mkdir(parents=True)
    (tmp_path / "there" / "content" / "course.toml").write_text("mine")
    said = refused(capsys, "old", "--out", "there")
    has = "has content/course.toml already; name an empty folder with --out"
    assert said == f"coursebuild: {tmp_path / 'there'} {has}\n"
    assert texts(tmp_path / "there") == {"content/course.toml": b"mine"}


def lesson(folder: Path, text: str) -> tuple[str, list[str]]:
    """What becomes of a text, and what is left."""
    folder.mkdir(exist_ok=True)
    (folder / "one.md").write_text(text, encoding="utf-8")
    converted = convert(folder)
    written = next(d for p, d in converted.files.items() if p.startswith("content/lessons/"))
    return written.decode(), [f"{left.place}: {left.what}" for left in converted.left]


REWRITTEN = {
    "code is left alone: `$\\pm$18 [[x]] {{ y }}`": "code is left alone: `$\\pm$18 [[x]] {{ y }}`",
    "a range of $a$5": "a range of $a5$",
    "money: $5 or $6": "money: $5 or $6",
    "{math}`x^2` and {abbr}`DOF`": "$x^2$ and DOF",
    "[here](one.md#Some-Part)": "[here](lesson:1.1#some-part)",
    "[`code` and *more*](https://example.org/a_(b)": "[`code` and *more*](https://example.org/a_(b)",
    '!!! note "Heed"\n    Twice\n    as much.\n\nSo.': "> [!note] Heed\n> Twice\n> as much.\n\nSo.",
    '::: {.callout-tip collapse="true"}\n## A title\nText.\n:::': "> [!tip]- A title\n> Text.",
    "```{warning} Careful.\nOf the dog.\n```": "> [!warning]\n> Careful.\n> Of the dog.",
    "````{note}\n```python\nx\n```\n````": "> [!note]\n> ```python\n> x\n> ```",
    "$$\na = b\n$$ (eq:first)": "$$\na = b\n$$ {#eq:first}",
    "\\begin{align}\na &= b \\label{eq:it}\n\\end{align}": (
        "$$\\begin{align}\na &= b \n\\end{align}$$ {#eq:it}"
    ),
    "> [!tip] Go\n> A $a$5.\n> ```text\n> $a$5\n> ```\n> Then.": (
        "> [!tip] Go\n> A $a5$.\n> ```text\n> $a$5\n> ```\n> Then."
    ),
    "1. one\n\n   ```python\n   x = '$a$5'\n   ```\n2. $a$5": (
        "1. one\n\n   ```python\n   x = '$a$5'\n   ```\n2. $a5$"
    ),
    "```mermaid\ngraph LR\n```": "```mermaid\ngraph LR\n```",
    "~~~js\n1\n~~~": "```js\n1\n```",
    "~~~text\n```\n~~~": "````text\n```\n````",
    "an open fence\n\n```text\nto the end": "an open fence\n\n```text\nto the end\n```",
}


def test_markup_of_other_tools_is_rewritten(tmp_path: Path) -> None:
    wrong = {}
    for number, (text, expected) in enumerate(REWRITTEN.items()):
        made, left = lesson(tmp_path / str(number), text)
        if made != expected + "\n" or left:
            wrong[text] = (made, left)
    assert wrong == {}


LEFT = {
    "[gone](gone.md)": ("gone", "line 1: a link to `gone.md`, which is not in the folder"),
    "\n\n![far](https://example.org/x.png)": (
        "[far](https://example.org/x.png)",
        "line 3: a picture from another host, `https://example.org/x.png`; it is a link now",
    ),
    "{{ version }}": ("`{{ version }}`", "line 1: `{{ version }}`, which is shown as code"),
    "{sparkle}`x`": ("`x`", "line 1: the role `{sparkle}`; its text is shown as code"),
    "```{sparkle} y\nx\n```": (
        "```text\ny\nx\n```",
        "line 1: the directive `{sparkle}`, whose text is shown as it was written",
    ),
    "```{python}\nif\n```": (
        "```python fragment\nif\n```",
        "line 1: a cell that is no Python is shown and not run: invalid syntax (<unknown>, line 1)",
    ),
    "```{python}\nx = 1\n```\n```{python}\n%%bash\nls\n```\n```{python}\nprint(x)\n```": (
        "```python fragment\nx = 1\n```\n\n```bash\nls\n```\n\n"
        '```python file=examples/l1_1_one.py\n"""One."""\n\nx = 1\n\nprint(x)\n```',
        "line 4: a cell of `%%bash` is shown and not run",
    ),
    "```lap\n{}\n```": ("```json\n{}\n```", "line 1: a block `lap`, which is shown as JSON"),
}


def test_what_has_no_counterpart_is_left_with_its_place(tmp_path: Path) -> None:
    wrong = {}
    for number, (text, (expected, said)) in enumerate(LEFT.items()):
        made, left = lesson(tmp_path / str(number), text)
        if made != expected + "\n" or left != [said]:
            wrong[text] = (made, left)
    assert wrong == {}


def test_camera_by_its_position_becomes_one_by_its_direction(tmp_path: Path) -> None:
    (tmp_path / "one.md").write_text(
        '```lab\n{"camera": {"azimuth": 120.5, "elevation": -0.5, "target": [1, 2, 3]}}\n```\n'
    )
    levels = [{"id": 1, "lessons": [{"id": "1.1", "file": "one.md", "title": "One"}]}]
    (tmp_path / "course.json").write_text(json.dumps({"levels": levels}))
    written = convert(tmp_path).files["content/lessons/1.1-one.md"].decode()
    assert '{"azimuth": -59.5, "elevation": 0.5, "target": [1, 2, 3]}' in written
