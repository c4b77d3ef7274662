"""Notebooks of a built course are valid, and run from top to bottom in an empty folder."""

from __future__ import annotations

import json
import re
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
from support.scratch_course import Folder, Make, block

pytestmark = pytest.mark.slow

COURSES = ("full", "unicode", "real")


def notebook_client(notebook: Any, **options: Any) -> Any:
    from nbclient import NotebookClient  # takes a second, even for collecting this file

    return NotebookClient(notebook, **options)


def notebooks(folder: Folder) -> Iterator[Path]:
    return iter(sorted((folder.root / "public" / "lessons").glob("*.ipynb")))


@pytest.mark.parametrize("name", COURSES)
def test_notebooks_of_course_are_valid(built_courses: BuiltCourses, name: str) -> None:
    paths = list(notebooks(built_courses[name]))
    assert paths
    for path in paths:
        nbformat.validate(nbformat.read(path, as_version=4))
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert len({cell["id"] for cell in cells}) == len(cells)


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


TWO_SECTIONS = (
    "## Uses\n\n"
    + block("first.py", "import later\nimport elsewhere\nprint(later.x, elsewhere.y)", "1 2")
    + "## Later\n\n"
    + block("later.py", "x = 1\nif __name__ == '__main__':\n    import sys\n    sys.exit(0)")
    + block(
        "fails.py",
        "import sys\nprint('out')\nprint('err', file=sys.stderr)\nsys.exit(3)",
        info="norun",
    )
)


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
