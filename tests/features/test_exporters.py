"""`coursebuild export`: what a feature of the course can write, and where it may be written."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.archives import entries
from support.fixture_cases import fixture_text
from support.markdown_files import DOCS, fences
from support.scratch_course import GOOD, Folder

pytestmark = pytest.mark.site

MAP = "content/course.toml"


@pytest.fixture
def course(tmp_path: Path, stores: Path) -> Folder:
    page = fences(DOCS / "how-to/features.md")
    [code] = (fence.text for fence in page if "Exporter(" in fence.text)
    folder = Folder(tmp_path / "a course")
    folder.fill([GOOD, "## Two\n\nText.\n"], stores)
    folder.write("features/lessons.py", code)
    folder.replace(MAP, "[course]\n", '[course]\nfeatures = ["features/lessons.py"]\n')
    folder.replace(MAP, 'title = "Lesson two"', "title = 'Two, \"quoted\"'")
    return folder


def test_example_of_the_docs_writes_the_lessons_as_a_table(course: Folder) -> None:
    result = course.main("export", "lessons").require_success()
    assert "wrote lessons.csv, 0.1 kB" in result.out
    table = 'id,title,scripts\r\n1.1,Lesson one,1\r\n1.2,"Two, ""quoted""",0\r\n'
    assert course.read("lessons.csv") == table.encode()
    course.replace(MAP, "Lesson one", "One")
    assert course.main("export", "lessons").status == 0, "an earlier export is replaced"
    assert b"1.1,One,1" in course.read("lessons.csv")


def test_exporter_may_pack_files_draw_documents_warn_and_find_its_blocks(course: Folder) -> None:
    course.write(
        "features/lessons.py",
        fixture_text("scripts/exporter_feature.txt"),
    )
    course.write("content/lessons/1.2-two.md", "## Two\n\n```note\nmine\n```\n")
    result = course.main("export", "bare", "--out", "sub/b.zip")
    assert result.status == 0 and "wrote 6 files to sub/b.zip" in result.out, (
        result.out + result.err
    )
    assert result.out.count("warning[bare]") == 2
    package = entries(course.root / "sub/b.zip")
    assert package["1.2.txt"] == b"mine\n" and b'<h2 id="hello">Hello' in package["1.1.html"]


def test_export_is_refused_where_it_would_be_in_the_way(course: Folder) -> None:
    course.write("notes.txt", "mine")
    course.write("mine.zip", b"PK\x05\x06" + bytes(18))
    course.write("public/.coursebuild-site", "{}")
    for name, out, reason in (
        ("lessons", "models/q.csv", "lies in models/ of the project, which cannot hold an export"),
        ("lessons", "notes.txt", "notes.txt exists and is not such an export"),
        ("epub", "notes.txt", "notes.txt exists and is not such an export"),
        ("page", "notes.txt", "notes.txt exists and is not such an export"),
        ("scorm", "mine.zip", "mine.zip exists and is not such an export"),
        ("lessons", ".", "is a folder"),
        ("lessons", "public/q.csv", "lies in a published site, which the next build replaces"),
    ):
        result = course.main("export", name, "--out", out)
        assert (result.status, reason in result.err) == (2, True), (name, out, result.err)
    assert course.text("notes.txt") == "mine"


def test_unknown_and_broken_exporters_are_reported(course: Folder) -> None:
    result = course.main("export", "docx")
    offers = "epub, lessons, page, pdf, qti, scorm, slides"
    assert result.status == 2
    assert result.err == f"coursebuild: there is no export `docx`: choose from {offers}\n"
    course.replace("features/lessons.py", 'Feature(name="lessons"', 'Feature(name="scorm"')
    result = course.main("export", "docx")
    assert "features/lessons.py: two features are called `scorm`" in result.err
    course.replace("features/lessons.py", 'Feature(name="scorm"', 'Feature(name="own"')
    course.replace("features/lessons.py", 'name="lessons",\n', 'name="scorm",\n')
    assert "there is already an export `scorm`" in course.main("check").out
    usage = course.main("export", "--help").out
    assert "scorm (the course as SCORM 1.2)" in " ".join(usage.split())


def test_nothing_is_written_where_something_is_wrong_or_there_is_nothing(course: Folder) -> None:
    result = course.main("export", "qti")
    assert (result.status, result.err.splitlines()[-1]) == (
        1, "coursebuild: the course has nothing that `export qti` could write"
    )  # fmt: skip
    assert course.main("export", "lessons").status == 0
    first_export = course.read("lessons.csv")
    course.replace(course.lesson(), "hello 3.14159\n", "hello 3.14158\n")
    result = course.main("export", "lessons")
    assert result.status == 1 and "nothing was written" in result.out
    assert course.read("lessons.csv") == first_export


def test_full_disk_leaves_the_earlier_export(
    course: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert course.main("export", "scorm").status == 0
    first_export = course.read("course-scorm.zip")

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("zipfile.ZipFile.writestr", full)
    result = course.main("export", "scorm")
    assert result.status == 1 and "cannot be written: no space left on device" in result.err
    assert course.read("course-scorm.zip") == first_export
    assert not [name for name in course.entries() if name.startswith(".course-scorm.zip")]


@pytest.mark.engine
@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "name"), [("qti", "quizzes-qti.zip"), ("scorm", "course-scorm.zip")]
)
def test_same_course_gives_the_same_package(
    kind: str, name: str, request: pytest.FixtureRequest
) -> None:
    folder = request.getfixturevalue(kind).folder
    first_export = folder.read(name)
    for options in ((), ("--no-cache", "--jobs", "1")):
        folder.main("export", kind, *options, "--out", "sub/other.zip").require_success()
        assert folder.read("sub/other.zip") == first_export, options
