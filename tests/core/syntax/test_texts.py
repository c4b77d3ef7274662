"""Markdown inside the JSON of quizzes: HTML kept, math between tags, places in the lesson."""

from __future__ import annotations

import json

import pytest

from coursebuild.core.model import (
    Block,
    FootnoteRef,
    HtmlFlow,
    Inline,
    Link,
    Math,
    Paragraph,
    SoftBreak,
    document_inlines,
)
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Source
from coursebuild.features.quiz.model import OpenQuestion, Quiz
from support.plain_html import plain_blocks

TICKS = "```"


def read(
    text: str, before: str = "", after: str = ""
) -> tuple[tuple[Block, ...], list[Diagnostic]]:
    """The blocks of a question's text, written as JSON in a lesson."""
    question = {"kind": "open", "q": text, "reference": "R"}
    quiz = json.dumps({"id": "q", "questions": [question]}, ensure_ascii=False)
    lesson = f"{before}{TICKS}quiz\n{quiz}\n{TICKS}\n{after}"
    result = parse_document(Source("x.md", lesson), frozenset({"note"}), lesson=True)
    for block in result.value.blocks:
        if isinstance(block, Quiz):
            question_read = block.questions[0]
            assert isinstance(question_read, OpenQuestion)
            return question_read.text, list(result.diagnostics)
    return (), list(result.diagnostics)


def good(text: str) -> tuple[Block, ...]:
    blocks, diagnostics = read(text)
    assert diagnostics == []
    return blocks


def flow(text: str) -> tuple[Inline, ...]:
    (block,) = good(text)
    assert isinstance(block, HtmlFlow)
    return block.children


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("<p>a * b * c, *d*, x_1_</p>", "<p>a * b * c, *d*, x_1_</p>"),
        ("<p>\\$5 &lt;b> &nosuch; 3 < 4 $</p>", "<p>$5 &lt;b&gt; &amp;nosuch; 3 &lt; 4 $</p>"),
        (
            "<p>So $a < b$ &amp; on.</p>",
            r'<p>So <span class="math">\(a &lt; b\)</span> &amp; on.</p>',
        ),
        ("<div>$$a$$<!-- $b$ --></div>", r'<div><span class="math">\[a\]</span><!-- $b$ --></div>'),
        (
            "<p><code>$a$</code> <pre>$b$</pre> <script>'$c$ <b>'</script> $d$</p>",
            "<p><code>$a$</code> <pre>$b$</pre> <script>'$c$ <b>'</script>"
            r' <span class="math">\(d\)</span></p>',
        ),
        ("*a*\r\nb\n\n<p>*c*</p>\n\nd", "<p><em>a</em>\nb</p>\n<p>*c*</p>\n<p>d</p>"),
        ("Output:\n\n- a", "<p>Output:</p>\n<ul>\n<li>a</li>\n</ul>"),
    ],
)
def test_html_in_a_text(text: str, expected: str) -> None:
    assert plain_blocks(good(text)) == f"{expected}\n"


def test_mentions_and_line_ends_in_html() -> None:
    children = flow("<p>See Lesson\n2.2, not <a href='#x'>Lesson 2.3</a>.</p>")
    links = [child for child in children if isinstance(child, Link)]
    assert [link.target_span.text for link in links] == ["2.2"]
    assert any(isinstance(child, SoftBreak) for child in links[0].children)


def test_spans_point_into_the_json() -> None:
    (paragraph,) = good('say "a" and\n\\\\ then $\\frac{a}{b}$ and `c`')
    assert isinstance(paragraph, Paragraph)
    math = next(child for child in paragraph.children if isinstance(child, Math))
    assert math.tex.text == "\\frac{a}{b}"
    assert math.span.text == "$\\\\frac{a}{b}$"
    assert paragraph.children[-1].span.text == "`c`"


def test_links_and_footnotes_of_the_lesson_are_known() -> None:
    after = "\n[r]: lesson:1.1\n\n[^n]: Note.\n"
    blocks, diagnostics = read("[a][r] b[^n]", "First[^n].\n\n", after)
    assert diagnostics == []
    (paragraph,) = blocks
    assert isinstance(paragraph, Paragraph)
    references = [child for child in paragraph.children if isinstance(child, FootnoteRef)]
    assert [(r.number, r.occurrence) for r in references] == [(1, 2)]
    link = paragraph.children[0]
    assert isinstance(link, Link) and link.target_span.text == "lesson:1.1"


def test_link_definitions_of_a_text_are_its_own() -> None:
    blocks, diagnostics = read("[a]: /u\n\n[a]", "[a]\n\n")
    assert diagnostics == []
    lesson = parse_document(Source("x.md", "[a]"), frozenset(), lesson=True)
    assert not any(isinstance(i, Link) for i in document_inlines(lesson.value))
    assert isinstance(blocks[0], Paragraph) and isinstance(blocks[0].children[0], Link)


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        (f"{TICKS}python file=examples/x.py\nprint(1)\n{TICKS}", "script-path"),
        (f"Output:\n\n{TICKS}text digits\n1\n{TICKS}", "recording-keys"),
        (f"{TICKS}quiz\n{{}}\n{TICKS}", "fence-info"),
        (f"{TICKS}lab\n{{}}\n{TICKS}", "fence-info"),
    ],
)
def test_a_text_cannot_hold_blocks_that_need_lines_of_the_lesson(text: str, rule: str) -> None:
    _, diagnostics = read(text)
    assert [d.rule for d in diagnostics] == [rule]
