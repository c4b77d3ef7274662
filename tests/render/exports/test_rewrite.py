"""The HTML of a lesson in another place: well-formed XML, ids of its own, links put in later."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.render.exports.addresses import filled, site_path, xml_id
from coursebuild.render.exports.cut import Cut
from coursebuild.render.exports.rewrite import Rewriter, Rules
from coursebuild.render.exports.tags import VOID, End, Start, pieces, read
from coursebuild.render.formulas import Woven
from coursebuild.render.mathml import is_ours
from coursebuild.render.settling import settle_with

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


PAGES = st.lists(PIECES, max_size=20).map("".join)
OURS = st.sampled_from(
    """a b|&lt;|&amp;|&#x27;|>|<span class="k">for</span>|<span class="k">|</span>
<span class="x">a &gt; b</span>|<span class="qr">c</span>|<span class="held">(</span>|\r|\0|\ud800
<code>a &lt; b</code>|<code>|</code>|<em>a</em>|<strong>&amp;</strong>|<\u017foo>
<span id="c.L1">a <span class="k">b</span> &lt;</span>|<span id="1">a</span>|<span id="é">
<math><mi>x</mi></math>|<math display="block" class="tml-display s0123abc"><mn>1</mn></math>
<math><mrow><mo fence="true" form="prefix">(</mo><mspace width="1em"/></mrow>&lt;</math>
<math>|</math>|<mi>|</mi>|<mrow>|</mrow>|<math><mi></math>|<math></mi></math>|<mspace/>
<math><mi form="a" form="b">x</mi></math>|<math><mi style="a">x</mi></math>|<math>&nbsp;</math>
<math><mi class="qr">x</mi></math>|<math><mi id="a">x</mi></math>|<textarea><p></textarea>
<!-- <math><mi> -->|<![CDATA[ > <math> ]]>|<TITLE>a<b</Title>|<title/>|<svg><title>b</title></svg>
<P TITLE='>'>|</P>|<p title=a>|<IMG SRC=a.png>|<h2 ID=x>|</h2>|<p|<p title='|<svg class=qr>|</svg>
<section aria-label=a>|</section>|<a href='1.2-two.html#c'>|</a>|<details class=answer>|</details>
<h2 id="a">|<h2 id="b c">|<h2 class="d" id="1" title="é">|<a class="qr" href="#a">|<p id="">
<a class="b" href="1.2-two.html#c" aria-label="d">|<a class="b" href="#c" aria-label="d">
<a href="">|<section id="s" aria-label="a">|<img id="i" src="b.avif">
<details class="answer" id="d">|<1 id="a">|<a name="n" href="x:y">|<i id="a>b">|<i id="<">
<button id="x">|<textarea id="t">|<svg id="v">|<use href="#a" xmlns="b">|<image href="a.png">
<x-y id="a">|<i id="a" id="b">|<i id="own.">|<i own.="" id="a">|<br id="f">
<button>|</button>|\n""".replace("\n", "|").split("|")
)
ALL = st.lists(st.one_of(OURS, PIECES), max_size=20).map("".join)


@given(st.one_of(PAGES, ALL))
def test_whatever_is_written_becomes_well_formed(html: str) -> None:
    ElementTree.fromstring(f"<body>{xml(html)}</body>".encode("utf-8", "replace"))


class Slowly(Rewriter):
    """Looks at every tag, and remembers nothing: what a rewriter is to write."""

    def text(self, html: str) -> str:
        """The whole."""
        left_out: list[str] = []
        for piece in pieces(html):
            known = self._written((piece,))
            if left_out:
                if isinstance(piece, Start) and piece.name not in VOID and not piece.closed:
                    left_out.append(piece.name)
                elif isinstance(piece, End) and piece.name in left_out:
                    while left_out.pop() != piece.name:
                        pass
            elif isinstance(piece, str):
                self._out.append(known[2])
            elif isinstance(piece, End):
                self._end(piece.name)
            elif self._is_left_out(piece):
                left_out += [] if piece.name in VOID or piece.closed else [piece.name]
            else:
                self._begin(piece, known)
        while self._open:
            self._shut()
        return "".join(self._out)

    def _begin(self, start: Start, known: tuple[int, str, str, tuple[str, ...]]) -> None:
        for ended in known[3]:
            if self._open and self._open[-1] == ended:
                self._shut()
        self._out.append(known[2])
        written = re.match("<[a-z]", known[2], re.IGNORECASE)
        if written and start.name not in VOID and not start.closed:
            self._open.append(start.name)


RULES = (
    BOOK,
    Rules(PAGE, xml=True, pictures=frozenset({"png"}), without=frozenset({"qr"})),
    Rules(
        PAGE, prefix="_1.1--", down=2, part="1.1", opened=lambda start: start.get("class") is None
    ),
    Rules(PAGE, prefix="1é ", xml=True),
    Rules(PAGE),
)


@settings(max_examples=150)
@given(st.sampled_from(RULES), ALL)
def test_runs_are_what_their_tags_become(rules: Rules, html: str) -> None:
    slowly, fast = Slowly(rules), Rewriter(rules)
    assert fast.text(html) == slowly.text(html)


@settings(max_examples=150)
@given(st.sampled_from(RULES), ALL, st.sampled_from(("", "\x01", "<h1>&lt;</h1>\n<p>")))
def test_formulas_that_were_settled_are_what_their_tags_become(
    rules: Rules, html: str, before: str
) -> None:
    woven = settle_with(html, html)[1]
    whole = Woven((before + woven.texts[0], *woven.texts[1:]), woven.formulas)
    slowly, fast = Slowly(rules), Rewriter(rules)
    assert fast.of(Cut(whole)) == slowly.text(whole.html)


@given(ALL)
def test_a_cut_text_is_whole(html: str) -> None:
    for woven in (Woven((html,)), settle_with(html, html)[1]):
        cut = Cut(woven)
        runs = cut.moved("", xml=False)
        whole = "".join(run + mark for run, mark in zip(runs, cut.marks, strict=True))
        assert whole == woven.html


@pytest.mark.parametrize(
    "html",
    [
        '<span class="k">for</span> a &lt; b',
        '<span id="code.L1"><span class="f">a</span> <span class="n">1</span></span>',
        "<math><mrow><mi>x</mi><mo>=</mo><mn>1</mn></mrow></math>",
        '<math display="block" class="tml-display"><mspace width="1em"></mspace></math>',
        'a <math><mi>x</mi></math> <em>b</em> <math><mtd class="s0123abc"></mtd></math>',
    ],
)
def test_what_is_the_same_everywhere_goes_in_one_run(html: str) -> None:
    cut = Cut(settle_with(html, html)[1])
    assert ("".join(cut.moved("", xml=False)), "".join(cut.marks)) == (html, "")


@pytest.mark.parametrize(
    "formula",
    [
        *(">", "><mi>x</mi>", "><mtext>a &lt; b</mtext>", "><mspace/>", "><mi></mi>é"),
        ' display="block" class="tml-display s0123abc"><mtd class="tml-eqn"></mtd>',
    ],
)
def test_formulas_that_are_ours(formula: str) -> None:
    assert is_ours(formula)


@pytest.mark.parametrize(
    "formula",
    [
        *("><mi>", "></mi>", "><mi></mo>", "><mi/ >", "></mi/>", '><mi form="a" form="b"></mi>'),
        *('><mi id="a"></mi>', '><mi href="a"></mi>', '><mi style="a"></mi>', "><mi form></mi>"),
        *(
            ">&nbsp;",
            ">&",
            "><b></b>",
            "><svg/>",
            ">\r",
            ">\x01",
            ">\ufffe",
            ">\ud800",
            "><!-- -->",
        ),
        *("", "><math></math>", '><mi class="qr"></mi>', ' id="a">', "></math>", "></math><math>"),
    ],
)
def test_formulas_that_are_not(formula: str) -> None:
    assert not is_ours(formula)


def test_formulas_that_do_not_fit_are_read_tag_by_tag() -> None:
    html = "<math><mi>x</math><math><mn>1</mn></math>"
    assert xml(html).count("</mi>") == 1
    ElementTree.fromstring(f"<p>{xml(html)}</p>")


def test_what_looks_like_a_tag_is_text() -> None:
    assert xml("<div><\u017foo> <\u212a></div>") == "<div>&lt;\u017foo&gt; &lt;\u212a&gt;</div>"


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
def test_html_written_as_xml(html: str, expected: str) -> None:
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
def test_ids_links_and_headings_among_other_lessons(html: str, expected: str) -> None:
    assert moved(html) == expected


def test_what_is_left_out_takes_what_is_in_it_along() -> None:
    rules = Rules(PAGE, xml=True, without=frozenset({"qr"}))
    html = 'a<svg class="x qr"><g><svg/><path d="M0"></path></g></svg>b<button><p>c</button>d'
    assert Rewriter(rules).text(html) == "abd"


@pytest.mark.parametrize("rules", [BOOK, Rules(PAGE, down=2)])
def test_characters_of_icons_are_text(rules: Rules) -> None:
    """Icon fonts have theirs where those lie that open and shut a slot."""
    html = '<p>A \ue000 b <b>c</b> <a href="1.2-b.html">d</a> \ue001 \ue000 e</p>'
    text = filled(Rewriter(rules).text(html), lambda path, anchor, shown: "x")
    assert text == '<p>A \ue000 b <b>c</b> <a href="x">d</a> \ue001 \ue000 e</p>'


@pytest.mark.parametrize("name", ["xlink:href", "xml:lang", "odd:name"])
def test_a_name_with_a_prefix_and_no_value_is_left_out_of_xml(name: str) -> None:
    text = Rewriter(BOOK).text(f"<p {name}>a</p>")
    assert text == "<p>a</p>"
    ElementTree.fromstring(text)


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
        ("http://[x", (None, "")),
    ],
)
def test_the_site_path_of_an_address(url: str, expected: tuple[str | None, str]) -> None:
    assert site_path(PAGE, url) == expected


@given(st.text(min_size=1), st.text(min_size=1))
def test_ids_of_xml_are_names_and_differ(a: str, b: str) -> None:
    assert re.fullmatch(r"[A-Za-z_][A-Za-z0-9_.-]*", xml_id(a))
    assert a == b or "_" in a + b or xml_id(a) != xml_id(b)


NAMES = st.sampled_from("a|p|title|textarea|svg|x1|h-1|script|A|br".split("|"))
ATTRIBUTES = st.sampled_from(
    (
        *' a="b"| a="c"| b=""| c|  d="e"| e-f="g h"| -="x"| 1="x"| a="&lt;"| a="&"'.split("|"),
        *' a="<>"| a=b| A="b"| a=""x"| /|/| a = "b"| href="x/"|\tz="y"| a="\n"|\n'.split("|"),
        " a='b'",
    )
)


@settings(max_examples=150)
@given(name=NAMES, attributes=st.lists(ATTRIBUTES, max_size=4).map("".join))
def test_a_blank_before_the_end_of_a_tag_changes_nothing(name: str, attributes: str) -> None:
    """Though a tag without one is mostly read in a quicker way."""
    (close, *rest), loose = read(f"<{name}{attributes}>"), read(f"<{name}{attributes} >")
    assert [close, *rest] == [*loose] or {type(close), *map(type, loose)} == {str}
