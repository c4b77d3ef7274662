"""What is changed in a page that was just drawn, and what is noted of it."""

from __future__ import annotations

import re
from html import unescape

from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from coursebuild.core.files.resources import template_texts
from coursebuild.core.pages.fonts import BASE
from coursebuild.core.pages.frame import FRAME_IDS
from coursebuild.core.pages.page_inputs import PageHead
from coursebuild.core.pages.record import PageRecord, class_name, record

PIECES = [
    *("<math><mi>x</mi><mo>&lt;</mo></math>", '<math display="block"><mi>α</mi></math>', "<math>"),
    *("</math>", '<span style="color:red">', "</span>", "<!--", "-->", "<p>", "</p>", "&amp;"),
    *("&am", "p;", "&notit;", "&#955;", "&#x3bb", "&amp", "(", "“", "”,", ".", "é", "∂", "a b"),
    *("\u00a0m", "\n"),
]
html = st.lists(st.sampled_from(PIECES), max_size=20).map("".join)


def record_of(body: str) -> tuple[PageRecord, str]:
    return record(PageHead("x.html", "page", "Títle", ""), Markup(body), "")


@given(html)
def test_the_facts_of_a_page_are_its_characters(body: str) -> None:
    facts, body = record_of(body)
    formula = re.compile(r"<math\b.*?</math>", re.DOTALL)
    # A reference ends where a tag begins.
    text = unescape(re.sub(r"<[^>]*>", "\0", formula.sub("\0", body)))
    inside = "".join(unescape(re.sub(r"<[^>]*>", "\0", m)) for m in formula.findall(body))
    assert set(facts.text) == {c for c in f"Títle{text}" if not c.isascii() and c not in BASE}
    assert set(facts.mathematics) - {" "} == {c for c in inside if not c.isascii()}
    assert (" " in facts.mathematics) == (formula.search(body) is not None)


def test_a_long_page_is_looked_through_once() -> None:
    """Even with much to scan after the last character that counts."""
    assert record_of("λ" + "a > b & c " * 40_000)[0].text == "íλ"


def test_formula_style_and_forbidden_character_are_changed_and_noted() -> None:
    page_record, html = record_of(
        '<p id="a&amp;b">é <math><mtd style="padding: 0"/><mi id="m">ẋ</mi></math>, \x07</p>'
        '<a href="x.html#y" name="n">&lambda;</a><img src="a.png" srcset="b.png 2x, c.png">'
        '<b title="id=no" data-x="no">x</b><!-- <i id="no"> --><title id="t">a</title>'
    )
    padding = class_name("padding: 0")
    assert html.startswith(
        f'<p id="a&amp;b">é <span class="held"><math><mtd class="{padding}"/>'
        '<mi id="m">ẋ</mi></math>,</span> ␇</p>'
    )
    assert page_record.declarations == ("padding: 0",)
    assert page_record.ids == ("a&b", "m", "n", "t")
    assert page_record.references == (("a.png", ""), ("b.png", ""), ("c.png", ""), ("x.html", "y"))
    assert (page_record.text, page_record.mathematics) == ("íλ", " ẋ")


@given(st.text() | st.text(alphabet="<>/=\"' bidstyle-!&;#\n\u00a0m", max_size=60))
def test_any_text_is_recorded_and_markup_is_taken_as_text(html: str) -> None:
    """`Markup` would escape what is inserted."""
    assert type(record_of(html)[1]) is str


def test_an_id_that_the_page_or_its_frame_has_already_is_noted() -> None:
    facts, _ = record_of('<p id="a"><a id="b" name="b" href="#a">x</a><!-- id="b" --><i id="a">')
    assert facts.repeated_ids == (("a", 0, 0),)
    base = dict(template_texts())["base.html"]
    assert frozenset(re.findall(r'\bid="([^"]*)"', base)) == FRAME_IDS
    for name in FRAME_IDS:
        assert record_of(f'<p id="{name}">')[0].repeated_ids == ((name, 0, 0),)
