"""The HTML of a lesson in another place: well-formed XML, ids of its own, links put in later."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.render.exports.rewrite import Rewriter, Rules, filled, site_path, xml_id

PAGE = "lessons/1.1-one.html"
BOOK = Rules(PAGE, xml=True, pictures=frozenset({"png"}))


def xml(html: str) -> str:
    return filled(Rewriter(BOOK).text(html), lambda path, anchor, shown: f"{path}#{anchor}")


def moved(html: str) -> str:
    rules = Rules(PAGE, prefix="1.1--", down=2, part="1.1")
    return filled(Rewriter(rules).text(html), lambda path, anchor, shown: f"{path}#{anchor}")


PIECES = st.sampled_from(
    "a|&nbsp;|&lt;|&|<|>|<p>|</p>|<br>|<div class=x>|</div>|<ul><li>|<li>|</ul>|<table><tr><td>"
    "|<td>|</table>|<b|</b>|<i>|</i>|<img src=a.png>|<img src='b.avif' alt='\"&'>|<!-- c -->"
    "|<!doctype x>|<script>if (a<b) {}</script>|<svg><path d='M0'/></svg>|<math><mi>x</mi></math>"
    "|<a href='#é b'>|</a>|<input disabled>|<x-y @z=1 1a=2 onclick=e>|\x07|\ufffe"
    "|<details><summary>|</details>|<button>|</button>|<style>p{}</style>|<p id='a b:c'>"
    "|<a name=n>".split("|")
)


@settings(max_examples=200, deadline=None)
@given(st.lists(PIECES, max_size=20).map("".join))
def test_whatever_is_written_becomes_well_formed(html: str) -> None:
    ElementTree.fromstring(f"<body>{xml(html)}</body>")


@pytest.mark.parametrize(
    ("html", "expected"),
    [
        ("a<br>b &nbsp;&eacute; < c", "a<br/>b \xa0é &lt; c"),
        ("<ul><li>a<li>b</ul>c", "<ul><li>a</li><li>b</li></ul>c"),
        ("<p>a<p>b<div>c", "<p>a</p><p>b</p><div>c</div>"),
        ("a</b></div>b", "ab"),
        ("<input disabled type=checkbox>", '<input disabled="" type="checkbox"/>'),
        ("<details><p>a</details>", '<details open=""><p>a</p></details>'),
        ("<p onclick='x' data-a=1 style='b' tabindex=0 class='c d'>e", '<p class="c d">e</p>'),
        ("<button>x <b>y</b></button>z<script>1</script>", "z"),
        ("<h2 id='a é'>b</h2>", '<h2 id="a_20__e9_">b</h2>'),
        ("<img src='p.png' alt='a'>", '<img src="lessons/p.png#" alt="a"/>'),
        ("<img src='p.avif' alt='a &amp; b'>", "a &amp; b"),
        ("<img src='https://x.example/p.png' alt='a'>", "a"),
        ("<svg viewBox='0 0 1 1'><use xlink:href='#a'/></svg>",
         '<svg viewBox="0 0 1 1" xmlns="http://www.w3.org/2000/svg">'
         '<use xmlns:xlink="http://www.w3.org/1999/xlink" xlink:href="#a"/></svg>'),
        ("<math><mi>x</mi></math>", '<math xmlns="http://www.w3.org/1998/Math/MathML"><mi>x</mi></math>'),
    ],
)  # fmt: skip
def test_as_xml(html: str, expected: str) -> None:
    assert xml(html) == expected


@pytest.mark.parametrize(
    ("html", "expected"),
    [
        ('<h2 id="a">b</h2>', '<h4 id="1.1--a">b</h4>'),
        ("<h1>a</h1><h6>b</h6>", "<h3>a</h3><h6>b</h6>"),
        ('<a href="#a%20b">c</a>', '<a href="#1.1--a%20b">c</a>'),
        ('<a href="1.2-two.html#d">c</a>', '<a href="lessons/1.2-two.html#d">c</a>'),
        ('<a href="../about.html">c</a>', '<a href="about.html#">c</a>'),
        ('<a href="https://x.example/?a=1&amp;b=2">c</a>', '<a href="https://x.example/?a=1&amp;b=2">c</a>'),
        ('<p aria-labelledby="a b">c</p>', '<p aria-labelledby="1.1--a 1.1--b">c</p>'),
        ('<section aria-label="Quiz">c</section>', '<section aria-label="Quiz, 1.1">c</section>'),
        ('<p aria-label="Quiz">c</p>', '<p aria-label="Quiz">c</p>'),
        ('<path clip-path="url(#a)"/>', '<path clip-path="url(#1.1--a)"/>'),
        ("a &amp; b &nbsp;", "a &amp; b &nbsp;"),
    ],
)  # fmt: skip
def test_among_other_lessons(html: str, expected: str) -> None:
    assert moved(html) == expected


def test_what_is_left_out_takes_what_is_in_it_along() -> None:
    rules = Rules(PAGE, xml=True, without=frozenset({"qr"}))
    html = 'a<svg class="x qr"><g><svg/><path d="M0"></path></g></svg>b<button><p>c</button>d'
    assert Rewriter(rules).text(html) == "abd"


def test_a_link_that_leads_nowhere_is_text() -> None:
    text = Rewriter(BOOK).text('<a class="x" href="data.csv">a</a>')
    assert filled(text, lambda path, anchor, shown: "") == '<a class="x">a</a>'


@pytest.mark.parametrize(
    ("url", "expected"),
    [
        ("a.html#b%20c", ("lessons/a.html", "b c")),
        ("../a/", ("a/index.html", "")),
        ("../../out.html", (None, "")),
        ("mailto:a@b.example", (None, "")),
        ("//x.example/a", (None, "")),
        ("?q", (None, "")),
    ],
)
def test_site_paths(url: str, expected: tuple[str | None, str]) -> None:
    assert site_path(PAGE, url) == expected


@given(st.text(min_size=1), st.text(min_size=1))
def test_ids_of_xml_are_names_and_differ(a: str, b: str) -> None:
    assert re.fullmatch(r"[A-Za-z_][A-Za-z0-9_.-]*", xml_id(a))
    assert a == b or "_" in a + b or xml_id(a) != xml_id(b)
