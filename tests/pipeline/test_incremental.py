"""An incremental build draws only what has changed."""

from __future__ import annotations

import os
import pickle
import shutil

import msgspec
import pytest

from coursebuild.core.engine.memo import Memo, sealed
from support.edited_course import LESSON, NORUN, QUIZ, Course, drawn
from support.edited_course import course as course

pytestmark = pytest.mark.site

SERVED = ("chapters", "chapters-noted", "compressed", "fonts", "published", "search", "unchanged")
"""Kinds of entries that are bytes of the site, or none of the memo's."""


class Trap:
    """Ends the process when it is unpickled."""

    def __reduce__(self) -> object:
        return os._exit, (70,)


def lesson(id: str) -> str:
    return f"lessons/{id}-l{id.replace('.', '')}.html"


def test_nothing_changed_draws_nothing(course: Course) -> None:
    assert drawn(course.folder) == set()


def test_a_touched_or_rewritten_file_draws_nothing(course: Course) -> None:
    for path in (course.folder.root / "content").rglob("*"):
        if path.is_file():
            path.write_bytes(path.read_bytes())
    assert drawn(course.folder) == set()


def test_prose_draws_its_page(course: Course) -> None:
    course.edit("1.2", "Prose", "Other prose")
    assert drawn(course.folder) == {lesson("1.2")}
    course.edit("1.2", "Other prose", "Prose")
    assert drawn(course.folder) == set(), "what was there before is known"


@pytest.mark.parametrize(
    "edit",
    [
        ("[^n]: A note.", "[^n]: A note.\n\n## Second"),
        ("print(2)", "print(22)"),
        ("A note.", "Another note."),
        ("Remark", "Other"),
    ],
)
def test_what_only_the_page_shows_draws_only_the_page(
    course: Course, edit: tuple[str, str]
) -> None:
    course.edit("1.2", *edit)
    assert drawn(course.folder) == {lesson("1.2")}


@pytest.mark.parametrize(
    "edit", [("$x_2$", "$y$"), ("$x_2$", '$x_2${symbol="place"}'), ("First", "Second")]
)
def test_a_symbol_draws_the_index_as_well(course: Course, edit: tuple[str, str]) -> None:
    course.edit("1.2", *edit)
    assert drawn(course.folder) == {lesson("1.2"), "symbols/index.html"}


def test_a_link_draws_the_lesson_that_it_leads_to(course: Course) -> None:
    course.edit("1.3", "Prose", "See [this](lesson:1.1). Prose")
    assert drawn(course.folder) == {lesson("1.3"), lesson("1.1")}
    course.edit("1.3", "See [this]", "Look at [this](lesson:1.1) or [that]")
    assert drawn(course.folder) == {lesson("1.3")}, "who refers to it is as it was"
    course.write("1.3", LESSON.format(n=3, next="2.1", script=NORUN.format(n=3)))
    assert drawn(course.folder) == set(), "what was there before is known"


def test_a_term_draws_the_glossary_and_who_uses_it(course: Course) -> None:
    glossary = "glossary/index.html"
    course.edit("1.1", "Prose", "A [thing]{term} is one.\n\nProse")
    # The index of symbols leads to the glossary, which was not there.
    assert drawn(course.folder) == {lesson("1.1"), glossary, "symbols/index.html"}
    course.edit("1.2", "Prose", "See [it](term:thing). Prose")
    assert drawn(course.folder) == {lesson("1.2"), glossary}
    course.edit("1.1", "Prose", "Other prose")
    assert drawn(course.folder) == {lesson("1.1")}
    course.edit("1.1", "is one", "is none")
    assert drawn(course.folder) == {lesson("1.1"), glossary}
    course.edit("1.1", "[thing]{term}", "thing")
    course.edit("1.3", "Prose", "A [thing]{term} is one.\n\nProse")
    assert drawn(course.folder) == {lesson("1.1"), lesson("1.2"), lesson("1.3"), glossary}


def test_the_number_of_a_formula_draws_who_refers_to_it(course: Course) -> None:
    course.edit("1.1", "= 1\n$$", "= 1\n$$ {#eq:one}")
    course.edit("1.2", "Prose", "By [](lesson:1.1#eq:one). Prose")
    assert drawn(course.folder) == {lesson("1.1"), lesson("1.2")}
    course.edit("1.1", "Prose", "$$\nE = 1\n$$ {#eq:zero}\n\nProse")
    assert drawn(course.folder) == {lesson("1.1"), lesson("1.2")}
    course.edit("1.1", "E = 1\n$$ {#eq:one}", "E = 11\n$$ {#eq:one}")
    assert drawn(course.folder) == {lesson("1.1")}


def test_a_question_draws_the_lists_of_lessons(course: Course) -> None:
    course.edit("1.2", "Prose", QUIZ + "Prose")
    lists = {"index.html", "levels/1.html", "progress/index.html", "review/index.html"}
    assert drawn(course.folder) == {lesson("1.2"), *lists}
    course.edit("1.2", "Why?", "Why not?")
    assert drawn(course.folder) == {lesson("1.2")}, "its key is the same"
    course.edit("1.2", '"why"', '"why-not"')
    assert drawn(course.folder) == {lesson("1.2"), *lists}


