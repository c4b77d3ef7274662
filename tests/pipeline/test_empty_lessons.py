"""A lesson that is said to be complete, and in which there is nothing to read."""

from __future__ import annotations

from collections.abc import Callable

import pytest

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


def test_what_counts_as_something_to_read(make: Make) -> None:
    little = ["Prose.\n", "<!-- x -->\n\nProse.\n", "---\n", "$$x$$\n", "    code\n", "<hr>\n", "x"]
    folder = make(GOOD, *little)
    done = folder.main("check")
    assert done.status == 0, done.out
    # Nobody else looks at prose, and what was found wrong is remembered.
    for text, status in (("", 1), ("Other prose.\n", 0), ("<!-- x -->\n", 1)):
        folder.write(folder.lesson(2), text)
        done = folder.main("check")
        assert (done.status, "error[lesson-empty]" in done.out) == (status, status == 1)
    head, second = folder.text("content/course.toml").split('"1.2"')  # a draft says it itself
    folder.write("content/course.toml", f'{head}"1.2"{second.replace("complete", "draft", 1)}')
    assert folder.main("build").status == 0
    folder.write(folder.lesson(3), "```quiz\n{\n```\n")
    done = folder.main("check")
    assert ("error[json-syntax]" in done.out, "lesson-empty" in done.out) == (True, False)
