"""A link that leads nowhere is reported where its author wrote it."""

from __future__ import annotations

import re

import pytest

from support.scratch_course import Make

pytestmark = pytest.mark.site

QUIZ = """```quiz
{"id": "q", "questions": [{"kind": "mcq", "id": "a", "q": "See <a href=\\"gone.html\\">it</a>?",
 "options": ["yes", "no"], "answer": 0, "explain": "So."}]}
```
"""
LINKS = {
    '<a href="gone.html">it</a>': "1:10",
    '<a title="<b>it</b>" href="gone.html">it</a>': "1:28",
    "<a title='gone.html' href='gone.html?<b>&amp;c=\"d\"'>it</a>": "1:28",
    "<a href=gone.html#&lt;b&gt;>it</a>": "1:9",
    '<p>\n<b title="a>b">c</b>\n<a\nhref="gone.html">it</a></p>': "4:7",
    '> quoted\n> <a\n> href="gone.html">it</a>': "3:9",
    '- A [rotor]{term} is <a href="gone.html">it</a>.': "1:31",
    "`gone.html` and <!-- <a href='gone.html'> --> <a href='gone.html'>it</a>": "1:56",
    QUIZ: "2:74",
}


def test_broken_link_in_raw_html_is_reported_at_its_place(make: Make) -> None:
    """A title of the map that looks like such a link is text, and no link of the page."""
    folder = make("Text\n")
    title = "title = '<a href=\"gone.html\">'"
    folder.replace("content/course.toml", 'title = "Lesson one"', title)
    places = {}
    for text in LINKS:
        folder.write(folder.lesson(), f"{text}\n")
        result = folder.main("build")
        assert result.status == 1, text
        places[text] = re.findall(r"(?:error|warning)\[.*\n *--> (.*)", result.out)
    assert places == {text: [f"{folder.lesson()}:{place}"] for text, place in LINKS.items()}
