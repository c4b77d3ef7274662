"""`coursebuild import`: courses of five kinds, and folders that cannot be imported.

A case is a folder beside this file with `source/`, a course of another tool, and `expected/`: what
an author finds in the new one, with the report in `report.txt`. The case `markup` holds what
several dialects write alike. `pytest --rewrite-fixtures` writes `expected/`.
"""

from __future__ import annotations

import json
import os
import shutil
import socket
from pathlib import Path

import pytest

from coursebuild.cli import main
from support.model_files import png
from support.sandboxes import require_sandbox

HERE = Path(__file__).parent
CASES = sorted(path.parent.name for path in HERE.glob("*/source"))
GENERATED = ("public", "examples", ".coursebuild")


def texts(folder: Path) -> dict[str, bytes]:
    """Files by path; of a figure that a cell drew, only that it is there."""
    paths = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {
        name.as_posix(): b"" if name.match("lessons/*.svg") else (folder / name).read_bytes()
        for name in (path.relative_to(folder) for path in paths)
        if name.parts[0] not in GENERATED
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
    assert main(["import", str(source), "--prove"]) == 0
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


@pytest.fixture
def cwd(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which the tool is called."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def import_refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["import", *arguments]) == 2
    return capsys.readouterr().err


def test_folder_that_cannot_be_imported_is_refused(
    cwd: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    course = cwd / "old"
    stderr = import_refused(capsys, "old")
    assert stderr == "coursebuild: there is no folder or file old\n"
    course.mkdir()
    stderr = import_refused(capsys, "old")
    empty_message = "there is nothing to import: no course.json, no notebook and no Markdown file"
    assert stderr == f"coursebuild: {empty_message}\n"
    for name, text, message in [
        (
            "course.json",
            "{",
            "course.json is not JSON: Expecting property name enclosed in double "
            "quotes: line 1 column 2 (char 1)",
        ),
        ("course.json", "[" * 100_000, "course.json is not JSON: the text is nested too deeply"),
        ("course.json", '{"levels": []}', "course.json has no `levels`"),
        ("course.json", '{"levels": [7]}', "course.json: a level or a lesson is not an object"),
        ("one.ipynb", '{"cells": 7}', "one.ipynb is not a notebook of format 4"),
        ("one.ipynb", '{"cells": [7]}', "one.ipynb is not a notebook of format 4"),
        ("_toc.yml", "a: [", "_toc.yml is not YAML, or too large"),
        ("_toc.yml", "chapters: &a [*a]", "_toc.yml is not YAML, or too large"),
        ("_quarto.yml", "book: 7\nwebsite: [x]", empty_message),
    ]:
        (course / name).write_text(text)
        assert import_refused(capsys, "old") == f"coursebuild: {message}\n", name
        (course / name).unlink()
    (course / "one.md").write_bytes(b"\xff")
    assert import_refused(capsys, "old") == "coursebuild: one.md is not UTF-8\n"
    assert sorted(path.name for path in cwd.iterdir()) == ["old"]


def test_nothing_is_written_over_nor_left_by_an_import_that_fails(
    cwd: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (cwd / "old").mkdir()
    (cwd / "old" / "one.md").write_text("# One\n\nText.\n")
    message_inside = "is in the folder that is imported, which is only read"
    for out in ("old", "old/new"):
        assert f"{message_inside}\n" in import_refused(capsys, "old", "--out", out)
    (cwd / "there" / "content").mkdir(parents=True)
    (cwd / "there" / "content" / "course.toml").write_text("mine")
    message = import_refused(capsys, "old", "--out", "there")
    reason = "already has content/course.toml; name an empty folder with --out"
    assert message == f"coursebuild: {cwd / 'there'} {reason}\n"
    assert texts(cwd / "there") == {"content/course.toml": b"mine"}
    (cwd / "file").mkdir()
    (cwd / "file" / "content").write_text("mine")
    assert main(["import", "old", "--out", "file"]) == 1
    assert "content" in capsys.readouterr().err
    assert texts(cwd / "file") == {"content": b"mine"}


OUT = "a link leads out of the folder, and nothing behind it is read"


def test_no_link_is_followed_out_of_the_folder(
    cwd: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each is named with its reason; those to what is imported itself are followed."""
    (cwd / "secrets" / "models").mkdir(parents=True)
    for name in ("a.md", "a.png", "a.xml", "models/b.xml"):
        (cwd / "secrets" / name).write_text("# SECRET <mujoco/>")
    old = cwd / "old"
    for folder in ("part/inner", "models", "figures"):
        (old / folder).mkdir(parents=True)
    (old / "figures" / "in.png").write_bytes(b"\x89PNG")
    (old / ".hidden").write_text("SECRET")
    (old / "part" / "one.md").write_text(
        "# One\n\n![a](out.png) ![b](far/a.png) ![c](fig/in.png) [d](hidden.txt) [e](../up/a.md)\n"
    )
    links = {
        "_toc.yml": "../secrets/a.md",
        "course.json": cwd / "secrets" / "a.md",
        "far": "../secrets",
        "gone.md": "not-there.md",
        "loop.md": "pool.md",
        "models/a.xml": "../../secrets/a.xml",
        "models/more": "../../secrets/models",
        "part/chain.md": "inner/out.md",
        "part/far": "../far",
        "part/fig": "../figures",
        "part/hidden.txt": "../.hidden",
        "part/inner/out.md": "../../../secrets/a.md",
        "part/out.png": "../../secrets/a.png",
        "part/self": "..",
        "part/two.md": "one.md",
        "pool.md": "loop.md",
        "up": "..",
    }
    for name, target in links.items():
        (old / name).symlink_to(target)
    os.mkfifo(old / "pipe.md")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(old / "socket.md"))
    (old / "part" / "pipe.md").symlink_to("../pipe.md")
    assert main(["import", "old", "--out", "new"]) == 0
    files = texts(cwd / "new")
    assert not [path for path, data in files.items() if b"SECRET" in data]
    assert [path for path in files if path.startswith(("content/files/", "models/"))] == [
        "content/files/figures/in.png"
    ]
    lesson = files["content/lessons/1.1-one.md"]
    assert (
        lesson == files["content/lessons/1.2-two.md"] == b"a b ![c](../files/figures/in.png) d e\n"
    )
    report = capsys.readouterr().out
    assert report.count(OUT) == 1
    assert "left: 9 more like this: course.json; far; models/a.xml; …\n" in report
    account = files["IMPORT.md"].decode().partition("## Left")[2].partition("## Words")[0]
    left = {
        place: message
        for message, *places in (
            part.split("\n  - ") for part in account.rstrip().split("\n- ")[1:]
        )
        for place in map(str.strip, places)
        if ", line" not in place
    }
    followed = {"part/fig", "part/self", "part/two.md"}
    reasons = {name: OUT for name in links if name not in followed}
    reasons |= dict.fromkeys(("gone.md", "loop.md", "pool.md"), "a broken link")
    reasons |= dict.fromkeys(("part/hidden.txt", "part/pipe.md"), "a link to what is not imported")
    reasons |= dict.fromkeys(
        ("pipe.md", "socket.md"), "a pipe, socket or device, which is not read"
    )
    assert left == reasons


def test_folder_of_links_alone_says_why_nothing_is_imported(
    cwd: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (cwd / "old").mkdir()
    (cwd / "old" / "one.md").symlink_to("/etc/passwd")
    assert import_refused(capsys, "old").endswith(f"Markdown file; one.md: {OUT}\n")


def notebook(*cells: dict[str, object]) -> str:
    return json.dumps({"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 5})


def test_single_file_is_imported_with_what_it_names(
    cwd: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing else in its folder is read, and no picture in it is written where its name says."""
    for name in ("other.md", "model.xml", "img/y.png", ".env", "README.md"):
        (cwd / name).parent.mkdir(exist_ok=True)
        (cwd / name).write_text("# Read me\n\nA `<mujoco/>`\n")
    (cwd / "img" / "x.png").write_bytes(png())
    (cwd / "img" / "out.png").symlink_to("/etc/passwd")
    (cwd / "linked.ipynb").symlink_to("beats.ipynb")
    text = (
        "# Beats\n\n![x](img/x.png) ![o](img/out.png) [e](.env) ![a](attachment:../../../../a.png)"
        " ![b](data:image/png;base64,é)"
    )
    attachments = {"../../../../a.png": {"image/png": "iVBORw0KGgo="}}
    cell = {"cell_type": "markdown", "source": text, "attachments": attachments}
    (cwd / "beats.ipynb").write_text(notebook(cell))
    assert main(["import", "linked.ipynb"]) == 0
    assert f"left: img/out.png: {OUT}\n" in capsys.readouterr().out
    files = texts(cwd / "beats")
    assert sorted(files) == [
        ".gitignore",
        "IMPORT.md",
        "content/course.toml",
        "content/files/beats/67dd0b7d.png",
        "content/files/img/x.png",
        "content/lessons/1.1-beats.md",
    ]
    assert main(["import", "README.md"]) == 0
    assert "content/lessons/1.1-readme.md" in texts(cwd / "README")
    extensions = ".md, .qmd, .ipynb, .mdx, .myst, .markdown or .Rmd"
    message = f"model.xml is neither a folder nor a file with the extension {extensions}; "
    assert message in import_refused(capsys, "model.xml")


@pytest.mark.site
def test_cells_of_strangers_run_in_the_sandbox_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    escape = tmp_path / "escape"
    cell = {"cell_type": "code", "source": f"open({str(escape)!r}, 'w')", "outputs": []}
    (tmp_path / "one.ipynb").write_text(notebook(cell))
    with monkeypatch.context() as context:
        context.setenv("PATH", str(tmp_path))
        assert main(["import", "one.ipynb", "--sandbox"]) == 1
    assert "`--sandbox` needs Bubblewrap" in capsys.readouterr().err
    assert not (tmp_path / "one").exists() and not escape.exists()
    require_sandbox(tmp_path)
    assert main(["import", "one.ipynb", "--sandbox", "--prove"]) == 0
    assert (tmp_path / "one" / "examples" / "l1_1_one.py").exists() and not escape.exists()
    assert main(["import", "one.ipynb", "--out", "trusted"]) == 0 and not escape.exists()
    assert main(["-C", "trusted", "import", "--prove"]) == 0 and escape.exists()


def imported(folder: Path, **files: str) -> str:
    """The only lesson that comes of files, by their names, in which `_` stands for a dot."""
    (folder / "source").mkdir()
    for name, text in files.items():
        (folder / "source" / name.replace("_", ".")).write_text(text)
    main(["import", str(folder / "source"), "--out", str(folder / "new")])
    (lesson,) = (folder / "new/content/lessons").iterdir()
    return lesson.read_text()


@pytest.mark.parametrize("opening", ["::: {.callout-tip}\n", "````{note}\n"])
def test_blocks_that_nest_too_deep_are_shown_as_they_were_written(
    tmp_path: Path, opening: str
) -> None:
    lesson = imported(tmp_path, a_md="# A\n\n" + opening * 1500 + "x\n")
    assert lesson.count(opening.split()[0]) > 1000


@pytest.mark.site
@pytest.mark.parametrize(
    ("name", "again"),
    [("book.toml", "{{#include a.md}}\n"), ("refs.bib", "```{include} a.md\n```\n\n")],
)
def test_text_that_includes_itself_again_and_again_ends(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, again: str
) -> None:
    lesson = imported(tmp_path, **{name: "", "a_md": "# A\n\nwords\n\n" + again * 10})
    assert "the lesson would include too much text" in capsys.readouterr().out
    assert 100 < lesson.count("words") < 4000


def test_lines_that_are_included_again_and_again_end(tmp_path: Path) -> None:
    lines = ",".join(["1-"] * 5000)
    text = f"# A\n\n```{{literalinclude}} b.py\n:lines: {lines}\n```\n"
    lesson = imported(tmp_path, a_md=text, b_py="x = 1\n" * 20_000)
    assert 100_000 <= lesson.count("x = 1") < 120_001


def test_folders_in_folders_are_left_with_a_word(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "source"
    deep = source / "docs" / "/".join("a" * 400)
    deep.mkdir(parents=True)
    (source / "docusaurus.config.js").write_text("module.exports = {title: 'T'}")
    (deep / "x.md").write_text("# X\n\nWords.\n")
    (source / "docs/y.md").write_text("# Y\n\nWords.\n")
    assert main(["import", str(source), "--out", str(tmp_path / "new")]) == 0
    assert "a folder in 100 others, which is not read" in capsys.readouterr().out
