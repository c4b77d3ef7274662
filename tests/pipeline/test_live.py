"""A course in memory gives the site that a build gives, after one edit."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.preview import rebuild
from support.built_sites import BuiltCourses
from support.live_course import TRIALS, Builds, Live, differences, share
from support.live_course import builds as builds
from support.live_course import live as live
from support.scratch_course import GOOD, Folder, Make, block

pytestmark = pytest.mark.site


@pytest.mark.engine
def test_course_of_every_construct_after_edits_is_what_a_clean_build_gives(
    tmp_path: Path,
    stores: Path,
    built_courses: BuiltCourses,
    live: Callable[[Folder], Live],
    builds: Builds,
) -> None:
    """Results that take long come from a build's store, except those of edited parts."""
    before = built_courses["full"].root
    for name in TRIALS:
        shutil.copytree(before / ".coursebuild" / name, builds.trials / name)
    folder = Folder(tmp_path / "course")
    for top in ("content", "models"):
        shutil.copytree(before / top, folder.root / top)
    folder.borrow(stores)
    share(folder, builds.trials)
    running = live(folder)
    # A lab and a model are moved, and a lab is edited.
    lesson = "content/lessons/A.1-models-and-questions.md"
    folder.write(lesson, "A first paragraph, with $x + ж$.\n\n" + folder.text(lesson))
    assert running.save(lesson)
    folder.replace(lesson, '"title": "A falling box"', '"title": "A box that falls"')
    assert running.save(lesson)
    build = builds(folder)
    assert build is not None
    assert differences(running.site(), build) == []


def test_nothing_is_new_after_a_touch(make: Make, live: Callable[[Folder], Live]) -> None:
    """Nor for a page outside of `content/`."""
    folder = make(GOOD)
    page = '\n[[page]]\nid = "p"\ntitle = "P"\nfile = "docs/p.md"\n'
    folder.write("content/course.toml", folder.text("content/course.toml") + page)
    folder.write("docs/p.md", "## A page\n\nText.\n")
    running = live(folder)
    running.site()
    version = running.session.version
    for path in (folder.lesson(), "docs/p.md"):
        folder.write(path, folder.read(path))
        assert running.session.edit([path]) is False
    assert running.session.read() is False
    assert running.session.version == version


def test_the_last_good_page_stays_and_the_others_go_on(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD, "## Two\n\nText.\n")
    running = live(folder)
    first, second = "lessons/1.1-one.html", "lessons/1.2-two.html"
    running.site()
    for mistake, rule in (
        ("[gone](lesson:9.9)\n", "link-lesson"),
        ("$\\frac{1$\n", "math-syntax"),
        ("```quiz\n{\n```\n", "json-syntax"),
    ):
        good = folder.text(folder.lesson())
        before = running.find(first)
        folder.write(folder.lesson(), good.replace("## Hello", "## Never seen") + mistake)
        assert running.save(folder.lesson())
        assert rule in running.error_rules()
        assert running.session.files.is_outdated(first)
        assert running.find(first) == before
        folder.write(folder.lesson(2), f"## Two after {rule}\n\nText.\n")
        assert running.save(folder.lesson(2))
        assert f"Two after {rule}".encode() in (running.find(second) or b"")
        running.site()
        assert running.find(first) == before
        folder.write(folder.lesson(), good.replace("## Hello", f"## Hello {rule}"))
        assert running.save(folder.lesson())
        assert running.error_rules() == []
        assert f"Hello {rule}".encode() in (running.find(first) or b"")
        folder.write(folder.lesson(), good)
        running.save(folder.lesson())


# --- documents that depend on a lesson


def test_a_term_that_goes_makes_a_mistake_elsewhere_until_it_comes_back(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make("A [thing]{term} is.\n", "See [it](term:thing).\n")
    first, second = folder.lesson(1), folder.lesson(2)
    running = live(folder)
    for path, old, new, broken in (
        (first, "[thing]{term}", "thing", ["link-term"]),
        (second, "See [it](term:thing)", "A [Thing]{term} is", []),
        (first, "thing", "[thing]{term}", ["term-repeated"]),
        (first, "A [thing]{term} is.\n", "<!-- x -->", ["lesson-empty"]),
    ):
        folder.replace(path, old, new)
        running.save(path)
        running.session.read()
        assert running.error_rules() == broken


# --- background work


def test_script_that_imports_another_runs_again_when_that_is_edited(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(
        block("first.py", 'print("one")\nVALUE = 1', "one")
        + block("second.py", "import first\nprint(first.VALUE)", "one\n1")
    )
    running = live(folder)
    running.rebuild.run_once()
    assert running.error_rules() == []
    folder.replace(folder.lesson(), "VALUE = 1", "VALUE = 2")
    assert running.save(folder.lesson())
    running.rebuild.run_once()
    assert running.error_rules() == ["output-drift"]


def test_what_fails_is_said_once_and_tried_again(
    make: Make,
    live: Callable[[Folder], Live],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    running = live(make(GOOD))
    run_once, tries = running.rebuild.run_once, iter(range(4))

    def failing() -> None:
        if next(tries) < 3:
            raise EffectError("the disk is full")
        run_once()
        running.rebuild.fail(KeyboardInterrupt())

    monkeypatch.setattr(running.rebuild, "run_once", failing)
    monkeypatch.setattr(rebuild, "QUIET", 0.01)
    monkeypatch.setattr(rebuild, "RETRY", 0.05)
    with pytest.raises(KeyboardInterrupt):
        running.rebuild.follow()
    assert next(tries, None) is None
    assert capsys.readouterr().err.count("coursebuild: the disk is full\n") == 1
    assert running.session.trouble == ""


def test_page_that_a_build_has_drawn_is_taken_only_where_it_is_the_same(
    make: Make, live: Callable[[Folder], Live], builds: Builds
) -> None:
    folder = make(GOOD, GOOD.replace("hello.py", "other.py"))
    assert folder.main("build").status == 0
    folder.write(folder.lesson(), GOOD + "\nMore of ж.\n")
    build = builds(folder)
    assert build is not None
    running = live(folder)
    assert running.find("lessons/1.1-one.html") is not None
    assert differences(running.site(), build) == []
    assert folder.spoil()
    assert differences(live(folder).site(), build) == []


def test_page_with_a_mistake_is_not_taken_from_a_build_before_it(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD)
    assert folder.main("build").status == 0
    folder.write(folder.lesson(), GOOD + "\n[Nowhere](#nowhere)\n")
    running = live(folder)
    running.rebuild.run_once()
    assert running.error_rules() == ["link-anchor"]
    assert running.find("lessons/1.1-one.html") is None
    assert running.session.files.has_page("lessons/1.1-one.html")
