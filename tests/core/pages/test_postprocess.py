"""What is changed in a page that was just drawn, and what is noted of it."""

from __future__ import annotations

import re
import sys

from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.postprocess import postprocess_html
from coursebuild.core.pages.styles import class_name


def test_formula_style_and_forbidden_character_are_processed_and_noted() -> None:
    made = postprocess_html(
        '<p id="a&amp;b">é <math><mtd style="padding: 0"/><mi id="m">ẋ</mi></math>, \x07</p>'
        '<a href="x.html#y" name="n">&lambda;</a><img src="a.png" srcset="b.png 2x, c.png">'
        '<b title="id=no" data-x="no">x</b><!-- <i id="no"> --><title id="t">a</title>'
    )
    padding = class_name("padding: 0")
    assert made.html.startswith(
        f'<p id="a&amp;b">é <span class="held"><math><mtd class="{padding}"/>'
        '<mi id="m">ẋ</mi></math>,</span> ␇</p>'
    )
    assert made.declarations == {"padding: 0"}
    assert made.ids == {"a&b", "m", "n", "t"}
    assert made.addresses == {"x.html#y", "a.png", "b.png", "c.png"}
    assert made.text == {"é", "λ"}
    assert made.mathematics == {"ẋ", " "}


@given(st.text() | st.text(alphabet="<>/=\"' bidstyle-!&;#\n\u00a0m", max_size=60))
def test_any_text_is_processed_and_markup_is_taken_as_text(html: str) -> None:
    """What is put into `Markup` would be escaped."""
    made = postprocess_html(Markup(html))
    assert made == postprocess_html(html)
    assert type(made.html) is str


def test_visible_replaces_what_html_forbids_and_nothing_else() -> None:
    every = "".join(map(chr, range(sys.maxunicode + 1)))
    allowed = "\t\n -~\u00a0-\ud7ff\ue000-\ufdcf\ufdf0-\ufffd"
    planes = "".join(f"{chr(p << 16)}-{chr((p << 16) + 0xFFFD)}" for p in range(1, 17))
    kept = re.compile(f"[{allowed}{planes}]")
    for start in range(0, len(every), 4096):
        part = every[start : start + 4096]
        changed = [a for a, b in zip(part, visible(part), strict=True) if a != b]
        assert changed == [c for c in part if not kept.match(c)]
