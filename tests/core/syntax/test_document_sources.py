"""Properties of a file besides its Markdown: line ends, a byte order mark, NUL, extreme sizes."""

from __future__ import annotations

import sys
from types import FrameType

import pytest

from coursebuild.core.model import (
    BlockQuote,
    Callout,
    CodeBlock,
    Document,
    Emphasis,
    Heading,
    Recording,
    Script,
    document_blocks,
    document_inlines,
)
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Excerpt, Source
from support.plain_html import plain_html

KINDS = frozenset({"note", "try"})
LESSON = """## Title

> [!try] It
> ```python file=examples/x.py
> print(1)
>
> print(2)
> ```
>
> Output:
>
> ```text
> 1
> 2
> ```

$$
a
$$

| a | b |
| - | - |
| 1 | 2\\|3 |
"""


def parse(text: str, *rules: str) -> Document:
    result = parse_document(Source("x.md", text), KINDS, lesson=True)
    assert tuple(diagnostic.rule for diagnostic in result.diagnostics) == rules
    return result.value


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_line_ends(line_end: str) -> None:
    text = LESSON.replace("\n", line_end)
    document = parse(text)
    callout = document.blocks[1]
    assert isinstance(callout, Callout)
    script, recording = callout.blocks
    assert isinstance(script, Script) and isinstance(recording, Recording)
    assert script.code.text == "print(1)\n\nprint(2)\n"
    assert script.code.span().text.startswith("print(1)" + line_end)
    assert isinstance(recording.body, Excerpt) and recording.body.text == "1\n2\n"
    assert recording.body_span.text == f"> 1{line_end}> 2{line_end}"
    assert recording.prefix == "> "
    assert recording.span.line == 10
    assert plain_html(document) == plain_html(parse(LESSON))


def test_a_byte_order_mark_is_skipped() -> None:
    document = parse("\ufeff## A\n")
    heading = document.blocks[0]
    assert isinstance(heading, Heading) and heading.anchor == "a"
    assert (heading.span.start, heading.span.end) == (1, 5)


def test_nul_is_a_replacement_character() -> None:
    document = parse("a\0b `c\0`", "control-character")
    assert plain_html(document) == "<p>a\ufffdb <code>c\ufffd</code></p>\n"


def test_an_unclosed_fence_without_final_line_end_has_one() -> None:
    result = parse_document(Source("x.md", "```c\nx"), KINDS, lesson=True)
    block = result.value.blocks[0]
    assert isinstance(block, CodeBlock) and block.code.text == "x\n"
    assert [d.rule for d in result.diagnostics] == ["fence-unclosed"]


def test_deep_nesting_becomes_paragraphs_and_loses_nothing() -> None:
    document = parse(">" * 300 + " a", "nesting-deep")
    blocks = list(document_blocks(document))
    assert sum(isinstance(block, BlockQuote) for block in blocks) == 60
    assert blocks[-1].span.text == ">" * 240 + " a"


def test_deep_emphasis_loses_its_marks_and_no_text() -> None:
    text = "*a " * 200 + "b*" * 200
    inlines = list(document_inlines(parse(text)))
    assert sum(isinstance(inline, Emphasis) for inline in inlines) == 60
    assert str(plain_html(parse(text))).count("a ") == 200


REPEATED_PIECES = [
    *("[", "]", "*", "_", "$", "$$", "`", "~", "|", "<", "&", "!", "![", "[^", "[^a]", "("),
    *("{", "\\", "#", ">", "> ", "- ", "1. ", "\t", "$a", "a$ ", "$$a\n\n", "*a ", "a*"),
    *("*a_", "**a ", "a**b", "[a](", '[a](b "', "[a](<b", "[a][b]", "[a]: b\n"),
    *("[a]: b 'x\n", "[a\n", "`a", "``a`", "`a$", "<a ", '<a "', "<!--", "<?"),
    *('<a href="x">', "<b>", "</b>", "&amp;", "|\n", "a|b\n-|-\n", "- a\n", "> a\n"),
    *("$$\n", "$$\na\n", "```\n", "a\n===\n", "a\n=\n", "[^a]: x\n", "Lesson 2.2 "),
    *("Lessons 1.1, 2.2, ", "- [ ] a\n", "<http://a.b>", "~~a", "~~~a~~~ ", "[a](u) "),
    *("`x`{out}", "`x`{out", "\\$", "> [!note] a\n\n", "a\\\n", "a  \n", "<p>", "<div>\n\n"),
    *("# a {#b}\n", "# a {#\n", "Output:\n\n", "    a\n", "```python\nx\n```\n"),
    "Output:\n\n```text\na\n```\n",
]


def calls(text: str) -> int:
    """How many functions parsing and rendering call: a repeatable measure of the work."""
    count = 0

    def count_call(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += 1

    sys.setprofile(count_call)
    try:
        plain_html(parse_document(Source("x.md", text), KINDS, lesson=True).value)
    finally:
        sys.setprofile(None)
    return count


NESTED = [("[", "]"), ("[", "](u)"), ("![", "](u)"), ("*a ", "b*")]


@pytest.mark.site
def test_work_grows_in_proportion_to_repeated_pieces() -> None:
    failures = []
    for piece in REPEATED_PIECES:
        size = 300 // len(piece)
        calls(piece)
        once, twice = calls(piece * size), calls(piece * (2 * size))
        if twice >= 2.2 * once + 500:
            failures.append(f"{piece!r}: {once} and {twice} calls")
    assert failures == []


def test_work_grows_in_proportion_to_nested_brackets() -> None:
    failures = []
    for left, right in NESTED:
        once, twice = (calls(left * n + "x" + right * n) for n in (150, 300))
        if twice >= 2.3 * once + 500:
            failures.append(f"{left!r} and {right!r}: {once} and {twice} calls")
    assert failures == []
