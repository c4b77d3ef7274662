"""Frames that are put together from pieces are those that the template gives."""

from __future__ import annotations

import pytest
from markupsafe import Markup
from msgspec.structs import replace

from coursebuild.core.pages.draft import Draft
from coursebuild.core.pages.frame import Frames, Names, frame_around
from coursebuild.core.pages.library import Library
from support.rendered_course import Make

NAMES = Names(
    style="assets/s.css",
    theme_script="assets/t.js",
    script="assets/p.js",
    icon="assets/i.svg",
    credits="assets/c.txt",
    touch_icon="assets/i.png",
    scripts=(("data-quiz=", "assets/q.js"),),
)
HOSTILE = 'a "b" <c> & \x07 d\'s \ue000title\ue001 — é'


def drafts() -> list[Draft]:
    one = Draft("lessons/1.1-a.html", "lesson", "One", "What it is.", Markup())
    return [
        one,
        replace(one, path="lessons/1.2-b.html", title="Two", json_ld=Markup('{"a":"<"}')),
        replace(one, path="lessons/1.3-c.html", title=HOSTILE, description=HOSTILE),
        replace(one, path="lessons/1.4-d.html", description="", og_type="article"),
        replace(one, path="lessons/1.5-e.html", kind="stub", indexed=False),
        replace(one, path="levels/1.html", kind="level", description=""),
        replace(one, path="levels/2.html", kind="level"),
        replace(one, path="models/a/b.html", kind="model"),
        replace(one, path="about.html", kind="page"),
        replace(one, path="index.html", kind="home", title="Bodies & <axes>"),
        replace(one, path="404.html", kind="notfound", indexed=False),
    ]


@pytest.mark.parametrize("base_url", ["", "https://example.org/course/"])
@pytest.mark.parametrize("title", ["Bodies", "Icons \ue000icon\ue001 & \ue001more\ue000"])
def test_a_frame_put_together_from_pieces_is_that_of_the_template(
    make: Make, base_url: str, title: str
) -> None:
    made = make("Text.")
    course = replace(made.course, base_url=base_url, title=title)
    library = Library.of(course, made.results, made.assets)
    frames = Frames(library, NAMES)
    for parts in ((), ("data-config=",), ("data-config=", "data-quiz="), ()):
        for draft in drafts():
            expected = frame_around(library, draft, NAMES, parts)
            assert frames.around(draft, parts) == expected, draft
