"""Markdown inside the JSON of quizzes: HTML kept, math between tags, places in the lesson."""

from __future__ import annotations

import json

import pytest

from coursebuild.core.model import (
    Block,
    CodeBlock,
    FootnoteRef,
    HtmlFlow,
    Inline,
    Link,
    Math,
    Paragraph,
    RawInline,
    SoftBreak,
    Text,
    document_inlines,
)
from coursebuild.core.pages.markup import render_blocks
from coursebuild.core.pages.plain import PLAIN, PlainContext
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Source
from coursebuild.features.quiz.model import OpenQuestion, Quiz

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


def html(text: str) -> str:
    return str(render_blocks(good(text), PlainContext(), PLAIN))


def flow(text: str) -> tuple[Inline, ...]:
    (block,) = good(text)
    assert isinstance(block, HtmlFlow)
    return block.children


def test_math_between_tags_is_math() -> None:
    tag, text, math, rest, end = flow("<p>The order $I_1 < I_2$ &amp; so on.</p>")
    assert isinstance(tag, RawInline) and tag.html == "<p>"
    assert isinstance(text, Text) and text.text == "The order "
    assert isinstance(math, Math) and math.tex.text == "I_1 < I_2"
    assert isinstance(rest, Text) and rest.text == " & so on."
    assert isinstance(end, RawInline) and end.html == "</p>"


def test_text_between_tags_is_no_markdown() -> None:
    assert html("<p>a * b * c, *d*, x_1_</p>") == "<p>a * b * c, *d*, x_1_</p>\n"


def test_literal_elements_hold_no_math() -> None:
    text = "<p><code>$a$</code> <pre>$b$</pre> <script>'$c$ <b>'</script> $d$</p>"
    maths = [inline for inline in flow(text) if isinstance(inline, Math)]
    assert [math.tex.text for math in maths] == ["d"]
    assert "<code>$a$</code> <pre>$b$</pre> <script>'$c$ <b>'</script>" in html(text)


def test_dollars_and_entities_in_html() -> None:
    assert html("<p>\\$5 &lt;b> &nosuch; 3 < 4 $</p>") == (
        "<p>$5 &lt;b&gt; &amp;nosuch; 3 &lt; 4 $</p>\n"
    )


def test_display_math_and_comments_in_html() -> None:
    children = flow("<div>$$a$$<!-- $b$ --></div>")
    assert [type(child) for child in children] == [RawInline, Math, RawInline, RawInline]
    assert isinstance(children[1], Math) and children[1].display


def test_mentions_and_line_ends_in_html() -> None:
    children = flow("<p>See Lesson\n2.2, not <a href='#x'>Lesson 2.3</a>.</p>")
    links = [child for child in children if isinstance(child, Link)]
    assert [link.target_span.text for link in links] == ["2.2"]
    assert any(isinstance(child, SoftBreak) for child in links[0].children)


def test_paragraphs_around_html() -> None:
    blocks = good("*a* $b$\n\n<p>c</p>\n\nd")
    assert [type(block) for block in blocks] == [Paragraph, HtmlFlow, Paragraph]


def test_spans_point_into_the_json() -> None:
    (paragraph,) = good('say "a" and\n\\\\ then $\\frac{a}{b}$ and `c`')
    assert isinstance(paragraph, Paragraph)
    math = next(child for child in paragraph.children if isinstance(child, Math))
    assert math.tex.text == "\\frac{a}{b}"
    assert math.span.text == "$\\\\frac{a}{b}$"
    assert paragraph.children[-1].span.text == "`c`"


def test_a_mistake_is_at_its_place_in_the_json() -> None:
    _, (diagnostic,) = read('x "y" $$z')
    assert diagnostic.rule == "math-unclosed"
    assert (diagnostic.span.line, diagnostic.span.text) == (2, "$$")


def test_carriage_returns_in_json_are_line_ends() -> None:
    (paragraph,) = good("a\r\nb\rc")
    assert isinstance(paragraph, Paragraph)
    assert sum(isinstance(child, SoftBreak) for child in paragraph.children) == 2


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
def test_what_needs_lines_of_the_lesson_cannot_stand_in_a_text(text: str, rule: str) -> None:
    _, diagnostics = read(text)
    assert [d.rule for d in diagnostics] == [rule]


def test_a_table_below_output_in_a_text_is_a_table() -> None:
    blocks = good("Output:\n\n| a |\n| - |\n| 1 |")
    assert [type(block).__name__ for block in blocks] == ["Paragraph", "Table"]


def test_headings_in_texts_share_the_anchors_of_the_lesson() -> None:
    blocks, diagnostics = read("## A", "## A\n\n")
    assert diagnostics == []
    assert getattr(blocks[0], "anchor", None) == "a-2"


def test_code_in_a_text() -> None:
    (block,) = good(f"{TICKS}c\nx\ty\n{TICKS}")
    assert isinstance(block, CodeBlock) and block.code.text == "x\ty\n"
