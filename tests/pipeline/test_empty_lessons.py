"""A lesson that is marked as complete and has nothing to read."""

from __future__ import annotations

import pytest

from support.scratch_course import GOOD, Make

pytestmark = pytest.mark.site


def test_what_counts_as_something_to_read(make: Make) -> None:
    little = ["Prose.\n", "<!-- x -->\n\nProse.\n", "---\n", "$$x$$\n", "    code\n", "<hr>\n", "x"]
    folder = make(GOOD, *little)
    result = folder.main("check")
    assert result.status == 0, result.out
    # No other check looks at prose; the second check takes its diagnostics from the store.
    for text, status in (
        ("", 1),
        ("Other prose.\n", 0),
        ("<!-- x -->\n\n<!-- y\n\nz -->\n", 1),
        ("\u00a0\n\u2003", 1),
        ("[there]: https://example.org\n", 1),
    ):
        folder.write(folder.lesson(2), text)
        result = folder.main("check")
        assert (result.status, "error[lesson-empty]" in result.out) == (status, status == 1)
    head, second = folder.text("content/course.toml").split('"1.2"')  # a draft may be empty
    folder.write("content/course.toml", f'{head}"1.2"{second.replace("complete", "draft", 1)}')
    assert folder.main("build").status == 0
    folder.write(folder.lesson(3), "```quiz\n{\n```\n")
    result = folder.main("check")
    assert ("error[json-syntax]" in result.out, "lesson-empty" in result.out) == (True, False)
