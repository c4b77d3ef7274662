"""A lesson that is said to be complete, and in which there is nothing to read."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from support.live_course import Live
from support.live_course import live as live
from support.scratch_course import GOOD, Folder

pytestmark = pytest.mark.site

Make = Callable[..., Folder]
NOTHING = {
    "no bytes": b"",
    "blanks": b" \n\t\n",
    "other blanks": "\u00a0\n\u2003".encode(),
    "a mark": b"\xef\xbb\xbf",
    "a mark and a line end": b"\xef\xbb\xbf\r\n",
    "comments": b"<!-- soon -->\n\n<!-- or\n\nlater -->\n",
    "where links lead": b"[there]: https://example.org\n",
}


def test_complete_lesson_with_nothing_to_read_is_told_and_not_published(make: Make) -> None:
    folder = make(GOOD, *NOTHING.values())
    done = folder.main("build")
    assert done.status == 1
    for number, kind in enumerate(NOTHING, 2):
        path = folder.lesson(number)
        assert (
            f"error[lesson-empty]: lesson 1.{number} is complete, and there is nothing to read in "
            f"{path}\n  --> {path}:1:1\n"
        ) in done.out, kind
    help = (
        '= help: write it, say `status = "draft"` in the map, '
        'or say `status = "planned"` and remove the file\n'
    )
    assert done.out.count(help) == len(NOTHING)
    assert done.out.endswith(f": {len(NOTHING)} errors\n")
    assert not (folder.root / "public").exists()


def test_complete_lesson_with_little_to_read_is_no_mistake(make: Make) -> None:
    little = ["Prose.\n", "<!-- x -->\n\nProse.\n", "---\n", "$$x$$\n", "    code\n", "<hr>\n", "x"]
    done = make(GOOD, *little).main("check")
    assert done.status == 0, done.out


def test_a_draft_says_itself_that_there_is_more_to_come(make: Make) -> None:
    folder = make(GOOD, "")
    head, second = folder.text("content/course.toml").split('"1.2"')
    assert second.count('"complete"') == 1
    draft = second.replace('"complete"', '"draft"')
    folder.write("content/course.toml", f'{head}"1.2"{draft}')
    assert folder.main("build").status == 0


def test_a_broken_block_is_something(make: Make) -> None:
    done = make(GOOD, "```quiz\n{\n```\n").main("check")
    assert "error[json-syntax]" in done.out
    assert "lesson-empty" not in done.out


def test_prose_that_is_taken_away_is_noticed(make: Make) -> None:
    """Though nobody else looks at prose, and what was found wrong is remembered."""
    folder = make(GOOD, "Prose.\n")
    for text, status in (("Prose.\n", 0), ("", 1), ("Other prose.\n", 0), ("<!-- x -->\n", 1)):
        folder.write(folder.lesson(2), text)
        done = folder.main("check")
        assert (done.status, "error[lesson-empty]" in done.out) == (status, status == 1)


def test_a_preview_tells_it_too(make: Make, live: Callable[[Folder], Live]) -> None:
    folder = make(GOOD, "Prose.\n")
    one = live(folder)
    assert one.wrong() == []
    for text, wrong in (("", ["lesson-empty"]), ("Prose.\n", []), ("<!-- x -->", ["lesson-empty"])):
        folder.write(folder.lesson(2), text)
        one.save(folder.lesson(2))
        assert one.wrong() == wrong
        one.session.read()
        assert one.wrong() == wrong
