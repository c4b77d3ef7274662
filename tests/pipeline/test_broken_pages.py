"""Pages of documents with mistakes, as a preview shows them: whole, with a mark at each mistake."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path

import pytest

from coursebuild.preview.session import Session, is_marked
from support.fixture_cases import FIXTURES, read_cases
from support.preview_process import serve_preview
from support.rule_cases import FIRST, parts
from support.scratch_course import GOOD, Folder, Make

pytestmark = pytest.mark.site

COURSES = 8


def broken_texts() -> Iterator[tuple[str, str]]:
    """The lessons of all cases of rules, with their titles."""
    for path in sorted((FIXTURES / "rules").glob("*.md")):
        for case in read_cases(path):
            for kind, name, text in parts(case.input):
                if (kind, name) == ("", FIRST):
                    yield f"{path.name}: {case.title}", text


def text_of(html: str) -> str:
    return unescape(re.sub(r"<[^>]*>", "", html))


def test_every_mistake_of_a_document_leaves_its_page_readable(tmp_path: Path) -> None:
    cases = [*broken_texts()]
    assert len(cases) > 300
    offenders = []
    for number in range(COURSES):  # each page lists all lessons of its course
        offenders += unreadable(Folder(tmp_path / f"{number}"), cases[number::COURSES])
    assert offenders == []


def unreadable(folder: Folder, cases: list[tuple[str, str]]) -> list[tuple[str, object, object]]:
    """The cases whose pages lack a mark, or the end of their text."""
    lessons = []
    for number, (_, text) in enumerate(cases, 1):
        folder.write(f"content/lessons/1.{number}-x{number}.md", f"{text}\n\nThe end of it.\n")
        lesson = {"id": f"1.{number}", "slug": f"x{number}", "title": "X", "status": "complete"}
        table = "".join(f'{key} = "{value}"\n' for key, value in lesson.items())
        lessons.append(f"[[level.lesson]]\n{table}")
    head = '[course]\ntitle = "Broken"\n\n[[level]]\nid = "1"\ntitle = "L"\n\n'
    folder.write("content/course.toml", head + "\n".join(lessons))
    session = Session(folder.options())
    session.start()
    try:
        assert session.course is not None
        offenders: list[tuple[str, object, object]] = []
        for owner, (title, _) in zip(session.course.lessons, cases, strict=True):
            assert owner.document is not None, title
            page = session.find(f"lessons/{owner.id}-x{owner.id[2:]}.html")
            html = "" if page is None else page.decode()
            marks = re.findall(r'id="mistake:(\d+)"', html)
            diagnostics = [d for d in session.diagnostics() if is_marked(d, owner.document)]
            has_error = any(d.is_error for d in diagnostics)
            places = {d.span.start for d in diagnostics if has_error}
            if sorted(map(int, marks)) != sorted(places) or "The end of it." not in text_of(html):
                offenders.append((title, sorted(marks), sorted(places)))
        return offenders
    finally:
        session.close()


def test_a_file_that_cannot_be_read_is_replaced_by_its_message(make: Make) -> None:
    folder = make(GOOD, "## Two\n\nText.\n")
    with serve_preview(folder) as preview:
        preview.wait_for_line("checked: everything holds")
        path = folder.root / folder.lesson(2)
        path.unlink()
        path.mkdir()
        preview.wait_for_line("error[file-unreadable]")
        status, _, body = preview.get("/lessons/1.2-two.html")
        assert (status, folder.lesson(2).encode() in body) == (200, True), body
        assert b"hello" in preview.get("/lessons/1.1-one.html")[2]
