"""Blocks and inlines into HTML: what CommonMark's own examples do not show."""

from __future__ import annotations

from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from coursebuild.core.model import Document, NumberBinding, Target, Text
from coursebuild.core.pages.markup import SpecialBlock
from coursebuild.core.pages.quantities import isolate_ltr, join_units, split_quantities
from coursebuild.core.pages.strings import Strings, parse_strings
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source, Span
from support.plain_html import WORDS, PlainWriter

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


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            '## A "b" & *c* {#x .wide}',
            '<h2 id="x" class="wide">A &quot;b&quot; &amp; <em>c</em> '
            '<a class="anchor" href="#x" aria-label="Link to this section">#</a></h2>\n',
        ),
        (
            "## Übung",
            '<h2 id="übung">Übung <a class="anchor" href="#%C3%BCbung" '
            'aria-label="Link to this section">#</a></h2>\n',
        ),
        ("[a](lesson:1.1 't\"')", '<p><a href="/LessonTarget?a&amp;b" title="t&quot;">a</a></p>\n'),
        ("Level 3", '<p><a href="/LevelTarget?a&amp;b">Level 3</a></p>\n'),
        (
            "![a \"b\"](c.png 'd')",
            '<p><img src="/files/c.png" alt="a &quot;b&quot;" title="d"></p>\n',
        ),
        ("~~a~~", "<p><del>a</del></p>\n"),
        (
            "<img src=a.png srcset='b.png 2x, c.png'> <video poster=\"d&amp;e.png\"></video>",
            "<p><img src=/files/a.png srcset='/files/b.png 2x, /files/c.png'> "
            '<video poster="/files/d&amp;e.png"></video></p>\n',
        ),
        (
            "<object data='a.svg'>\n<a href='a.svg'>\n",
            "<object data='/files/a.svg'>\n<a href='a.svg'>\n",
        ),
        ("<b>&amp;</b>\n", "<p><b>&amp;</b></p>\n"),
        ("- a\n  - b\n- c", "<ul>\n<li>a\n<ul>\n<li>b</li>\n</ul>\n</li>\n<li>c</li>\n</ul>\n"),
    ],
)
def test_the_html_of_blocks_and_inlines(text: str, expected: str) -> None:
    assert html(text) == expected


def test_a_table_is_framed_and_aligned() -> None:
    assert html("| a | b | c |\n| - | -: | :-: |\n| *1* | 2 |\n") == (
        '<div class="table" role="group" aria-label="Table" tabindex="0">\n'
        '<table>\n<thead>\n<tr>\n<th scope="col">a</th>\n'
        '<th scope="col" class="align-right">b</th>\n'
        '<th scope="col" class="align-center">c</th>\n</tr>\n</thead>\n<tbody>\n<tr>\n'
        '<td><em>1</em></td>\n<td class="align-right">2</td>\n<td class="align-center"></td>\n'
        "</tr>\n</tbody>\n</table>\n</div>\n"
    )


def test_a_task_list_has_labelled_boxes() -> None:
    assert html("- [ ] a\n- [x] b\n- c\n") == (
        '<ul class="task-list">\n'
        '<li><input type="checkbox" disabled aria-label="Not done"> a</li>\n'
        '<li><input type="checkbox" disabled checked aria-label="Done"> b</li>\n'
        "<li>c</li>\n</ul>\n"
    )


def test_footnotes_and_their_references_link_to_each_other() -> None:
    document = parse("a[^x] b[^y] c[^x]\n\n[^x]: *One*.\n[^y]: - item\n")
    assert str(Writer().render_blocks(document.blocks)) == (
        '<p>a<sup class="footnote-ref"><a href="#fn:1" id="fnref:1" role="doc-noteref"'
        ' aria-label="Footnote 1">1</a></sup> b<sup class="footnote-ref"><a href="#fn:2"'
        ' id="fnref:2" role="doc-noteref" aria-label="Footnote 2">2</a></sup> c'
        '<sup class="footnote-ref"><a href="#fn:1" id="fnref:1:2" role="doc-noteref"'
        ' aria-label="Footnote 1">1</a></sup></p>\n'
    )
    assert str(Writer().render_footnotes(document.footnotes)) == (
        '<section class="footnotes" role="doc-endnotes" aria-label="Footnotes">\n<ol>\n'
        '<li id="fn:1">\n<p><em>One</em>. <a href="#fnref:1" class="footnote-back"'
        ' role="doc-backlink" aria-label="Back to reference 1">↩</a> <a href="#fnref:1:2"'
        ' class="footnote-back" role="doc-backlink"'
        ' aria-label="Back to reference 1, place 2">↩<sup>2</sup></a></p>\n</li>\n'
        '<li id="fn:2">\n<ul>\n<li>item</li>\n</ul>\n<p><a href="#fnref:2" class="footnote-back"'
        ' role="doc-backlink" aria-label="Back to reference 2">↩</a></p>\n</li>\n'
        "</ol>\n</section>\n"
    )


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
    expected = join_units(text).translate(_ESCAPES)
    assert Writer(direction="ltr").inlines(inlines) == expected
    pieces = (
        (Markup(piece.translate(_ESCAPES)), is_quantity)
        for piece, is_quantity in split_quantities(join_units(text))
    )
    expected = "".join(isolate_ltr(html) if is_quantity else html for html, is_quantity in pieces)
    assert Writer(direction="rtl").inlines(inlines) == expected
    assert Writer().inlines(inlines) == text.translate(_ESCAPES)
