"""Blocks written as Markdown, and the copies of lessons as Markdown and notebooks."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import nbformat
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import Block, Callout, Citation, Document, Target
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.pages.marks import (
    block_quote,
    code_span,
    escape_marks,
    guard_lines,
    link,
    picture,
)
from coursebuild.core.pages.urls import Place
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.markdown.page_copies import markdown_href
from coursebuild.features.markdown.writer import DocumentWriter
from support.fixture_cases import check_lines, check_text, fixture_text
from support.markdown_files import commonmark_examples
from support.plain_html import PlainWriter, plain_html
from support.rendered_course import Make

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

    def citation(self, citation: Citation) -> str:
        return escape_marks(citation.span.text)

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
    examples = commonmark_examples()
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


def test_markdown_of_constructs(rewriting: bool) -> None:
    path = Path(__file__).with_name("constructs.md")
    check_lines(path, lambda markdown: [rewrite(markdown)], rewriting=rewriting)


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


LESSON = fixture_text("documents/copied.md")
NEXT_LESSON = fixture_text("documents/copied_next.md")


def site(make: Make, text: str = LESSON, **texts: str) -> dict[str, bytes]:
    runs = {"examples/never.py": ScriptRun("examples/never.py", Outcome.NORUN, 0, "", "", 0.0)}
    texts.setdefault("1.1", NEXT_LESSON)
    files: dict[str, bytes] = make(text, runs=runs, **texts).site()
    return files


@pytest.fixture(scope="module")
def files(make: Make) -> dict[str, bytes]:
    return site(make)


def cells(data: bytes) -> list[dict[str, Any]]:
    nbformat.validate(nbformat.reads(data.decode(), as_version=4))
    notebook_cells: list[dict[str, Any]] = json.loads(data)["cells"]
    return notebook_cells


def source(cell: dict[str, Any]) -> str:
    return "".join(cell["source"])


# ------------------------------------------------------------------------------------ Markdown


def test_a_lesson_as_markdown(files: dict[str, bytes], rewriting: bool) -> None:
    text = files["lessons/0.1-falling.md"].decode()
    check_text(Path(__file__).with_name("lesson_copy.md"), text, rewriting=rewriting)


def test_every_page_names_its_markdown(files: dict[str, bytes]) -> None:
    for path, data in files.items():
        if path.endswith(".html"):
            addresses = re.findall(
                r'<link rel="alternate" type="text/markdown" href="([^"]*)">', data.decode()
            )
            folder = path.rpartition("/")[0]
            copy = f"{folder}/{addresses[0]}".lstrip("/") if addresses else ""
            assert bool(addresses) is (path.removesuffix(".html") + ".md" in files), path
            assert not addresses or copy in files


def test_pages_without_a_document_as_markdown(files: dict[str, bytes]) -> None:
    home = files["index.md"].decode()
    assert home.startswith('# Bodies & \\<axes>\n\nA "short" course.\n')
    assert "(lessons/0.1-falling.md)" in home and "(levels/1.md)" in home
    model = files["models/box.md"].decode()
    assert "- Bodies: 1\n" in model and '```xml\n<mujoco model="box">' in model
    assert "not written yet" in files["lessons/1.2-later.md"].decode()


# ----------------------------------------------------------------------------------- notebooks


def test_a_lesson_as_a_notebook(files: dict[str, bytes]) -> None:
    notebook_cells = cells(files["lessons/0.1-falling.ipynb"])
    scripts = {cell["id"]: cell for cell in notebook_cells if cell["cell_type"] == "code"}
    assert list(scripts) == ["setup", "code-a-1", "code-in-callout-1", "code-never-1"]
    assert 'FILES = ""\n' in source(scripts["setup"]), "each script stands in its own cell alone"
    first = scripts["code-a-1"]
    assert source(first) == ('%%example examples/a.py --n \'a b\'\nprint("one")\nprint("```")')
    assert first["outputs"] == [
        {"name": "stdout", "output_type": "stream", "text": ["one\n", "two\n"]}
    ]
    assert scripts["code-never-1"]["outputs"] == []
    assert source(scripts["code-never-1"]).startswith(
        "%%example --requires=torch,mjx --norun examples/never.py\n"
    )
    texts = "\n".join(source(cell) for cell in notebook_cells if cell["cell_type"] == "markdown")
    for piece in (
        "[Lesson 1.1](https://example.org/course/lessons/1.1-spinning.html)",
        "[here](https://example.org/course/lessons/0.1-falling.html#part)",
        "It is 1.5.<sup>1</sup>",
        "(https://example.org/course/examples/in_callout.py) is in a cell below.",
        "<details>\n   <summary>Answer</summary>\n\n   B.",
        "## Footnotes\n\n1. A note with $y$.",
    ):
        assert piece in texts, piece


def test_a_lesson_without_scripts_needs_no_setup(files: dict[str, bytes]) -> None:
    notebook_cells = cells(files["lessons/1.1-spinning.ipynb"])
    assert {cell["cell_type"] for cell in notebook_cells} == {"markdown"}


def test_a_model_that_readers_edit_is_shown_as_code(files: dict[str, bytes]) -> None:
    lesson = "lessons/1.1-spinning"
    (text,) = (source(cell) for cell in cells(files[f"{lesson}.ipynb"]) if "mujoco" in source(cell))
    for copy in (files[f"{lesson}.md"].decode(), text):
        assert "A simulation of a model of its own.\n\n```xml\n<mujoco/>\n```\n" in copy
    page = files[f"{lesson}.html"].decode()
    still = page[page.index('data-kind="mjcf"') :].partition("</section>")[0]
    assert '<code class="language-xml">' in still


def test_an_edit_keeps_the_ids_of_other_cells(make: Make, files: dict[str, bytes]) -> None:
    new_text = LESSON.replace("### Never", "## New\n\nText.\n\n### Never").replace(
        "a *number*", "b"
    )
    before = [cell["id"] for cell in cells(files["lessons/0.1-falling.ipynb"])]
    after = [cell["id"] for cell in cells(site(make, new_text)["lessons/0.1-falling.ipynb"])]
    assert [id for id in after if id != "text-new-1"] == before


def test_ids_of_cells_differ_whatever_the_headings(make: Make) -> None:
    text = "## 重力\n\na\n\n## " + "x" * 200 + "\n\nb\n\n## 重力\n\nc\n\n## !\n\nd\n"
    ids = [cell["id"] for cell in cells(site(make, text)["lessons/0.1-falling.ipynb"])]
    assert len(set(ids)) == len(ids) == 5


def test_numbers_are_written(make: Make) -> None:
    text = (
        "## Part {#part}\n\n$$\na = b % so\n$$ {#eq:one}\n\nBy $$c$$ {#eq:two} and [](#eq:two), "
        "from [](#eq:one) and [](#tab:x).\n\nTable: *Some*. {#tab:x}\n\n| a |\n| --- |\n| b |\n\n"
        "```python {#lst:x}\nx = 1\n```\n"
    )
    copy = site(make, text)["lessons/0.1-falling.md"].decode()
    assert "[Table 0.1.1](#tab:x)" in copy
    assert "**Table 0.1.1:** *Some*.\n\n| a |" in copy
    assert "**Listing 0.1.1:**\n\n```python" in copy
    assert "$$\na = b % so\n\\tag{1}\n$$" in copy
    assert "[(1)](#eq:one)" in copy


def test_addresses_lead_to_the_markdown_of_their_page(rewriting: bool) -> None:
    path, place = Path(__file__).with_name("addresses.md"), Place("lessons/1.1-a.html")
    check_lines(path, lambda href: [markdown_href(place, href)], rewriting=rewriting)
