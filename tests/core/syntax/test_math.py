"""Where formulas end: what is found fast is what a look at each mark finds."""

from __future__ import annotations

import re

from hypothesis import example, given
from hypothesis import strategies as st

from coursebuild.core.syntax.math import FormulaText, _closing, find_formula

TEXTS = st.text("$`\\ \n1a{", max_size=20)


def each_mark(
    text: str, at: int, limit: int, last_runs: dict[int, int] | None
) -> FormulaText | None:
    width = 2 if text.startswith("$$", at) else 1
    start = at + width
    if start >= limit or (width == 1 and text[start] in " \t\n"):
        return None
    for stop in re.compile(r"\\[\s\S]|`+|\$+").finditer(text, start, limit):
        mark, end = stop[0], stop.start()
        if mark[0] == "`":
            if last_runs is not None and last_runs.get(len(mark), -1) > end:
                return None
        elif mark[0] == "$" and width == 2:
            if len(mark) >= 2:
                return FormulaText(start, end, end + 2, True)
        elif mark[0] == "$":
            digit = re.match("[0-9]", text[end + 1 :])
            closes = text[end - 1] not in " \t\n" and not digit
            return FormulaText(start, end, end + 1, False) if closes else None
    return None


@given(TEXTS, st.integers(0, 20), st.booleans())
@example("$a\\", 0, True)
@example("$$a$b$$", 0, False)
def test_a_formula_ends_at_the_first_mark_that_counts(text: str, cut: int, code: bool) -> None:
    text = "$" + text
    limit = len(text) - cut if cut < len(text) else len(text)
    runs = {len(m[0]): m.start() for m in re.finditer("`+", text)} if code else None
    assert find_formula(text, 0, limit, runs) == each_mark(text, 0, limit, runs)


@given(TEXTS, st.integers(0, 20), st.integers(0, 20))
def test_a_block_ends_at_the_first_two_dollars_that_count(text: str, at: int, end: int) -> None:
    marks = re.compile(r"\\[\s\S]|\$+").finditer(text, at, end)
    first = next((m.start() for m in marks if m[0].startswith("$$")), None)
    assert _closing(text, at, end) == first


def test_a_long_formula_takes_time_in_proportion() -> None:
    long = "$$" + r"\alpha x^{2} + y\$ " * 100_000
    assert find_formula(long, 0, len(long)) is None
    assert find_formula(long + "$$", 0, len(long) + 2) is not None
