"""A preview after a build: what was noted of pages is taken, and of the very same only."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from coursebuild.pipeline.preview import behind
from coursebuild.pipeline.preview.pages import Pages
from support.live_course import Builds, Live, differences
from support.live_course import builds as builds
from support.live_course import live as live
from support.scratch_course import GOOD, Folder

pytestmark = pytest.mark.site

Make = Callable[..., Folder]
OTHER = GOOD.replace("hello.py", "other.py")


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The pages that previews of courses with many of them have drawn."""
    monkeypatch.setattr(behind, "_FEW", 0)
    found: list[str] = []
    draw = Pages.draw

    def noting(self: Pages, path: str, library: object) -> object:
        found.append(path)
        return draw(self, path, library)  # type: ignore[arg-type]

    monkeypatch.setattr(Pages, "draw", noting)
    return found


def test_pages_that_a_build_has_drawn_are_drawn_when_they_are_asked_for(
    make: Make, live: Callable[[Folder], Live], builds: Builds, drawn: list[str]
) -> None:
    folder = make(GOOD, OTHER)
    assert folder.main("build").status == 0
    running = live(folder)
    running.behind.once()
    assert drawn == []
    assert running.course.pages.waiting() == running.course.pages.unnoted() == ()
    assert b"hello.py" in (running.course.find("lessons/1.1-one.html") or b"")
    assert drawn == ["lessons/1.1-one.html"]
    built = builds(folder)
    assert built is not None
    assert differences(running.site(), built) == []


def test_what_is_edited_since_is_drawn(
    make: Make, live: Callable[[Folder], Live], builds: Builds, drawn: list[str]
) -> None:
    """A character that no page had is in the fonts, and a page that was open before is new."""
    folder = make(GOOD, OTHER)
    assert folder.main("build").status == 0
    running = live(folder)
    assert running.course.find("lessons/1.2-two.html") is not None
    running.behind.once()
    drawn.clear()
    folder.write(folder.lesson(), folder.text(folder.lesson()) + "\nMore of ж.\n")
    assert running.save(folder.lesson())
    assert set(drawn) == {"lessons/1.1-one.html"}
    assert "ж" in (running.course.find("lessons/1.1-one.html") or b"").decode()
    built = builds(folder)
    assert built is not None
    assert differences(running.site(), built) == []


def test_a_build_of_another_text_says_nothing(
    make: Make, live: Callable[[Folder], Live], builds: Builds, drawn: list[str]
) -> None:
    folder = make(GOOD, OTHER)
    assert folder.main("build").status == 0
    folder.write(folder.lesson(), folder.text(folder.lesson()) + "\nMore of ж.\n")
    running = live(folder)
    running.behind.once()
    assert "lessons/1.1-one.html" in drawn
    assert "lessons/1.2-two.html" not in drawn
    built = builds(folder)
    assert built is not None
    assert differences(running.site(), built) == []


def test_a_page_with_a_mistake_is_not_taken_for_the_good_one(
    make: Make, live: Callable[[Folder], Live]
) -> None:
    folder = make(GOOD, OTHER)
    assert folder.main("build").status == 0
    folder.write(folder.lesson(), folder.text(folder.lesson()) + "\n[Nowhere](#nowhere)\n")
    running = live(folder)
    running.behind.once()
    assert running.wrong() == ["link-anchor"]
    assert running.course.find("lessons/1.1-one.html") is None
    assert running.course.pages.unnoted() == ("lessons/1.1-one.html",)


def test_a_damaged_record_is_none(
    make: Make, live: Callable[[Folder], Live], builds: Builds, drawn: list[str]
) -> None:
    folder = make(GOOD, OTHER)
    assert folder.main("build").status == 0
    assert folder.spoil()
    running = live(folder)
    running.behind.once()
    assert {"lessons/1.1-one.html", "lessons/1.2-two.html"} <= set(drawn)
    built = builds(folder)
    assert built is not None
    assert differences(running.site(), built) == []
