"""How much of a course is proven, as a table."""

from __future__ import annotations

from support.rendered_course import Make


def test_table_links_to_the_lessons(make: Make) -> None:
    text = "It weighs 1.5 kg.\n\n```truth\n```\n"
    site = make(text, **{"1.1": "Nothing."}).site()
    page = site["lessons/0.1-falling.html"].decode()
    assert '<a href="0.1-falling.html">0.1 Falling</a></td>' in page
    assert '<a href="1.1-spinning.html">1.1 Spinning &lt;fast&gt;</a>' in page
    copy = site["lessons/0.1-falling.md"].decode()
    assert '| <a href="0.1-falling.html">0.1 Falling</a> | 0.0 % | 1 |' in copy
