"""A page is settled piece by piece as it would be as a whole, each question by itself."""

from __future__ import annotations

import re
import sys

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from markupsafe import Markup

from coursebuild.core.pages import characters, formulas, postprocess
from coursebuild.core.pages.postprocess import postprocess_html

FORMULAS = (
    *("<math><mi>x</mi></math>", '<math display="block"><mi>α</mi></math>'),
    *("<math><mo>=</mo><mn>2</mn></math>", "<math><mn>2</mn><mo>&lt;</mo></math>"),
    '<math><mtd style="padding: 0" class="a"/><mi id="m" href="#n">ẋ</mi></math>',
    '<math><semantics><mrow><mo>−</mo></mrow><annotation a="b">-</annotation></semantics></math>',
)
BROKEN = ("<math><mtext>\u0085</mtext></math>", "<mathx>", "<math>", "</math>", "<math", "<mo>")
TEXTS = (
    *(" ", "\n", "(", "“", "”,", ".", "…", "é", "∂", "a b", "\u00a0m", "\u00a0kg", "x > y", "&"),
    *("&am", "p;", "&amp;", "&notit;", "&#955;", "&#x3bb", "&amp", "&#955", "\x00", "\ufdd0", "\r"),
    *("\U0001d465", "\U0002fffe", "🙂", '"', "'", ' id="no"', ' style="no"', "-->", "</", "<"),
)
TAGS = (
    *('<p id="a&amp;b">', "</p>", '<a href="x.html#y">', "<br>", "<hr />", "<p id>", "<p id=''>"),
    *('<b style="color: red">', "<b style>", '<b title=" id=" id="b">', '<b id="">', "</b\n>"),
    *('<img src="a.png" srcset="b.png 2x, c.png" alt="é">', '<a name="n" href="?q=1&amp;r=2">'),
    *('<span id="x.L12">', '<a class="u" id="i" href="#é" style="a: b">', "<a name>", "<B ID='x'>"),
    *('<b title="\x07">', '<b title="a>b">', "<!-- a - b -->", "<!--", '<!-- style="x" -->'),
    *("<title>", "</title>", '<title id="t">a</title>', '<title style="a: b">a</title>', "<xmp>"),
    *("<script>", "</script>", '<svg viewBox="0 0 1 1">', '<svg viewbox="" hidden>', "<iframe>"),
    *('<video poster="p.png" src="v&amp;w" />', '<object data="d" name="no">', '<i data="no" id>'),
    *('<b class="held" Href="x">', "<b  id>", '<b\nid="x">', '<b id="x"title="y">', "<b/>"),
)
PAGES = st.lists(st.sampled_from((*FORMULAS, *BROKEN, *TEXTS, *TAGS)), max_size=12).map("".join)


@given(PAGES)
@example('<a <math><mi>x</mi></math> id="no">')
@example("<b style><math><mi>x</mi></math>")
@example("</ <math></math>b title='<'>")
@example('</ style="no"')
def test_a_page_is_settled_as_by_looking_closely(html: str) -> None:
    assert postprocess_html(html) == postprocess._closely(html)


@given(PAGES)
@example("a <math><mi>x</mi></math>, b")
def test_html_of_templates_is_settled_as_any_text(html: str) -> None:
    """What is put into `Markup` would be escaped."""
    made = postprocess_html(Markup(html))
    assert made == postprocess_html(html)
    assert type(made.html) is str


@given(st.text() | st.text(alphabet="<>/=\"' bidstyle-!&;#\n\u00a0m", max_size=60))
def test_any_text_is_settled(html: str) -> None:
    assert postprocess_html(html) == postprocess._closely(html)


@given(st.lists(st.sampled_from((*FORMULAS, *TEXTS)), max_size=14).map("".join))
def test_formulas_are_glued_piece_by_piece_as_in_the_whole(html: str) -> None:
    cut = formulas.cut(html)
    assert cut is not None
    texts, inside = cut
    beside = zip(texts, inside, texts[1:], strict=False)
    tight = [
        formulas.tight(one, before=before[-1:].isspace(), after=after[:1].isspace())
        for before, one, after in beside
    ]
    first, *others = formulas.kept_together(texts, inside)
    woven = (f"<math{one}</math>{text}" for one, text in zip(tight, others, strict=True))
    assert first + "".join(woven) == formulas.glue(html)


@pytest.mark.parametrize("html", [*FORMULAS, *TAGS[:5], *TAGS[7:8], *TAGS[12:15], "é &lt;"])
def test_such_pages_are_looked_at_once(html: str) -> None:
    assert postprocess._quickly(f"<p>{html}</p>") is not None


def test_a_long_page_is_looked_through_once() -> None:
    """With something left to look at after the last thing that counts, at each place."""
    html = '<b title="x">a &gt; b</b> &amp; λ' * 40_000
    assert postprocess._quickly(html) is not None
    assert postprocess._quickly(html + "<") is None


def test_classes_that_say_what_is_forbidden_say_what_is_allowed() -> None:
    every = "".join(map(chr, range(sys.maxunicode + 1)))
    wide = "\u00a0-\ud7ff\ue000-\ufdcf\ufdf0-\ufffd\U00010000-\U0001fffd"

    def of(found: list[str]) -> str:
        return "".join(found)

    allowed = re.findall(f"[{wide}]", every)
    assert of(postprocess._ALLOWED.findall(every)) == of(allowed)
    allowed = re.findall(f"[\t\n -~{wide}]", every)
    assert of(characters._ALLOWED.findall(every)) == of(allowed)
    allowed = re.findall(f"[\t\n -!#-;=?-~{wide}]", every)
    assert of(re.findall(postprocess._TEXT, every)) == of(allowed)
