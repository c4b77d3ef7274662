"""The HTML of a lesson rewritten for a book: well-formed XML, new ids and links."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from xml.etree import ElementTree

from hypothesis import given

from coursebuild.core.pages.html_tree import HtmlContent, HtmlElement, parse_html, to_html, to_xml
from coursebuild.core.pages.urls import Place
from coursebuild.features.book.chapters import RewriteRules, rewrite
from coursebuild.features.book.epub import xml_id
from support.hostile_html import PAGES

PAGE = Place("lessons/1.1-one.html")


def picture(path: str) -> str:
    return f"in-book/{path}" if path.endswith(".png") else ""


def link(path: str, anchor: str) -> str:
    return f"to:{path}#{anchor}" if path.startswith("lessons/") else ""


BOOK = RewriteRules(PAGE, link, picture, xml_id)
WHOLE = RewriteRules(
    PAGE,
    link,
    picture,
    "1.1--{}".format,
    heading_shift=2,
    closed_classes=frozenset({"answer"}),
    section="1.1",
)


def xml(html: str) -> str:
    return to_xml(rewrite(parse_html(html), BOOK))


def html_for_page(html: str) -> str:
    return to_html(rewrite(parse_html(html), WHOLE))


@given(PAGES)
def test_any_html_becomes_well_formed_and_runs_nothing(html: str) -> None:
    ElementTree.fromstring(f"<body>{xml(html)}</body>".encode())
    for element in walk(parse_html(html_for_page(html))):
        assert element.name not in ("script", "button")
        assert not any(name.startswith("on") for name in element.attributes)


def walk(content: Iterable[HtmlContent]) -> Iterator[HtmlElement]:
    for child in content:
        if isinstance(child, HtmlElement):
            yield child
            yield from walk(child.children)


def test_rewriting_html() -> None:
    cases = [
        ("<h2 id=a>A</h2>", '<h4 id="1.1--a">A</h4>'),
        ("<h6>A</h6>", "<h6>A</h6>"),
        ("<xmp><b></xmp><plaintext><b>", "<pre>\n&lt;b&gt;</pre><pre>\n&lt;b&gt;</pre>"),
        ('<a href="#a">b</a>', '<a href="#1.1--a">b</a>'),
        ('<a href="1.2-two.html#c">b</a>', '<a href="to:lessons/1.2-two.html#c">b</a>'),
        ('<a href="../files/x.csv">b</a>', "<a>b</a>"),
        ('<a href="https://e.org/#a">b</a>', '<a href="https://e.org/#a">b</a>'),
        ("<a href='//['>b</a>", '<a href="//[">b</a>'),
        ('<a href="b%20c.html#%C3%A9">b</a>', '<a href="to:lessons/b c.html#é">b</a>'),
        ('<a href="../lessons/">b</a>', '<a href="to:lessons/index.html#">b</a>'),
        ('<a href="../../out.html">b</a>', '<a href="../../out.html">b</a>'),
        ('<a href="mailto:a@b">b</a>', '<a href="mailto:a@b">b</a>'),
        ('<a href="?q">b</a>', '<a href="?q">b</a>'),
        ('<p aria-labelledby="a b">', '<p aria-labelledby="1.1--a 1.1--b"></p>'),
        ('<section aria-label="S">', '<section aria-label="S, 1.1"></section>'),
        ("<details><p>s</p></details>", '<details open=""><p>s</p></details>'),
        ('<details class="answer">', '<details class="answer"></details>'),
        ('<img src="a.png" alt="x" loading="lazy">', '<img src="in-book/lessons/a.png" alt="x">'),
        ('<img src="a.avif" alt="&lt;x">', "&lt;x"),
        ('<img src="https://e.org/a.png" alt="far">', "far"),
        ('<svg><use href="#a"/><g fill="url(#b)"/></svg>',
         '<svg><use href="#1.1--a"></use><g fill="url(#1.1--b)"></g></svg>'),
        ('<b data-x="1" onclick="e()" tabindex="0" style="a">b</b>', "<b>b</b>"),
        ('<a class="anchor" href="#a">#</a><button>b</button>c', "c"),
    ]  # fmt: skip
    assert [html_for_page(html) for html, _ in cases] == [expected for _, expected in cases]


def test_rewriting_html_as_xml() -> None:
    cases = [
        ('<p id="1 é">a<br>&nbsp;&amp;\x07', '<p id="_1_20__e9_">a<br/>\xa0&amp;\ufffd</p>'),
        ("<b @x=1 y:z=2 ok=3>b</b>", '<b ok="3">b</b>'),
        ("<math><mi>x</mi></math>",
         '<math xmlns="http://www.w3.org/1998/Math/MathML"><mi>x</mi></math>'),
        ("<b<i>text</b<i>", "text"),
    ]  # fmt: skip
    assert [xml(html) for html, _ in cases] == [expected for _, expected in cases]
