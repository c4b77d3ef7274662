"""HTML converted to what QTI allows: whatever it is, the result is valid and keeps the words."""

from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from coursebuild.core.pages.xml import Element, element, markup
from coursebuild.features.qti.flow import Flow
from support.archives import formula_mistakes
from support.hostile_html import HOSTILE
from support.qti_rules import MATHML, QTI, mistakes

TAGS = (
    "a abbr b blockquote br button caption code dd del details div dl dt em figure form h3 hr img"
    " input li math mi mo mrow mtable mtd mtr ol p pre ruby rt script span sub sup summary svg"
    " table tbody td tfoot th thead tr u ul video"
).split()
ATTRIBUTES = ("", " class='anchor'", " start=3", " colspan=2 rowspan='x'", " href='x'", " lang=de",
              " src='a.png' alt='&lt;'", " type=checkbox checked", " title='t'", " display=block",
              " style='color:#f00;border:1px'")  # fmt: skip
PIECES = st.one_of(
    st.builds("<{}{}>".format, st.sampled_from(TAGS), st.sampled_from(ATTRIBUTES)),
    st.builds("</{}>".format, st.sampled_from(TAGS)),
    st.builds("<{}/>".format, st.sampled_from(TAGS)),
    st.sampled_from(
        ["<table><tr>", "<table><thead><tr><th>", "<ul><li>", "<dl><dt>", "<pre><code>"]
    ),
    st.sampled_from(["words", " ", "\n", "&amp;", "&lt;b&gt;", "&#0;", "\x0b", "\ufffe", "<", "é"]),
)


def flow() -> Flow:
    return Flow(
        lambda address: address if address.startswith("https:") else None,
        lambda address: f"../{address}" if address.endswith(".png") else None,
    )


def item(flow: Flow, html: str) -> bytes:
    """An item in which a text stands wherever one may stand."""
    blocks = [markup(flow.blocks(html)) for _ in range(4)]
    choice = markup([element("simpleChoice", {"identifier": "A"}, *flow.line(html))])
    return f"""\
<assessmentItem xmlns="{QTI}" xmlns:m="{MATHML}" identifier="a" title="t" adaptive="false"
 timeDependent="false">
<responseDeclaration identifier="RESPONSE" cardinality="single" baseType="identifier"/>
<outcomeDeclaration identifier="F" cardinality="single" baseType="identifier"/>
<itemBody>{blocks[0]}<infoControl title="Hint">{blocks[1]}</infoControl>
<rubricBlock view="scorer">{blocks[2]}</rubricBlock>
<choiceInteraction responseIdentifier="RESPONSE" shuffle="false" maxChoices="1">{choice}
</choiceInteraction></itemBody>
<modalFeedback outcomeIdentifier="F" identifier="A" showHide="show">{blocks[3]}</modalFeedback>
</assessmentItem>""".encode()


def check(html: str) -> Flow:
    converter = flow()
    data = item(converter, html)
    assert mistakes(data) == [], html
    return converter


def test_hostile_html_becomes_a_valid_item() -> None:
    for html in HOSTILE:
        check(html)


@given(st.lists(PIECES, max_size=14).map("".join) | st.text())
def test_any_text_becomes_a_valid_item(html: str) -> None:
    check(html)


def blocks(html: str) -> str:
    return "".join(
        re.sub(r' xmlns:m="[^"]*"', "", etree.tostring(node, encoding="unicode"))
        for node in (etree.fromstring(bare(block)) for block in flow().blocks(html))
    )


def bare(node: Element) -> bytes:
    data = markup([node]).encode()
    declaration = rb'\1 xmlns:m="http://www.w3.org/1998/Math/MathML"'
    return re.sub(rb"(<[a-z:0-9]+)", declaration, data, count=1)


