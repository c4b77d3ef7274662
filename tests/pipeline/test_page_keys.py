"""Keys of pages are remembered as long as all around the pages is as it was."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.core.checks.course import check_course
from coursebuild.core.engine.memo import Memo
from coursebuild.core.model import Course
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.load import load
from coursebuild.pipeline.page_index import PageKeys


def test_keys_are_remembered(tmp_path: Path) -> None:
    store = Memo(tmp_path)
    keys = PageKeys(store, "a" * 64)
    assert keys.get("index.html", "") is None
    keys.add("index.html", "", "k1")
    keys.add("lessons/é x.html", "d", "k2")
    keys.save()
    again = PageKeys(store, "a" * 64)
    assert again.get("index.html", "") == "k1"
    assert again.get("lessons/é x.html", "d") == "k2"
    assert again.get("lessons/é x.html", "e") is None  # its document was changed
    assert again.get("other.html", "") is None


def test_only_those_of_the_last_build_are_kept(tmp_path: Path) -> None:
    store = Memo(tmp_path)
    for number in range(3):
        keys = PageKeys(store, "a" * 64)
        keys.get("index.html", "")
        keys.add("lessons/a.html", f"d{number}", f"k{number}")
        keys.save()
    keys = PageKeys(store, "a" * 64)
    assert keys.get("lessons/a.html", "d1") is None
    assert keys.get("lessons/a.html", "d2") == "k2"


def test_where_something_around_changed_none_is_known(tmp_path: Path) -> None:
    keys = PageKeys(Memo(tmp_path), "a" * 64)
    keys.add("index.html", "", "k1")
    keys.save()
    assert PageKeys(Memo(tmp_path), "b" * 64).get("index.html", "") is None
    assert PageKeys(Memo(tmp_path), None).get("index.html", "") is None
    assert PageKeys(Memo(tmp_path, fresh=True), "a" * 64).get("index.html", "") is None
    assert PageKeys(Memo(tmp_path), "a" * 64).get("index.html", "") == "k1"


HEAD = '[course]\ntitle = "T"\n\n[[level]]\nid = "1"\ntitle = "One"\n'
LESSON = '\n[[level.lesson]]\nid = "{0}"\nslug = "l"\ntitle = "L {0}"\nstatus = "complete"\n'


def test_a_course_in_which_nothing_was_wrong_is_checked_again_when_it_looks_different(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[Course] = []

    def noted(course: Course) -> tuple[Diagnostic, ...]:
        calls.append(course)
        return check_course(course)

    def write(path: str, text: str) -> None:
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text, encoding="utf-8")

    def found() -> list[str]:
        with Documents(Memo(tmp_path), 1) as documents:
            given = documents.parse, documents.ahead, documents.course_map, documents.declarations
            loaded = load(tmp_path, *given, documents.check)
        return [diagnostic.rule for diagnostic in loaded.diagnostics]

    monkeypatch.setattr("coursebuild.core.checks.course.check_course", noted)
    write("content/course.toml", HEAD + LESSON.format("1.1") + LESSON.format("1.2"))
    write("content/lessons/1.1-l.md", "## A\n\nSee [b](lesson:1.2#b).\n")
    write("content/lessons/1.2-l.md", "## B\n\nWords.\n")
    assert (found(), len(calls)) == ([], 1)
    write("content/lessons/1.2-l.md", "Words before.\n\n## B\n\nOther words.\n")
    assert (found(), len(calls)) == ([], 1)
    write("content/lessons/1.2-l.md", "Words before.\n\n## C\n\nOther words.\n")
    assert (found(), len(calls)) == (["link-anchor"], 2)
    assert (found(), len(calls)) == (["link-anchor"], 3)  # what is wrong is found each time
    write("content/lessons/1.2-l.md", "## B\n\nWords.\n")
    assert found() == []
