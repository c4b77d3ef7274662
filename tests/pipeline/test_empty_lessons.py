"""A lesson that is said to be complete, and in which there is nothing to read."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from support.live_course import Live
from support.live_course import live as live
from support.scratch_course import GOOD, Folder

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


@pytest.mark.parametrize("text", NOTHING.values(), ids=NOTHING)
def test_nothing_is_published(make: Make, text: bytes) -> None:
    folder = make(GOOD, text)
    done = folder.main("build")
    path = folder.lesson(2)
    assert done.status == 1
    assert done.out.startswith(
        f"error[lesson-empty]: lesson 1.2 is complete, and there is nothing to read in {path}\n"
        f"  --> {path}:1:1\n"
    )
    assert (
        '= help: write it, say `status = "draft"` in the map, '
        'or say `status = "planned"` and remove the file\n'
    ) in done.out
    assert done.out.endswith(": 1 error\n")
    assert not (folder.root / "public").exists()


@pytest.mark.parametrize(
    "text", ["Prose.\n", "<!-- x -->\n\nProse.\n", "---\n", "$$x$$\n", "    code\n", "<hr>\n", "x"]
)
def test_little_is_something(make: Make, text: str) -> None:
    folder = make(GOOD, text)
    assert folder.main("check").status == 0


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
        one.course.reread()
        assert one.wrong() == wrong