def test_html_becomes_the_nearest_that_qti_allows() -> None:
    cases = [
        ("plain", "<p>plain</p>"),
        ("  ", ""),
        ("a<p>b</p>c", "<p>a</p><p>b</p><p>c</p>"),
        ("<p>one<p>two", "<p>one</p><p>two</p>"),
        ("<ul><li>a<ul><li>b</ul><li>c</ul>",
         "<ul><li><p>a</p><ul><li>b</li></ul></li><li>c</li></ul>"),
        ("<pre><code>a <span class='k'>if</span>\n  b\n\n</code></pre>",
         "<pre><code>a if\n  b</code></pre>"),
        ("<table><tr><td>1<td>2<tr><th scope=row>3</table>",
         '<table><tbody><tr><td>1</td><td>2</td></tr><tr><th scope="row">3</th></tr></tbody>'
         "</table>"),
        ("<table><thead><tr><th>h</table>", "<table><tbody><tr><th>h</th></tr></tbody></table>"),
        ("<abbr title='centre of mass'>CoM</abbr>", "<p><abbr>CoM</abbr> (centre of mass)</p>"),
        ("<a href='https://a.org/?x=1&amp;y'>out</a>",
         '<p><a href="https://a.org/?x=1&amp;y">out</a></p>'),
        ("<mark>m</mark><u>u</u>", "<p><em>m</em><em>u</em></p>"),
        ("<table>loose<tr>more<td>1</td></tr><p>p</p></table>",
         "<p>loosemore</p><p>p</p><table><tbody><tr><td>1</td></tr></tbody></table>"),
        ("<table><caption>a</caption><caption>b</caption><td>1</table>",
         "<p>a</p><p>b</p><table><tbody><tr><td>1</td></tr></tbody></table>"),
        ("<table><tfoot><tr><td>f</tfoot><thead><tr><td>h</thead><tr><td>b</table>",
         "<table><thead><tr><td>h</td></tr></thead><tbody><tr><td>b</td></tr><tr><td>f</td></tr>"
         "</tbody></table>"),
        ("<h2>a<div>b</div></h2><ul>c<li>d</ul>", "<h2>ab</h2><ul><li>c</li><li>d</li></ul>"),
        ("<dl><dt>t<dd>d</dl>", "<dl><dt>t</dt><dd>d</dd></dl>"),
        ("<b>bold</i> on</b>", "<p><b>bold on</b></p>"),
        ("<math><mrow><mi>x</mi></mrow></math><span><math><mo>=</mo></math></span>",
         "<p><m:math><m:mrow><m:mi>x</m:mi></m:mrow><m:mo>=</m:mo></m:math></p>"),
        ("<math><semantics><mrow><mi>x</mi></mrow><annotation>x</annotation></semantics></math>",
         "<p><m:math><m:mrow><m:mi>x</m:mi></m:mrow></m:math></p>"),
    ]  # fmt: skip
    assert [blocks(html) for html, _ in cases] == [expected for _, expected in cases]


def test_html_that_qti_cannot_hold_is_listed_as_loss() -> None:
    cases: list[tuple[str, list[str]]] = [
        ("<video src='a'>words</video>", ["`<video>` has no place in QTI and is left out"]),
        ("<canvas></canvas><canvas></canvas>", ["`<canvas>` has no place in QTI and is left out"]),
        ("<ol start=2><li>x</ol>", ["a numbered list counts from 1"]),
        ("<ol start=1><li>x</ol>", []),
        ("<a href='b.html'>x</a>",
         ["the link to `b.html` is text, as the course has no `base_url`"]),
        ("<a href='javascript:alert(1)'>x</a>", ["the link to `javascript:alert(1)` is text"]),
        ("<img src='b.svg' alt='words'>", ["the picture `b.svg` is replaced by its words"]),
        ("<details><summary>a</summary>b</details>", ["`<details>` is open"]),
        ("<p style='color:red' onclick='x()' id=y>a</p>", []),
        ("<script>alert(1)</script><style>p{}</style><!-- no -->", []),
    ]  # fmt: skip
    assert [check(html).losses for html, _ in cases] == [losses for _, losses in cases]


@given(st.lists(PIECES, max_size=14).map("".join))
def test_any_formula_is_of_mathml(html: str) -> None:
    """Nesting as Temml gives it; what an author nests is the author's."""
    parts = flow().line("<math><mrow><mi>x</mi></mrow></math>" + html.replace("<m", "<x"))
    formulas = [part for part in parts if not isinstance(part, str) and part.tag == "m:math"]
    assert formulas
    for formula in formulas:
        assert formula_mistakes(etree.fromstring(bare(formula))) == []
