"""A course in memory gives the site that a build gives, after one edit."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from coursebuild.core.model.results import ScriptJob, ScriptRun
from coursebuild.core.run.runner import ScriptServer
from support.live_course import Builds, Live, differences, share
from support.live_course import builds as builds
from support.live_course import live as live
from support.scratch_course import GOOD, ROOT, Folder, block

pytestmark = pytest.mark.site

Make = Callable[..., Folder]
FULL = ROOT / "tests/courses/full/course"


@pytest.mark.engine
def test_course_of_every_construct_after_edits_is_what_a_clean_build_gives(
    tmp_path: Path, stores: Path, live: Callable[[Folder], Live], builds: Builds
) -> None:
    folder = Folder(tmp_path / "course")
    shutil.copytree(FULL, folder.root)
    folder.borrow(stores)
    share(folder, tmp_path / "trials")
    running = live(folder)

    def same() -> None:
        built = builds(folder)
        assert built is not None
        assert differences(running.site(), built) == []

    # A lab and a model that moved, and one that changed.
    lesson = "content/lessons/A.1-models-and-questions.md"
    folder.write(lesson, "A first paragraph, with $x + ж$.\n\n" + folder.text(lesson))
    assert running.save(lesson)
    folder.replace(lesson, '"title": "A falling box"', '"title": "A box that falls"')
    assert running.save(lesson)
    same()
    folder.replace("models/box.xml", "<mujoco", "<!-- a box --><mujoco")
    assert not running.save("models/box.xml")
    same()


def test_a_page_is_new_before_anything_else_is_done(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD, GOOD.replace("hello.py", "other.py"))
    running = live(folder)
    page = "lessons/1.1-one.html"
    assert b"Hello" in (running.find(page) or b"")
    other = running.find("lessons/1.2-two.html")
    folder.replace(folder.lesson(), "## Hello", "## Good morning")
    assert running.save(folder.lesson())
    assert b"Good morning" in (running.find(page) or b"")
    assert running.find("lessons/1.2-two.html") == other


def test_lists_of_lessons_follow_their_questions(
    make: Make, live: Callable[[Folder], Live], builds: Builds
) -> None:
    folder = make(GOOD, GOOD.replace("hello.py", "other.py"))
    running = live(folder)
    running.site()
    path = folder.lesson(2)
    asking = '```quiz\n{"id": "q", "title": "Q", "questions": [%s]}\n```\n'
    one, other = (
        f'{{"kind": "open", "id": "{id}", "q": "{id}?", "reference": "So."}}' for id in "ab"
    )
    lists = ("index.html", "levels/1.html", "progress/index.html", "review/index.html")

    def same() -> bool:
        built = builds(folder)
        assert built is not None
        return [running.find(p) for p in lists] == [built.get(p) for p in lists]

    for text in (one, f"{one}, {other}", other):
        folder.write(path, GOOD.replace("hello.py", "other.py") + "\n" + asking % text)
        assert running.save(path)
        running.rebuild.once()
        assert same()
    folder.write(path, GOOD.replace("hello.py", "other.py"))
    assert running.save(path)
    running.rebuild.once()
    assert running.find("review/index.html") is None
    assert same()


def test_nothing_is_new_after_a_touch(make: Make, live: Callable[[Folder], Live]) -> None:
    folder = make(GOOD)
    running = live(folder)
    running.site()
    version = running.session.version
    folder.write(folder.lesson(), folder.read(folder.lesson()))
    assert running.session.edit([folder.lesson()]) is False
    assert running.session.read() is False
    assert running.session.version == version


def test_rereading_finds_nothing_new_where_a_page_lies_outside_of_content(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD)
    page = '\n[[page]]\nid = "p"\ntitle = "P"\npath = "docs/p.md"\n'
    folder.write("content/course.toml", folder.read("content/course.toml") + page.encode())
    folder.write("docs/p.md", "## A page\n\nText.\n")
    running = live(folder)
    running.site()
    for _ in range(2):
        assert running.session.read() is False


def test_the_last_good_page_stays_and_the_others_go_on(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD, "## Two\n")
    running = live(folder)
    one, two = "lessons/1.1-one.html", "lessons/1.2-two.html"
    running.site()
    for mistake, rule in (
        ("[gone](lesson:9.9)\n", "link-lesson"),
        ("$\\frac{1$\n", "math-syntax"),
        ("```quiz\n{\n```\n", "json-syntax"),
    ):
        good = folder.text(folder.lesson())
        before = running.find(one)
        folder.write(folder.lesson(), good.replace("## Hello", "## Never seen") + mistake)
        assert running.save(folder.lesson())
        assert rule in running.wrong()
        assert running.session.files.is_kept(one)
        assert running.find(one) == before
        folder.write(folder.lesson(2), f"## Two after {rule}\n")
        assert running.save(folder.lesson(2))
        assert f"Two after {rule}".encode() in (running.find(two) or b"")
        running.site()
        assert running.find(one) == before
        folder.write(folder.lesson(), good.replace("## Hello", f"## Hello {rule}"))
        assert running.save(folder.lesson())
        assert running.wrong() == []
        assert f"Hello {rule}".encode() in (running.find(one) or b"")
        folder.write(folder.lesson(), good)
        running.save(folder.lesson())


def test_page_that_was_never_good_appears_when_mended(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD + "[gone](lesson:9.9)\n")
    running = live(folder)
    page = "lessons/1.1-one.html"
    assert running.find(page) is None
    assert running.session.files.has_page(page)
    folder.write(folder.lesson(), GOOD)
    running.save(folder.lesson())
    assert b"Hello" in (running.find(page) or b"")


def test_a_broken_map_changes_nothing_that_is_shown(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD)
    running = live(folder)
    before = running.site()
    good = folder.read("content/course.toml")
    folder.write("content/course.toml", b"[course\n")
    running.save("content/course.toml")
    assert running.wrong() == ["map-syntax"]
    assert {path: running.find(path) for path in before} == before
    folder.write("content/course.toml", good)
    running.save("content/course.toml")
    assert running.wrong() == []
    assert running.site() == before


def test_a_mistake_that_another_file_makes_and_mends(
    make: Make, live: Callable[[Folder], Live], builds: Builds
) -> None:
    folder = make("## One\n\n## Two {#two}\n", "[There](lesson:1.1#two)\n")
    running = live(folder)
    running.site()
    folder.replace(folder.lesson(), "{#two}", "{#three}")
    assert running.save(folder.lesson())
    running.site()
    assert running.wrong() == ["link-anchor"]
    folder.replace(folder.lesson(), "{#three}", "{#two}")
    assert running.save(folder.lesson())
    site = running.site()
    assert running.wrong() == []
    built = builds(folder)
    assert built is not None and differences(site, built) == []


def test_scripts_run_behind_and_only_those_that_changed(
    make: Make, live: Callable[[Folder], Live], monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[str] = []

    ordinary = ScriptServer.run

    def noted(
        server: ScriptServer, root: Path, todo: Sequence[ScriptJob], **how: Any
    ) -> tuple[ScriptRun, ...]:
        started.extend(job.path for job in todo)
        return ordinary(server, root, todo, **how)

    monkeypatch.setattr(ScriptServer, "run", noted)
    folder = make(*(f"## Lesson\n\n{block(f'{name}.py', 'print(1)', '1')}" for name in "ab"))
    running = live(folder)
    running.site()
    assert sorted(started) == ["examples/a.py", "examples/b.py"]
    folder.replace(folder.lesson(), "## Lesson", "## Another")
    assert running.save(folder.lesson())
    running.site()
    assert len(started) == 2
    folder.replace(folder.lesson(), "print(1)", "print(1 + 0)")
    assert running.save(folder.lesson())
    running.site()
    assert started[2:] == ["examples/a.py"]
    folder.write("models/ball.xml", "<mujoco/>")
    assert not running.save("models/ball.xml")
    running.site()
    assert len(started) == 3
