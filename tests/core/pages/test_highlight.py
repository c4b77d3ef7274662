"""Highlighted code: few classes, whole lines, no character that HTML forbids."""

from __future__ import annotations

import re
from html import unescape

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.pages.listings import highlight_lines
from coursebuild.core.text.characters import visible


def highlight(language: str, code: str) -> str:
    return "\n".join(highlight_lines(language, code))


def test_python_gets_classes_for_what_a_reader_looks_for() -> None:
    code = 'def spin(rate: float) -> str:\n    return f"{rate:.3f} rad/s"  # <slow>\n'
    assert highlight("python", code) == (
        '<span class="k">def</span> <span class="f">spin</span>(rate: float) -&gt; str:\n'
        '    <span class="k">return</span> <span class="s">f"</span><span class="i">{</span>rate'
        '<span class="i">:</span><span class="s">.3f</span><span class="i">}</span>'
        ' <span class="s">rad/s"</span>  <span class="c"># &lt;slow&gt;</span>\n'
    )


def test_a_docstring_a_decorator_and_nested_fields_have_their_classes() -> None:
    code = '"""Doc."""\n@cache\ndef f():\n    return f"{x!r:>{w}}"\n'
    assert highlight("python", code) == (
        '<span class="d">"""Doc."""</span>\n<span class="a">@cache</span>\n'
        '<span class="k">def</span> <span class="f">f</span>():\n'
        '    <span class="k">return</span> <span class="s">f"</span><span class="i">{</span>x'
        '<span class="i">!r:</span><span class="s">&gt;</span><span class="i">{</span>w'
        '<span class="i">}}</span><span class="s">"</span>\n'
    )


def test_python_that_does_not_parse_is_marked_as_far_as_it_can_be_read() -> None:
    assert highlight("python", "def (:\n    x = 1  # ν\n") == (
        '<span class="k">def</span> (:\n    x = <span class="n">1</span>'
        '  <span class="c"># ν</span>\n'
    )


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
