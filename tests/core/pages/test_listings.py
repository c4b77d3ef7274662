"""Anchors of lines and outputs, and how they are checked."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model import line_anchor, linked_lines, listing_anchor, output_anchor
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.references import check_links, has_anchor, merge_line_ids
from coursebuild.features.lab.page import qr_svg
from support.rendered_course import Make


def test_anchors_are_named_after_the_file() -> None:
    assert listing_anchor("examples/a.py") == "a.py"
    assert line_anchor("examples/sub/a.py", 12) == "sub/a.L12"
    assert line_anchor("models/box.xml", 1) == "box.L1"
    assert output_anchor("examples/a.b.py", 1) == "a.b.out"
    assert output_anchor("examples/a.py", 2) == "a.out-2"
    assert listing_anchor("examples/a b.py") == "a␣b.py", "an id has no space"


@pytest.mark.parametrize(
    ("anchor", "lines"),
    [
        ("a.L1", ("a", 1, 1)),
        ("sub/a.b.L3-L20", ("sub/a.b", 3, 20)),
        ("a.L5-L4", None),
        ("a.L0", None),
        ("a.L01", None),
        ("a.L1-2", None),
        (".L1", None),
        ("heading", None),
        ("a.L9999999999", None),
    ],
)
def test_the_lines_that_an_anchor_names(anchor: str, lines: tuple[str, int, int] | None) -> None:
    assert linked_lines(anchor) == lines


SCRIPT = "```python file=examples/a.py\nprint(1)\nprint(2)\n```\n"
OUTPUT = "\nOutput:\n\n```text\n1\n2\n```\n"


def test_lines_of_a_model_can_be_linked_to(make: Make) -> None:
    page = make("Text.").site()["models/box.html"].decode()
    assert re.findall(r' id="(box[^"]*)"', page) == ["box.xml", "box.L1", "box.L2", "box.L3"]


PAGE = '<p id="h"></p><span id="a.L1"></span><span id="a.L2"></span><a href="{}">x</a>'


@pytest.mark.parametrize(
    ("url", "fine"),
    [
        ("#a.L2", True),
        ("#a.L1-L2", True),
        ("#a.L3", False),
        ("#a.L2-L3", False),
        ("#b.L1", False),
        ("#h", True),
    ],
)
def test_links_to_lines_are_checked(url: str, fine: bool) -> None:
    file = OutputFile("index.html", PAGE.format(url).encode())
    assert (check_links([file]) == ()) is fine


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
