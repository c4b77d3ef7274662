"""HTML as browsers read it: what is changed in a page that was just drawn, and noted of it."""

from __future__ import annotations

import re
from html import escape, unescape
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from coursebuild.core.files.resources import template_texts
from coursebuild.core.pages.context import PageHead, PageRecord
from coursebuild.core.pages.frame import FRAME_IDS
from coursebuild.core.pages.html_xml import HtmlElement, parse_html, to_html, to_xml
from coursebuild.core.pages.record import class_name, hoist_styles, record
from coursebuild.core.pages.theme import BASE, dark_colours, dark_drawing
from support.fixture_cases import fixture_tables
from support.hostile_html import PAGES

CASES = fixture_tables("styles")


def test_html_is_read_as_by_a_browser() -> None:
    odd = ["\x00\ud800<p title='\"&'>", '?<p title="&quot;&amp;"></p>']
    for html, expected in [*CASES["html"], odd]:
        assert to_html(parse_html(html)) == expected


@given(PAGES | st.text())
def test_whatever_is_read_is_written_as_xml(html: str) -> None:
    ElementTree.fromstring(f"<body>{to_xml(parse_html(html))}</body>")


def test_deep_html_is_brought_up_and_loses_no_text() -> None:
    tree = parse_html("<div>" * 5000 + "deep" + "</div>" * 5000 + "end")
    assert "".join(c if isinstance(c, str) else c.text for c in tree) == "deepend"


def test_elements_are_found() -> None:
    (root,) = parse_html('<div class="a b"><p><b>1</b></p><b>2<b>3</b></b></div>')
    assert isinstance(root, HtmlElement)
    assert root.classes == {"a", "b"} and root.text == "123"
    assert [element.text for element in root.nearest("b")] == ["1", "23"]


PAD = class_name("padding: 0")


def test_a_style_becomes_a_class() -> None:
    for html, expected in CASES["classes"]:
        page, declarations = hoist_styles(html)
        assert page == expected.replace("{PAD}", PAD)
        assert "style" not in page.lower().replace(PAD, "")
        assert len(declarations) == ("padding" in html)
    page, (declaration,) = hoist_styles('<b style="background: url(&quot;a&quot;)">')
    assert (page, declaration) == (f'<b class="{class_name(declaration)}">', 'background: url("a")')


def test_what_only_looks_like_a_style_stays() -> None:
    for html in CASES["unlike"]:
        assert hoist_styles(html) == (html, frozenset())


@pytest.mark.parametrize(
    "declaration",
    ["} body { display: none", "color: red /* ", 'content: "', "a: </style>", "a: \\7d"],
)
def test_a_declaration_cannot_reach_out_of_its_rule(declaration: str) -> None:
    assert hoist_styles(f'<b style="{escape(declaration)}">') == ("<b>", frozenset())


@given(st.text(alphabet="<>/=\"' abcstyle-!\n"))
def test_any_text_is_taken_and_the_result_has_nothing_more_to_take(html: str) -> None:
    page, _ = hoist_styles(html)
    assert hoist_styles(page)[0] == page


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


DRAWING = """<svg viewBox="0 0 9 9"><style>.a{fill:#0072B2}</style>
<defs><g id="x1"/></defs>
<path class="a" style="stroke: #1e1e1c; fill-opacity: 1" fill="none"/>
<path stroke="blue" fill="url(#x1)"/><use href="#x1" color="#fff"/></svg>"""
DARK = """<svg fill="#ffffff" viewBox="0 0 9 9"><style>.a{fill:#56b4e9}</style>
<defs><g id="x1"/></defs>
<path class="a" style="stroke: #e6e3dc; fill-opacity: 1" fill="none"/>
<path stroke="#dadaff" fill="url(#x1)"/><use href="#x1" color="#000000"/></svg>"""
CSS = """--a: light-dark(#0072b2, #56b4e9); --b: light-dark(#1e1e1c,#e6e3dc);
--c: light-dark(#0072b2, #000000); --d: light-dark(rgb(1 2 3 / 5%), #111111)"""


def test_colours_of_pages_are_known_and_others_turned_round() -> None:
    assert dark_drawing(DRAWING, dark_colours(CSS)) == DARK
    note = "<!-- drawn by <svgtool> -->"
    assert dark_drawing(f"{note}<svg/>", {}) == f'{note}<svg fill="#ffffff"/>', "the root is filled"
