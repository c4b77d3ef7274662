"""What learners take away: files in `examples/`, edits brought back, archives and notebooks."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat
import pytest

from coursebuild.core.model import Recording, document_blocks
from coursebuild.core.scripts.compare import compare
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from support.built_sites import BuiltCourses
from support.fixture_cases import fixture_tables, fixture_text
from support.scratch_course import GOOD, Folder, Make, block

TWO_SCRIPTS = "## Two\n\n" + block("a.py", "print('a')", "a") + block("sub/b.py", "print('b')", "b")
SHAPES = {
    "plain": "```python file=examples/x.py\nprint(1)\n```\n\nAfter.\n",
    "quote": "> ```python file=examples/x.py\n> print(1)\n> ```\n>\n> After.\n",
    "list": "1. item\n\n   ~~~python file=examples/x.py\n   print(1)\n   ~~~\n\n   After.\n",
    "indented": "  ```python file=examples/x.py\n  print(1)\n  ```\n\nAfter.\n",
    "deep": "> - item\n>\n>   ````python file=examples/x.py\n>   print(1)\n>   ````\n>\n> After.\n",
    "last": "```python file=examples/x.py\nprint(1)\n```",
}
EDITED_SCRIPT = (
    'def f():\n\t"""A text\n\n      with ``` inside\n    """\n'
    '\tif True:\n\t\treturn "ü"\n\n\n# end\n'
)


@pytest.mark.site
def test_files_are_written_once_and_removed_with_their_scripts(make: Make) -> None:
    folder = make(TWO_SCRIPTS)
    result = folder.main("extract")
    assert result.status == 0
    assert "wrote examples/a.py\nwrote examples/sub/b.py\n" in result.out
    assert folder.read("examples/a.py") == b"print('a')\n"
    times = {p: (folder.root / "examples" / p).stat().st_mtime_ns for p in folder.tree("examples")}
    for options in ((), ("--adopt",)):
        result = folder.main("extract", *options)
        assert (result.status, "every script is extracted already" in result.out) == (0, True)
    assert times == {p: (folder.root / "examples" / p).stat().st_mtime_ns for p in times}
    assert folder.text(folder.lesson()) == TWO_SCRIPTS
    folder.write("examples/mine.txt", "not extracted")
    folder.write(folder.lesson(), GOOD)
    result = folder.main("extract")
    assert result.status == 0
    assert "removed examples/sub/b.py, which no lesson has now" in result.out
    assert set(folder.tree("examples")) == {".extracted.json", "hello.py", "mine.txt"}
    assert not (folder.root / "examples/sub").exists()


# --- adopting


SAVED_SCRIPTS = (
    EDITED_SCRIPT,
    EDITED_SCRIPT.replace("\n", "\r\n"),
    "\ufeff" + EDITED_SCRIPT,
    EDITED_SCRIPT.rstrip("\n"),
    EDITED_SCRIPT + "\n\n",
)


@pytest.mark.site
def test_edit_is_adopted_into_a_block_of_every_shape(make: Make) -> None:
    """One lesson for each shape, with line ends of Windows."""
    newline = "\r\n"
    texts = [
        ("## One\n\n" + shape.replace("/x.py", f"/x{number}.py")).replace("\n", newline)
        for number, shape in enumerate(SHAPES.values(), 1)
    ]
    folder = make(*texts)
    for file in SAVED_SCRIPTS:
        for number, text in enumerate(texts, 1):
            folder.write(folder.lesson(number), text)
            (folder.root / f"examples/x{number}.py").unlink(missing_ok=True)
        assert folder.main("extract").status == 0
        for number in range(1, len(texts) + 1):
            folder.write(f"examples/x{number}.py", file)
        result = folder.main("extract", "--adopt").require_success()
        for number, (shape, text) in enumerate(zip(SHAPES, texts, strict=True), 1):
            before, _, after = text.partition("print(1)" + newline)
            lead = before.rpartition(newline)[2]
            body = [(lead + line if line else lead.rstrip()) for line in EDITED_SCRIPT.splitlines()]
            block_text = before[: len(before) - len(lead)] if lead else before
            whole = block_text + newline.join(body) + newline + after
            assert folder.text(folder.lesson(number)) == whole, (shape, file)
            assert folder.text(f"examples/x{number}.py") == EDITED_SCRIPT, (shape, file)
            assert f"updated {folder.lesson(number)}\n" in result.out, shape
        assert "every script is extracted already" in folder.main("extract", "--adopt").out


@pytest.mark.site
def test_several_edits_of_one_lesson_are_adopted_at_once(make: Make) -> None:
    folder = make(TWO_SCRIPTS + block("c.py", "print('c')", "c"), GOOD)
    folder.main("extract")
    folder.replace(folder.lesson(), "print('c')", "print('C')")  # an edit, which stays
    folder.write("examples/a.py", "print('a')\nprint('more')\n")
    folder.write("examples/sub/b.py", "# b\n\nprint('b')\n")
    assert folder.main("extract", "--adopt").status == 0
    adopted = TWO_SCRIPTS.replace("print('a')\n", "print('a')\nprint('more')\n").replace(
        "print('b')\n", "# b\n\nprint('b')\n"
    )
    assert folder.text(folder.lesson()) == adopted + block("c.py", "print('C')", "c")
    assert folder.read("examples/c.py") == b"print('C')\n"
    assert folder.main("check", "1.1").status == 1  # it does not print what is recorded
    assert folder.main("update", "1.1").status == 0
    assert folder.main("check").status == 0


@pytest.mark.site
def test_edit_that_a_block_cannot_hold_is_left_alone(make: Make) -> None:
    folder = make(TWO_SCRIPTS)
    folder.main("extract")
    for data, says in (
        (b"caf\xe9\n", "it is not UTF-8"),
        (b"\n\n", "it is empty"),
        (b"x = '''\n```\n'''\n", "one of its lines would close the fence, or begin another"),
        (b"a\0b\n", "it holds a NUL"),
    ):
        folder.write("examples/a.py", data)
        result = folder.main("extract", "--adopt")
        assert result.status == 1
        assert f"examples/a.py cannot be brought into the lesson: {says}" in result.out
        assert folder.read("examples/a.py") == data
        assert folder.text(folder.lesson()) == TWO_SCRIPTS


@pytest.mark.site
def test_of_two_edits_neither_is_lost(make: Make) -> None:
    folder = make(TWO_SCRIPTS)
    folder.main("extract")
    folder.write("examples/a.py", "print('a')  # by hand\n")
    folder.replace(folder.lesson(), "print('a')", "print('A')")
    lesson = folder.read(folder.lesson())
    for command in (["extract"], ["extract", "--adopt"], ["check"]):
        result = folder.main(*command)
        assert result.status == 1
        assert "-print('A')\n            +print('a')  # by hand\n" in result.out
        assert "the block was changed as well" in result.out
        assert "--adopt" not in result.out
        assert folder.read("examples/a.py") == b"print('a')  # by hand\n"
        assert folder.read(folder.lesson()) == lesson
    folder.replace(folder.lesson(), "print('A')", "print('A')  # by hand")
    (folder.root / "examples/a.py").unlink()
    assert folder.main("extract").status == 0


@pytest.mark.site
def test_a_read_only_example_is_adopted_and_settled(make: Make) -> None:
    """An example is derived from its lesson: it is replaced whatever its mode."""
    folder = make(TWO_SCRIPTS)
    folder.main("extract")
    folder.write("examples/a.py", b"print('edited')\r\n")
    (folder.root / "examples/a.py").chmod(0o444)
    assert folder.main("extract", "--adopt").status == 0
    assert "print('edited')\n" in folder.text(folder.lesson())
    assert folder.read("examples/a.py") == b"print('edited')\n"
    assert "every script is extracted already" in folder.main("extract").out


# --- diverged simulations

MODEL = """
<mujoco model="cart">
  <worldbody><body><joint type="slide" axis="1 0 0"/><geom size="1" mass="1"/></body></worldbody>
</mujoco>
"""
DIVERGING_SCRIPT = fixture_text("scripts/diverging.txt")


@pytest.mark.site
def test_lost_simulation_fails_every_command_unless_its_lesson_says_so(make: Make) -> None:
    def lesson(force: str, info: str = "", output: str = "error 0.0") -> str:
        return "## One\n\n" + block(
            "a.py", DIVERGING_SCRIPT.replace("1e15", force), output, info=info
        )

    def rules() -> list[str]:
        report = json.loads(folder.main("check", "--format", "json").out)
        return [diagnostic["rule"] for diagnostic in report["diagnostics"]]

    folder = make(lesson("1e15"))
    first, again = folder.main("check"), folder.main("check")
    assert (first.status, again.status, "cached" in again.out) == (1, 1, True)
    assert "MuJoCo warned of bad accelerations of model `cart` at t = 0.0000 s" in first.out
    assert "diverged examples/a.py" in first.out
    assert first.out.split("\n\n")[0] == again.out.split("\n\n")[0]
    report = json.loads(folder.main("check", "--format", "json").out)
    assert [script["status"] for script in report["scripts"]] == ["diverged"]
    assert '<failure type="diverged"' in folder.main("check", "--format", "junit").out
    assert folder.main("build").status == 1
    assert not (folder.root / "public").exists()
    assert not list(folder.root.rglob("MUJOCO_LOG*"))
    folder.write(folder.lesson(), lesson("1e15", output="error 1.0"))
    result = folder.main("update")
    assert (result.status, "error[script-diverged]" in result.out) == (1, True)
    for text, expected in (
        (lesson("1e15"), ["script-diverged"]),
        (lesson("1e15", "diverges"), []),  # from the store
        (lesson("0.0", "diverges"), ["script-stable"]),
        (lesson("0.0"), []),
    ):
        folder.write(folder.lesson(), text)
        assert rules() == expected


CODE = """from mjcourse import OWN
from pkg.part import word

print(OWN, word())
"""
FILES = fixture_tables("extracted_files")["files"]


@pytest.mark.site
def test_unpacked_archive_runs_with_the_packages_of_the_course(make: Make, tmp_path: Path) -> None:
    folder = make("## A\n\n" + block("a.py", CODE, "True swing."))
    folder.replace("content/course.toml", "[course]\n", '[course]\npackages = ["src", "lib"]\n')
    for path, text in FILES.items():
        folder.write(path, text)
    folder.run("build").require_success()
    for name in ("examples.zip", "lessons/1.1-one.zip"):
        with zipfile.ZipFile(folder.root / "public" / name) as archive:
            archive.extractall(tmp_path / name)
            assert not [
                name_in_archive
                for name_in_archive in archive.namelist()
                if "other" in name_in_archive
            ]
        (top,) = (tmp_path / name).iterdir()
        assert (top / "requirements.txt").read_text() == ""
        command = [sys.executable, "-S", "examples/a.py"]
        result = subprocess.run(command, cwd=top, capture_output=True, text=True, check=False)
        assert (result.stdout, result.stderr) == ("True swing.\n", "")
    folder.write("src/pkg/word.txt", "turn")
    assert "differs from this run" in folder.run("check").out


COURSES = ("full", "unicode", "real")


def notebook_client(notebook: Any, **options: Any) -> Any:
    from nbclient import NotebookClient  # takes a second, even for collecting this file

    return NotebookClient(notebook, **options)


def notebooks(folder: Folder) -> Iterator[Path]:
    return iter(sorted((folder.root / "public" / "lessons").glob("*.ipynb")))


@pytest.mark.slow
@pytest.mark.parametrize("name", COURSES)
def test_notebooks_of_course_are_valid(built_courses: BuiltCourses, name: str) -> None:
    paths = list(notebooks(built_courses[name]))
    assert paths
    for path in paths:
        nbformat.validate(nbformat.read(path, as_version=4))
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert len({cell["id"] for cell in cells}) == len(cells)


@pytest.mark.slow
@pytest.mark.parametrize("name", COURSES)
@pytest.mark.filterwarnings("ignore")
def test_notebooks_of_course_run_in_an_empty_folder(
    built_courses: BuiltCourses, name: str, tmp_path: Path
) -> None:
    folder = built_courses[name]
    course = parse_course_map(
        Source("content/course.toml", folder.text("content/course.toml"))
    ).value
    assert course is not None
    callouts = course.callout_names
    compared = 0
    for number, path in enumerate(notebooks(folder)):
        printed = executed(path, tmp_path / f"{number}")
        text = folder.read(f"content/lessons/{path.stem}.md").decode()
        document = parse_document(Source("a.md", text), callouts, lesson=True).value
        for recording in document_blocks(document):
            if isinstance(recording, Recording) and recording.script in printed:
                comparison = course.comparison_of(recording)
                verdict = compare(recording, comparison, printed[recording.script])
                assert verdict.status in ("verified", "volatile"), verdict.changes
                compared += 1
    assert compared >= (2 if name != "unicode" else 1)


def executed(path: Path, folder: Path) -> dict[str, str]:
    """Run a notebook from top to bottom in an empty folder; return what its scripts printed."""
    folder.mkdir()
    notebook = nbformat.read(path, as_version=4)
    client = notebook_client(
        notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    )
    client.execute()
    printed: dict[str, str] = {}
    for cell in notebook.cells:
        if cell.cell_type == "code" and cell.source.startswith("%%example"):
            script = re.search(r"examples/\S+\.py", cell.source.split("\n")[0])
            assert script is not None
            out = "".join(o.text for o in cell.outputs if o.get("name") == "stdout")
            if "is not run" not in out and "--norun" not in cell.source.split("\n")[0]:
                printed[script[0]] = out
    return printed


TWO_SECTIONS = fixture_text("documents/two_sections.md")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_notebook_brings_the_modules_its_scripts_import(make: Make, tmp_path: Path) -> None:
    folder = make(TWO_SECTIONS, "## Else\n\n" + block("elsewhere.py", "y = 2"))
    assert folder.main("build", "--quiet").status == 0
    path = folder.root / "public" / "lessons" / "1.1-one.ipynb"
    assert executed(path, tmp_path / "empty") == {
        "examples/first.py": "1 2\n",
        "examples/later.py": "",
    }
    # A file that the learner has changed is left alone, and an edit of a cell counts.
    notebook = nbformat.read(path, as_version=4)
    place = tmp_path / "edited"
    (place / "examples").mkdir(parents=True)
    (place / "examples" / "elsewhere.py").write_text("y = 5\n")
    for cell in notebook.cells:
        if "later.py" in cell.source.split("\n")[0] and cell.cell_type == "code":
            cell.source = cell.source.replace("x = 1", "x = 7")
    edited_notebook = tmp_path / "changed.ipynb"
    nbformat.write(notebook, edited_notebook)
    notebook.cells.append(
        nbformat.v4.new_code_cell("%%example examples/again.py\nfrom first import *")
    )
    nbformat.write(notebook, edited_notebook)
    client = notebook_client(
        notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(place)}}
    )
    client.execute()
    texts = [
        "".join(o.get("text", "") for o in c.outputs)
        for c in notebook.cells
        if c.cell_type == "code"
    ]
    assert any("elsewhere.py is there and is another" in text for text in texts)
    assert texts[-1] == "7 5\n"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_failing_script_stops_its_notebook(make: Make, tmp_path: Path) -> None:
    folder = make(TWO_SECTIONS, "## Else\n\n" + block("elsewhere.py", "y = 2"))
    assert folder.main("build", "--quiet").status == 0
    notebook = nbformat.read(folder.root / "public" / "lessons" / "1.1-one.ipynb", as_version=4)
    for cell in notebook.cells:
        cell.source = cell.source.replace("%%example --norun", "%%example")
    client = notebook_client(
        notebook,
        timeout=300,
        kernel_name="python3",
        resources={"metadata": {"path": str(tmp_path)}},
    )
    with pytest.raises(Exception, match=r"examples/fails.py ended with status 3"):
        client.execute()
