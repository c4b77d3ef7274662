"""Blocks, inlines and formulas into HTML: what CommonMark's own examples do not show."""

from __future__ import annotations

import re
from html import unescape
from re import findall, sub
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from coursebuild.core.model import Document, NumberBinding, Target, Text
from coursebuild.core.pages.markup import SpecialBlock
from coursebuild.core.pages.renderer import Strings, direction, parse_strings
from coursebuild.core.pages.typography import (
    curl_apostrophes,
    glue_formulas,
    isolate_formulas,
    isolate_ltr,
    join_units,
    split_formula,
    split_quantities,
    text_html,
    unit_length,
)
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source, Span
from support.fixture_cases import fixture_tables, fixture_text
from support.plain_html import WORDS, PlainWriter
from support.rendered_course import MAP, Make

CASES = fixture_tables("markup")

KINDS = frozenset({"note"})


def parse(text: str) -> Document:
    return parse_document(Source("x.md", text), KINDS, lesson=False).value


class Writer(PlainWriter):
    """A writer whose answers show the question."""

    def __init__(self, words: Strings = WORDS, direction: Literal["", "ltr", "rtl"] = "") -> None:
        self.words, self.direction = words, direction

    def href(self, target: Target) -> str:
        return f"/{type(target).__name__}?a&b"

    def url(self, url: str) -> str:
        return f"/files/{url}"

    def math(self, tex: str) -> Markup:
        return Markup("<math>{}</math>").format(tex)

    def display(self, tex: str, start: int) -> Markup:
        return Markup("<math display>{}</math>").format(tex)

    def reference(self, target: Target) -> str:
        return "<ref>"

    def code(self, language: str, text: str) -> Markup:
        return Markup("<x-code lang='{}'>{}</x-code>\n").format(language, text)

    def binding(self, binding: NumberBinding) -> Markup:
        return Markup("<x-number>{}</x-number>").format(binding.text)

    def block(self, block: SpecialBlock) -> Markup:
        return Markup("<x-{}>\n").format(type(block).__name__.lower())


def html(text: str) -> str:
    return str(Writer().render_blocks(parse(text).blocks))


@pytest.mark.parametrize(("text", "expected"), CASES["blocks"])
def test_the_html_of_blocks_and_inlines(text: str, expected: str) -> None:
    assert html(text) == expected


def test_footnotes_and_their_references_link_to_each_other() -> None:
    text, html, notes = CASES["footnotes"]
    document = parse(text)
    assert str(Writer().render_blocks(document.blocks)) == html
    assert str(Writer().render_footnotes(document.footnotes)) == notes


def test_words_can_be_translated() -> None:
    document = parse("## A\n\nb[^x]\n\n[^x]: c\n")
    german = """[markup]
        anchor = 'Zum "Teil"'
        footnotes = "Fußnoten"
        footnote = "Nr. {number}"
    """
    writer = Writer(parse_strings(german, WORDS))
    text = writer.render_blocks(document.blocks)
    assert 'aria-label="Zum &quot;Teil&quot;"' in text and 'aria-label="Nr. 1"' in text
    assert 'aria-label="Fußnoten"' in writer.render_footnotes(document.footnotes)


def test_text_is_escaped_wherever_it_stands() -> None:
    nasty = '"><script>'
    text = f"\\<script> `{nasty}` [a](b '{nasty}') ![{nasty}](c) $\"><x$\n\n    {nasty}\n"
    page_html = html(f"{text}\n## \\<script>\n\n- \\<script>\n\n| \\<script> |\n| - |\n")
    assert "<script" not in page_html and page_html.count("&lt;script") == 8
    assert '">' not in html('[a](<b"\\>c>)').removeprefix('<p><a href="/UrlTarget?a&amp;b">')


_ESCAPES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;"})


@given(st.text(alphabet="aµ 0123.,·kgm²<>&\"'×−%°\n\u00a0", max_size=24) | st.text())
def test_text_has_its_quantities_kept_and_is_escaped(text: str) -> None:
    inlines = (Text(Span(Source("x.md", ""), 0, 0), text),)
    expected = curl_apostrophes(join_units(text)).translate(_ESCAPES)
    assert Writer(direction="ltr").inlines(inlines) == expected
    pieces = (
        (Markup(piece.translate(_ESCAPES)), is_quantity)
        for piece, is_quantity in split_quantities(join_units(text))
    )
    expected = "".join(isolate_ltr(html) if is_quantity else html for html, is_quantity in pieces)
    assert Writer(direction="rtl").inlines(inlines) == expected
    assert Writer().inlines(inlines) == text.translate(_ESCAPES)