def test_a_title_draws_all_that_name_it(course: Course) -> None:
    course.titles["1.2"] = "New title"
    course.save()
    around = {"index.html", "levels/1.html", lesson("1.1"), lesson("1.3"), "symbols/index.html"}
    around.add("progress/index.html")
    # Lesson 2.1 needs it, which the level of that one says too.
    assert drawn(course.folder) == around | {lesson("1.2"), lesson("2.1"), "levels/2.html"}


def test_the_title_of_a_level_draws_its_lessons_and_its_neighbours(course: Course) -> None:
    course.levels["2"] = "Second"
    course.save()
    levels = {"levels/1.html", "levels/2.html", "progress/index.html"}
    assert drawn(course.folder) == {"index.html", *levels, lesson("2.1"), lesson("2.2")}


def test_a_page_that_moves_draws_those_who_link_to_it(course: Course) -> None:
    course.edit("1.1", "Prose", "[About](page:about#part)")
    drawn(course.folder)
    course.edit("1.3", "Prose", "More")
    assert drawn(course.folder) == {lesson("1.3")}
    page = course.folder.text("content/pages/about.md")
    course.folder.write("content/pages/about.md", page.replace("*it*", "that"))
    assert drawn(course.folder) == {"about.html"}


def test_a_model_draws_its_page(course: Course) -> None:
    course.folder.write("models/box.xml", '<mujoco model="b"/>\n')
    assert drawn(course.folder) == {"models/box.html"}


def test_the_name_of_a_kind_of_callout_draws_the_pages_that_have_one(course: Course) -> None:
    course.edit("1.3", "[!note]", "[!warning]")
    drawn(course.folder)
    course.extra = '[callouts.warning]\nlabel = "Careful"\npromise = "It bites."\n'
    course.save()
    assert drawn(course.folder) == {lesson("1.3")}


def test_the_name_of_the_course_draws_what_tells_it_and_frames_all(course: Course) -> None:
    assert course.folder.main("build", "--quiet").status == 0
    text = course.folder.text("content/course.toml")
    course.folder.write("content/course.toml", text.replace('"Tested"', '"Renamed"'))
    assert course.folder.main("build", "--quiet").status == 0
    for path, page in course.folder.tree("public").items():
        if path.endswith(".html"):
            assert b"Renamed" in page and b"Tested" not in page


def test_a_damaged_store_is_made_again(course: Course) -> None:
    assert course.folder.main("build", "--quiet").status == 0
    before = course.folder.tree("public")
    assert course.folder.spoil() > 30
    course.edit("1.1", "Prose", "Pros")
    course.edit("1.1", "Pros", "Prose")
    shutil.rmtree(course.folder.root / "public")
    assert course.folder.main("build", "--quiet").status == 0
    assert course.folder.tree("public") == before


@pytest.mark.parametrize(
    "junk",
    [
        b"",
        b"null",
        b"[[1]]",
        msgspec.msgpack.encode((["os:system"], [16, "exit 70"])),
        pickle.dumps(Trap()),
    ],
    ids=["empty", "null", "other", "a call", "pickle"],
)
def test_whole_entries_that_somebody_else_wrote_are_ignored(course: Course, junk: bytes) -> None:
    assert course.folder.main("build", "--quiet").status == 0
    before = course.folder.tree("public")
    folder = course.folder.root / ".coursebuild"
    kinds = set()
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        kind = name.partition("/")[0]
        if path.is_file() and len(path.name) == 64 and kind not in SERVED:
            path.write_bytes(sealed(name, junk))
            kinds.add(kind)
    assert {"summaries", "pages", "maps", "keys"} <= kinds
    shutil.rmtree(course.folder.root / "public")
    assert course.folder.main("build", "--quiet").status == 0
    assert course.folder.tree("public") == before


def test_a_page_that_the_store_has_lost_is_drawn_for_its_frame(
    course: Course, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert course.folder.main("build", "--quiet").status == 0
    before = course.folder.tree("public")
    shutil.rmtree(course.folder.root / "public")
    peek = Memo.peek
    lost: list[str] = []

    def without_pages(self: Memo, kind: str, key: str) -> bytes | None:
        if kind != "pages":
            return peek(self, kind, key)
        lost.append(key)
        return None

    monkeypatch.setattr(Memo, "peek", without_pages)
    assert course.folder.main("build", "--quiet").status == 0
    assert course.folder.tree("public") == before
    assert lost


def test_a_broken_link_of_an_unchanged_page_is_found(course: Course) -> None:
    course.edit("1.1", "Prose", '<a href="1.2-l12.html#first">x</a>')
    assert course.folder.main("build", "--quiet").status == 0
    course.edit("1.2", "## First", "## Last")
    done = course.folder.main("build")
    assert done.status == 1
    assert "public/lessons/1.1-l11.html" in done.out
    assert "`lessons/1.2-l12.html` has no anchor `#first`" in done.out
    course.edit("1.2", "## Last", "## First")
    assert course.folder.main("build", "--quiet").status == 0
