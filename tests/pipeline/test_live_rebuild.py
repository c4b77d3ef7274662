"""What follows a save in a preview, and what it takes from an earlier build."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.preview import rebuild
from support.live_course import Builds, Live, differences
from support.live_course import builds as builds
from support.live_course import live as live
from support.scratch_course import GOOD, Folder, block

pytestmark = pytest.mark.site

Make = Callable[..., Folder]
Start = Callable[[Folder], Live]
PAGE = "lessons/1.1-one.html"


def test_script_that_imports_another_runs_again_when_that_is_edited(
    make: Make, live: Start
) -> None:
    folder = make(
        block("first.py", 'print("one")\nVALUE = 1', "one")
        + block("second.py", "import first\nprint(first.VALUE)", "one\n1")
    )
    one = live(folder)
    one.rebuild.once()
    assert one.wrong() == []
    folder.replace(folder.lesson(), "VALUE = 1", "VALUE = 2")
    assert one.save(folder.lesson())
    one.rebuild.once()
    assert one.wrong() == ["output-drift"]


def test_what_fails_is_said_once_and_tried_again(
    make: Make, live: Start, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    one = live(make(GOOD))
    once, tries = one.rebuild.once, iter(range(4))

    def failing() -> None:
        if next(tries) < 3:
            raise EffectError("the disk is full")
        once()
        one.rebuild.fail(KeyboardInterrupt())

    monkeypatch.setattr(one.rebuild, "once", failing)
    monkeypatch.setattr(rebuild, "QUIET", 0.01)
    monkeypatch.setattr(rebuild, "RETRY", 0.05)
    with pytest.raises(KeyboardInterrupt):
        one.rebuild.follow()
    assert next(tries, None) is None
    assert capsys.readouterr().err.count("coursebuild: the disk is full\n") == 1
    assert one.session.trouble == ""


def test_page_that_a_build_has_drawn_is_taken_only_where_it_is_the_same(
    make: Make, live: Start, builds: Builds
) -> None:
    folder = make(GOOD, GOOD.replace("hello.py", "other.py"))
    assert folder.main("build").status == 0
    folder.write(folder.lesson(), GOOD + "\nMore of ж.\n")
    built = builds(folder)
    assert built is not None
    running = live(folder)
    assert running.find(PAGE) is not None
    assert differences(running.site(), built) == []
    assert folder.spoil()
    assert differences(live(folder).site(), built) == []


def test_page_with_a_mistake_is_not_taken_from_a_build_before_it(make: Make, live: Start) -> None:
    folder = make(GOOD)
    assert folder.main("build").status == 0
    folder.write(folder.lesson(), GOOD + "\n[Nowhere](#nowhere)\n")
    running = live(folder)
    running.rebuild.once()
    assert running.wrong() == ["link-anchor"]
    assert running.find(PAGE) is None
    assert running.session.files.has_page(PAGE)