SCRIPT = """```python file=examples/a.py
print("<one>")
```
"""
OUTPUT = fixture_text("documents/marked_output.txt")


def receipt(html: str) -> str:
    mark = re.search(
        r' class="receipt (\w+)">(?:\s*<summary>Verified</summary>\s*<p>)?(.*?)</p>', html
    )
    assert mark is not None
    return f"{mark[1]}: {mark[2]}"


def test_a_script_and_its_output_are_one_object_in_callouts_and_lists_too(make: Make) -> None:
    lines = f"{SCRIPT}\n<!-- a comment -->\n{OUTPUT}".strip().split("\n")
    for first, indent in (("> ", "> "), ("- ", "  ")):
        html = make(first + f"\n{indent}".join(lines)).html()
        assert html.count("<figure") == 1
        assert html.count("<samp>") == 1


def test_an_output_in_the_next_list_item_stays_apart_from_the_script(make: Make) -> None:
    text = "- x\n\n" + "\n".join(f"  {line}" for line in SCRIPT.split("\n"))
    text += "\n- " + "\n  ".join(OUTPUT.strip().split("\n"))
    assert make(text).html().count("<figure") == 2


@pytest.mark.parametrize(("keys", "status", "expected"), CASES["receipts"])  # fmt: skip
def test_the_receipt_of_an_output_says_how_it_was_compared(
    make: Make, keys: str, status: str, expected: str
) -> None:
    """`tests/courses/full` has the other comparisons."""
    course = make(SCRIPT + OUTPUT.replace("text", f"text{keys}"), status=status)
    assert receipt(course.html()) == expected


def test_a_keyframe_without_a_name_is_numbered(make: Make) -> None:
    assert "keyframe <code>1</code>" in make('```lab\n{"model": "box", "key": 1}\n```\n').html()


def test_code_is_folded_by_the_word_of_its_author_alone(make: Make) -> None:
    body = "".join(f"def f{i}():\n" + "    return 1\n" * 12 + "\n\n" for i in range(8))
    for word, folds in (("", 0), ("open", 0), ("figure=a.svg", 0), ("folded", 1)):
        html = make(f"```python file=examples/a.py {word}\n{body}```\n").html()
        assert (
            html.count('<details class="fold"')
            == html.count("<summary>lines 1–118</summary>")
            == folds
        )
        (code,) = findall(r"<code class=\"language-python\">(.*?)</code></pre>", html, flags=16)
        assert unescape(sub(r"</?span[^>]*>", "", code)) == body.rstrip("\n") + "\n"


def test_control_characters_of_an_output_are_shown(make: Make) -> None:
    html = make(SCRIPT + OUTPUT.replace("two", "\x1b[31mtwo\x07")).html()
    assert "␛[31mtwo␇" in html


def test_code_without_a_file_is_shown_with_its_language_escaped(make: Make) -> None:
    assert make("```sh\nls *.py\n```\n").html() == (
        '<div class="code" data-copy>\n<pre tabindex="0" role="group" aria-label="Code">'
        '<code class="language-sh">ls *.py\n</code></pre>\n</div>\n'
    )
    assert 'class="language-python"' in make("```python\nx = (\n```\n").html()
    hostile = make('```"><script>alert(1)</script>\nx\n```\n').html()
    assert "<script" not in hostile


FORMULAS = {
    "{X}": "<math><mi>x</mi></math>",
    "{Y}": "<math><mi>y</mi></math>",
    "{ROW}": "<mrow><mi>alpha</mi><mrow><mi>beta</mi></mrow><mo>=</mo></mrow>",
    "{END}": "<mrow><mi>gamma</mi><mo>+</mo><mn>123456</mn></mrow>",
}


def filled(text: str) -> str:
    for name, formula in FORMULAS.items():
        text = text.replace(name, formula)
    return text


def test_a_long_formula_is_cut_between_its_outermost_rows() -> None:
    """Short, displayed and open ones stay whole."""
    for mathml, expected in CASES["pieces"]:
        assert split_formula(filled(mathml)) == filled(expected)


def test_formulas_keep_their_punctuation_and_operators_their_space() -> None:
    for html, expected in CASES["punctuation"] + CASES["operators"]:
        assert glue_formulas(filled(html)) == filled(expected)


