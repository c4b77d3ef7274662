"""The whole course as a PDF: contents with numbers, an outline, and the same bytes each time."""

from __future__ import annotations

import shutil
from pathlib import Path

import pypdf
import pytest

from support.fixture_cases import fixture_text
from support.scratch_course import Folder

pytestmark = [pytest.mark.site, pytest.mark.browser]
LESSON = fixture_text("documents/printed.md")


@pytest.fixture
def course(tmp_path: Path, stores: Path) -> Folder:
    folder = Folder(tmp_path / "course")
    folder.fill([LESSON, "## More\n\nText.\n\n" * 60], stores)
    return folder


def test_contents_name_the_page_on_which_each_lesson_begins(course: Folder) -> None:
    course.main("export", "pdf").require_success()
    first = course.read("course.pdf")
    reader = pypdf.PdfReader(course.root / "course.pdf")
    texts = [page.extract_text() for page in reader.pages]
    lines = next(text for text in texts if "Contents" in text).split("\n")
    for lesson in ("Lesson one", "Lesson two"):
        [page] = [
            n for n, text in enumerate(texts, 1) if f"{lesson}\n" in text and "Contents" not in text
        ]
        assert str(page) in lines
    assert any("Table 1.1.1" in text for text in texts)
    assert any("What is folded." in text for text in texts)
    assert reader.outline
    assert reader.trailer["/Root"]["/MarkInfo"]["/Marked"]
    assert course.main("export", "pdf").status == 0, "an earlier export is replaced"
    assert course.read("course.pdf") == first


def test_an_author_may_leave_folds_closed(course: Folder) -> None:
    course.replace("content/course.toml", "[course]\n", '[course]\nfolds = "closed"\n')
    assert course.main("export", "page").status == 0
    page = course.text("course.html")
    assert '<details class="callout callout-derivation">' in page
    course.replace("content/course.toml", 'folds = "closed"\n', "")
    assert course.main("export", "page").status == 0
    assert '<details class="callout callout-derivation" open' in course.text("course.html")


def test_without_a_chromium_the_message_says_what_to_do(
    course: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHROME_PATH", "/nowhere/chromium")
    result = course.main("export", "pdf")
    assert result.status != 0
    assert "`/nowhere/chromium`, which CHROME_PATH names, is not a program" in result.err
    assert "install Chromium or Chrome" in result.err
    assert shutil.which("true")
    monkeypatch.setenv("CHROME_PATH", "true")
    result = course.main("export", "pdf")
    assert "did not print the course: its status is 0" in result.err
    assert not (course.root / "course.pdf").exists()
