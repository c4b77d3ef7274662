"""Blocks written as Markdown read as the same blocks."""

from __future__ import annotations

import re
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import Block, Callout, Document, Target
from coursebuild.core.pages.marks import (
    block_quote,
    code_span,
    escape_marks,
    guard_lines,
    link,
    picture,
)
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.markdown.writer import DocumentWriter
from support.plain_html import PlainWriter, plain_html

ROOT = Path(__file__).parents[3]
SPECIFICATION = ROOT / "site" / "node_modules" / "commonmark-spec" / "spec.txt"
EXAMPLE = re.compile(r"^`{32} example\n(.*?)^\.\n(.*?)^`{32}$", re.MULTILINE | re.DOTALL)
DIFFERENT = {39: "a line's end that is written as a character reference becomes one"}


class Context(DocumentWriter):
    """Addresses stay as they are written."""

    def __init__(self) -> None:
        pass

    def href(self, target: Target) -> str:
        return PlainWriter().href(target)

    def url(self, url: str) -> str:
        return url

    def reference(self, note: int) -> str:
        return f"[^{note}]"

    def link_text(self, target: Target) -> str:
        return ""

    def formula_number(self, start: int) -> str:
        return ""

    def block(self, block: Block, previous: Block | None = None) -> str:
        if isinstance(block, Callout):
            title = guard_lines(self.inlines(block.title))
            return block_quote("\n\n".join(filter(None, (title, self.blocks(block.blocks)))))
        return super().block(block, previous)


def read(markdown: str) -> Document:
    return parse_document(Source("a.md", markdown), frozenset({"note"}), lesson=True).value


def rewrite(markdown: str) -> str:
    document = read(markdown)
    blocks = Context().blocks(document.blocks)
    notes = Context().footnotes(document.footnotes)
    return "\n\n".join(filter(None, (blocks, notes))) + "\n"


def meaning(markdown: str) -> str:
    """Return its HTML with normalized white space."""
    return re.sub(r"\s+", " ", plain_html(read(markdown)))


def test_the_examples_of_commonmark_mean_the_same() -> None:
    examples = EXAMPLE.findall(SPECIFICATION.read_text(encoding="utf-8").replace("→", "\t"))
    assert len(examples) == 652
    failures = [
        f"{number}: {text!r} became {rewrite(text)!r}"
        for number, (text, _) in enumerate(examples, 1)
        if (meaning(text) != meaning(rewrite(text))) is not (number in DIFFERENT)
    ]
    assert not failures, "\n".join(failures)


PIECES = st.sampled_from(
    "a|b c|*|**|_|`|``|~~|[|]|(|)|<|>|!|\\*|&amp;|&lt;|$x$|# |- |1. |2) |+ |> |\n|\n\n|  |    |---"
    "|===|[a](b)|[a](<b c> 't')|![a](b)|<b>|</b>|<!-- c -->|é|字|:|<http://a.b>|%|^|\\\n|```\n"
    "|> [!note] t\n|[^1]|\n\n[^1]: n\n".split("|")
)


@settings(max_examples=120, deadline=None)
@given(st.lists(PIECES, max_size=10).map("".join))
def test_any_text_means_the_same(text: str) -> None:
    assert plainly(text) == plainly(rewrite(text)), rewrite(text)


def plainly(markdown: str) -> str:
    """Return its meaning without empty paragraphs and the word after a fence."""
    html = re.sub(r' class="language-[^"]*"|<p>\s*</p>', "", meaning(markdown))
    return re.sub(r"[\s\\]+|<br />", " ", html).strip()


def test_markdown_of_constructs() -> None:
    cases = [
        ("# A `b` #\n", "# A `b`\n"),
        ("C #\n===\n", "# C \\#\n"),
        ("- a\n- b\n\n* c\n", "- a\n- b\n\n* c\n"),
        ("3. a\n\n   b\n4. c\n", "3. a\n\n   b\n\n4. c\n"),
        ("- [x] done\n- [ ] not\n", "- [x] done\n- [ ] not\n"),
        ("    code\n", "```\ncode\n```\n"),
        ("````\n```\n````\n", "````\n```\n````\n"),
        ("a\n***\nb\n", "a\n\n___\n\nb\n"),
        ("costs \\$5 and `$x`\n", "costs \\$5 and `$x`\n"),
        ("$$\na\n\\\\ b\n$$\n", "$$\na\n\\\\ b\n$$\n"),
        ("so $a\n= b$ it\n", "so $a = b$ it\n"),
        (
            "| a \\| b | $\\lVert x \\| y$ |\n|:--|--:|\n| `c` | |\n",
            "| a \\| b | $\\lVert x \\vert{} y$ |\n| :--- | ---: |\n| `c` |  |\n",
        ),
        ("a[^x]\n\n[^x]: One.\n\n    Two.\n", "a[^1]\n\n[^1]: One.\n\n    Two.\n"),
        ("<https://a.example/b>\n", "<https://a.example/b>\n"),
        ("1986\\. A year\n", "1986\\. A year\n"),
        ("&lt;b&gt; &amp;amp; \\*\n", "\\<b> \\&amp; \\*\n"),
    ]
    assert [rewrite(markdown) for markdown, _ in cases] == [expected for _, expected in cases]


def test_lines_that_would_begin_another_block_are_escaped() -> None:
    text = "# a\n> b\n- c\n+ d\n1. e\n2) f\n===\n---\n~~~\n```\n* * *\n[^1]: g\n-h\n1986 i\n#j"
    assert guard_lines(text) == (
        "\\# a\n\\> b\n\\- c\n\\+ d\n1\\. e\n2\\) f\n\\===\n\\---\n\\~~~\n\\```\n\\* * *\n[^1]\\: g"
        "\n-h\n1986 i\n#j"
    )


def test_hostile_titles_stay_text() -> None:
    hostile = "](javascript:alert(1)) <script>&lt; `x` $y$ | ![a](b)"
    html = plain_html(read(f"{escape_marks(hostile)}\n"))
    assert "<script" not in html and "<a" not in html and "<img" not in html
    assert link(escape_marks("a]b"), "x y(1).html") == "[a\\]b](<x%20y(1).html>)"
    assert picture("a]b\nc", "x>y.png", 'say "q"') == '![a\\]b c](<x%3Ey.png> "say \\"q\\"")'


def test_code_spans_hold_any_code() -> None:
    for text, span in (("a", "`a`"), ("a`b", "``a`b``"), ("`", "`` ` ``"), (" a ", "`  a  `")):
        assert code_span(text) == span
        assert f"<code>{text}</code>" in plain_html(read(f"{span}\n"))


def test_files_that_raw_html_shows_have_the_address_of_the_copy() -> None:
    class Moved(Context):
        def url(self, url: str) -> str:
            return f"../files/{url}"

    text = "<video src='a.mp4'>\n</video>\n\nA <img src=b.png> and <a href=c.png>c</a>.\n"
    assert Moved().blocks(read(text).blocks) == (
        "<video src='../files/a.mp4'>\n</video>\n\n"
        "A <img src=../files/b.png> and <a href=c.png>c</a>."
    )
