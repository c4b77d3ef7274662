"""Listings: highlighted lines, their anchors and how those are checked."""

from __future__ import annotations

import re
from html import unescape

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model import line_anchor, linked_lines, listing_anchor, output_anchor
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.listings import highlight_lines
from coursebuild.core.pages.references import check_links, has_anchor, merge_line_ids
from coursebuild.core.text.characters import visible
from coursebuild.core.text.python_code import find_imports
from coursebuild.features.lab.page import qr_svg
from support.fixture_cases import fixture_tables
from support.rendered_course import Make

CASES = fixture_tables("listings")


def test_anchors_are_named_after_the_file() -> None:
    assert listing_anchor("examples/a.py") == "a.py"
    assert line_anchor("examples/sub/a.py", 12) == "sub/a.L12"
    assert line_anchor("models/box.xml", 1) == "box.L1"
    assert output_anchor("examples/a.b.py", 1) == "a.b.out"
    assert output_anchor("examples/a.py", 2) == "a.out-2"
    assert listing_anchor("examples/a b.py") == "a␣b.py", "an id has no space"


def test_the_lines_that_an_anchor_names() -> None:
    lines_by_anchor = {anchor: tuple(lines) or None for anchor, lines in CASES["anchors"]}
    assert {anchor: linked_lines(anchor) for anchor in lines_by_anchor} == lines_by_anchor


SCRIPT = "```python file=examples/a.py\nprint(1)\nprint(2)\n```\n"
OUTPUT = "\nOutput:\n\n```text\n1\n2\n```\n"


def test_lines_of_a_model_can_be_linked_to(make: Make) -> None:
    page = make("Text.").site()["models/box.html"].decode()
    assert re.findall(r' id="(box[^"]*)"', page) == ["box.xml", "box.L1", "box.L2", "box.L3"]


PAGE = '<p id="h"></p><span id="a.L1"></span><span id="a.L2"></span><a href="{}">x</a>'


def test_links_to_lines_are_checked() -> None:
    for url, fine in CASES["links"]:
        file = OutputFile("index.html", PAGE.format(url).encode())
        assert (check_links([file]) == ()) is fine, url


# ------------------------------------------------------------------------------------ paper


def test_a_code_has_a_label_and_white_space_around_it() -> None:
    svg = qr_svg("https://example.org/c/lessons/4.2-a.html#4.2-lab-1", 'a "label"')
    assert svg.startswith('<svg role="img" aria-label="a &#34;label&#34;" viewBox="0 0 41 41"')
    assert 'd="M4 4.5h7m' in svg, "four modules, as ISO/IEC 18004 demands"


def test_an_address_that_no_code_holds_gets_none() -> None:
    assert qr_svg("x" * 5000, "label") == ""


NAMES = st.lists(
    st.sampled_from(
        ("a", ".L", "L", "1", "0", "12", "-L", "\n", ".", "é", "\u2028", "9" * 10, "²")
    ),
    max_size=7,
).map("".join)


@given(st.lists(NAMES | st.sampled_from(["a.L1", "a.L2", "a.L9", "b.c.L4", "a.out"]), max_size=6))
def test_of_the_lines_of_a_listing_the_last_is_kept(ids: list[str]) -> None:
    lines_by_id = {name: linked_lines(name) for name in ids}
    last: dict[str, int] = {}
    for lines in filter(None, lines_by_id.values()):
        last[lines[0]] = max(last.get(lines[0], 0), lines[2])
    other_ids = {name for name, lines in lines_by_id.items() if lines is None}
    short = merge_line_ids(ids)
    assert short == other_ids | {f"{stem}.L{line}" for stem, line in last.items()}
    assert all(has_anchor(short, name) for name in ids)


def test_modules_that_a_script_imports() -> None:
    code = (
        "import a.b as c, d\nfrom e.f import g\nfrom . import h\nfrom .i import j\n"
        "try:\n    import k\nexcept ImportError:\n    import l\nelse:\n    import m\n"
        "finally:\n    import n\ndef go():\n    if True:\n        from o import *\n"
        "match 1:\n    case 1:\n        import p\n"
    )
    assert find_imports(code) == frozenset("adeklmnop")
    assert find_imports(f"{code}(") == frozenset()


def highlight(language: str, code: str) -> str:
    return "\n".join(highlight_lines(language, code))


def test_python_gets_classes_for_what_a_reader_looks_for() -> None:
    """Also where it does not parse, as far as it can be read."""
    for code, html in CASES["python"]:
        assert highlight("python", code) == html


def test_a_very_long_script_is_marked_too() -> None:
    for lines in (highlight_lines("python", "x = 1\n" * n) for n in (3000, 4000)):
        assert {*lines[:-1]} == {'x = <span class="n">1</span>'}


@pytest.mark.parametrize("language", ["", "no such language", "text", "jsön", "../x", "<b>"])
def test_unknown_languages_are_plain_escaped_text(language: str) -> None:
    assert highlight(language, "a < b & c\n") == "a &lt; b &amp; c\n"


def test_forbidden_characters_are_shown_as_symbols() -> None:
    expected = "\u241b[31mred\u241b[0m\u2400\u240d\u2421\ufffd\ufffd\ufffd\t\n"
    assert visible("\x1b[31mred\x1b[0m\0\r\x7f\x85\ufffe\U0010ffff\t\n") == expected


@given(st.text())
def test_visible_text_has_nothing_that_html_forbids(text: str) -> None:
    for character in visible(text):
        code = ord(character)
        assert code in (9, 10) or code >= 0x20
        assert not 0x7F <= code < 0xA0
        assert code & 0xFFFE != 0xFFFE
        assert not 0xFDD0 <= code <= 0xFDEF


LANGUAGES = "python xml json bash sh text c++ diff console pycon pytb doscon ps1con irc".split()
UNENDED_LINE = "$ run it\nerror: x\n    = help: `y` <z>"
"""Some lexers see lines that end only, which the last line of a block does not."""


@given(st.sampled_from(LANGUAGES), st.text() | st.sampled_from([UNENDED_LINE, ">>> 1\n1", " x "]))
def test_highlighting_keeps_every_character(language: str, text: str) -> None:
    lines = [re.sub(r"</?span[^>]*>", "", line) for line in highlight_lines(language, text)]
    assert unescape("\n".join(lines)) == visible(text)
    assert all(line.count("<span") == line.count("</span>") for line in lines)