def test_pieces_of_a_formula_follow_from_the_left_in_text_from_the_right() -> None:
    box = '<span class="formula-inline" tabindex="0">{Y}</span>'
    for html, expected in {
        "x {X}{Y}.": 'x <span class="held">\u2066{X}</span><span class="held">{Y}\u2069.</span>',
        f"{{X}}{box} y": f'<span class="held">\u2066{{X}}</span>{box}\u2069 y',
        f"x {{X}} y {{Y}}, {box} y": f'x {{X}} y <span class="held">{{Y}},</span> {box} y',
    }.items():
        assert glue_formulas(isolate_formulas(filled(html))) == filled(expected)


LANGUAGES = {
    "rtl": "ar ar-EG AR he iw fa fa-IR ur yi ps sd ug dv ckb ks az-Arab uz-Arab-AF en-Hebr pa-PK"
    " nqo syr ku-IQ",
    "ltr": "en de pt-BR zh-Hant az pa ku uz ur-Latn ar-Latn ks-Deva sr-Cyrl xx en-x-arab"
    " de-u-nu-arab tr mt so",
}


@pytest.mark.parametrize("side", LANGUAGES)
def test_the_direction_of_a_language_is_that_of_its_script(side: str) -> None:
    assert [code for code in LANGUAGES[side].split() if direction(code) != side] == []


def test_numbers_keep_their_units() -> None:
    for text, expected in CASES["units"]:
        assert join_units(text) == expected


@pytest.mark.parametrize(("text", "expected"), CASES["quantities"])
def test_quantities_in_text_from_the_right(text: str, expected: list[str]) -> None:
    pieces = list(split_quantities(text))
    assert [piece for piece, is_quantity in pieces if is_quantity] == expected
    assert "".join(piece for piece, _ in pieces) == text


@given(st.text(alphabet="0123456789.,-+−×^ kgms²/°%بة\u00a0<&"))
def test_finding_quantities_loses_no_character(text: str) -> None:
    assert "".join(piece for piece, _ in split_quantities(text)) == text
    assert join_units(text).replace("\u00a0", " ") == text.replace("\u00a0", " ")
    assert 0 <= unit_length(text) <= len(text)

    for side in ("ltr", "rtl"):
        html = str(text_html(text, side))
        expected = join_units(text) if side == "rtl" else curl_apostrophes(join_units(text))
        assert unescape(re.sub("</?bdi[^>]*>", "", html)) == expected


def test_apostrophes_of_prose_are_curly_and_other_quotes_stay() -> None:
    def draw(markdown: str, direction: Literal["", "ltr", "rtl"] = "ltr") -> str:
        return Writer(direction=direction).render_blocks(parse(markdown).blocks).strip()

    for markdown, expected in {
        "the viewer's, don't, O'Brien, м'яч": "the viewer’s, don’t, O’Brien, м’яч",
        "l'*eau* de l'`arm`, l'$x$": "l’<em>eau</em> de l’<code>arm</code>, l’<math>x</math>",
        "*arm*'s and\nthe `arm`'s": "<em>arm</em>’s and\nthe <code>arm</code>’s",
        "the 'arm', 'a *b*' and *'c'*": "the 'arm', 'a <em>b</em>' and <em>'c'</em>",
        "5'10, 5', the arms' end": "5'10, 5', the arms' end",
        "word'\n'word": "word'\n'word",
        "`don't` $f'g$": "<code>don't</code> <math>f&#39;g</math>",
        "[don't](x \"don't\")": '<a href="/UrlTarget?a&amp;b" title="don\'t">don’t</a>',
    }.items():
        assert draw(markdown) == f"<p>{expected}</p>"
    assert draw("ג'ירפה", "rtl") == "<p>ג'ירפה</p>"


def test_pages_say_their_direction_and_hold_numbers_and_units_together(make: Make) -> None:
    hebrew = MAP.replace('"en"', '"he"').replace("A body falls.", "-3 m")
    course = make("It is $x$ kg and $y$ kilos.", course=hebrew)
    page = course.site()["lessons/0.1-falling.html"].decode()
    assert '<html lang="he" dir="rtl" ' in page
    assert '<p class="lead"><bdi dir="ltr">-3\u00a0m</bdi></p>' in page
    math = '<math class="inline"><mi>x</mi></math>'
    assert f'<bdi dir="ltr">{math}\u00a0kg</bdi> and ' in course.html()
    assert course.html().count("<bdi") == 1
    assert f"{math}\u00a0kg and " in make("It is $x$ kg and $y$ kilos.").html()
