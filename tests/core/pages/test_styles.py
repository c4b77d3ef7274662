"""Styles in elements become classes, and nothing else is touched."""

from __future__ import annotations

from html import escape

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.pages.record import class_name, hoist_styles

PAD = class_name("padding: 0")


@pytest.mark.parametrize(
    ("html", "expected"),
    [
        ('<mtd style="padding: 0;">', f'<mtd class="{PAD}">'),
        ('<mtd class="tml-left" style="padding: 0;"/>', f'<mtd class="tml-left {PAD}"/>'),
        ("<b style='padding:\n 0' title='a > b'>", f"<b class=\"{PAD}\" title='a > b'>"),
        ('<b STYLE="padding: 0" class=x id=y>', f'<b class="x {PAD}" id=y>'),
        ('<b style="">', "<b>"),
        ("<b style>", "<b>"),
        ('<b class="x" style=";">', '<b class="x">'),
        ('<b style="background: url(&quot;a&quot;)">', None),
    ],
)
def test_a_style_becomes_a_class(html: str, expected: str | None) -> None:
    page, declarations = hoist_styles(html)
    assert page == (
        expected or f'<b class="{class_name("background: url(" + chr(34) + "a" + chr(34) + ")")}">'
    )
    assert "style" not in page.lower().replace(PAD, "")
    assert len(declarations) == ("padding" in html or "background" in html)


@pytest.mark.parametrize(
    "html",
    [
        '<!-- <b style="padding: 0"> -->',
        "<script>\"<b style='padding: 0'>\"</script>",
        "<p>style=\"padding: 0\" &lt;b style='x'></p>",
        '<b title="style=x" data-style="y">',
        '<textarea><b style="padding: 0"></textarea>',
        "<b title='<i style=\"padding: 0\">'>",
    ],
)
def test_what_only_looks_like_a_style_stays(html: str) -> None:
    assert hoist_styles(html) == (html, frozenset())


@pytest.mark.parametrize(
    "declaration",
    ["} body { display: none", "color: red /* ", 'content: "', "a: </style>", "a: \\7d"],
)
def test_a_declaration_cannot_reach_out_of_its_rule(declaration: str) -> None:
    assert hoist_styles(f'<b style="{escape(declaration)}">') == ("<b>", frozenset())


@given(st.text(alphabet="<>/=\"' abcstyle-!\n"))
def test_any_text_is_taken_and_the_result_has_nothing_more_to_take(html: str) -> None:
    page, _ = hoist_styles(html)
    assert hoist_styles(page)[0] == page
