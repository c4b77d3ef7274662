"""HTML is read as browsers read it, and what is written says the same."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.pages.html_tree import HtmlElement, parse_html, to_html, to_xml
from support.hostile_html import PAGES


@pytest.mark.parametrize(
    ("html", "expected"),
    [
        ("<p>a<p>b", "<p>a</p><p>b</p>"),
        ("<table><tr><td>1<td>2", "<table><tbody><tr><td>1</td><td>2</td></tr></tbody></table>"),
        ("<b>a<i>b</b>c</i>", "<b>a<i>b</i></b><i>c</i>"),
        ("<table>out<tr><td>in", "out<table><tbody><tr><td>in</td></tr></tbody></table>"),
        ("&lt;&amp;&nbsp;<!-- c -->", "&lt;&amp;\xa0"),
        ("</body></html>a<body onload=x><title>b", "a<title>b</title>"),
        ('<svg viewBox="0" xlink:href="#"><path/></svg>',
         '<svg viewBox="0" xlink:href="#"><path></path></svg>'),
        ("<script>a<b</script>", "<script>a<b</script>"),
        ("<pre>\n\na</pre>", "<pre>\n\na</pre>"),
        ("\x00\ud800<p title='\"&'>", "?<p title=\"&quot;&amp;\"></p>"),
    ],
)  # fmt: skip
def test_html_is_read_as_by_a_browser(html: str, expected: str) -> None:
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
