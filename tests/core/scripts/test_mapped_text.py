from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model import Filter
from coursebuild.core.scripts.lines import MappedText, apply_filters

TEXTS = st.text(alphabet="ab1 \n-x", max_size=30)
PATTERNS = st.sampled_from(
    [
        ("a", "xyz"),
        ("b+", ""),
        (r"\d", r"<\g<0>>"),
        ("x*", "-"),
        (r"^a.*\n", ""),
        ("$", "!"),
        (r"(a)|b", r"\1"),
    ]
)


@given(TEXTS, st.lists(PATTERNS, max_size=4))
def test_filtering_is_substitution(text: str, rules: list[tuple[str, str]]) -> None:
    expected = text
    for pattern, replacement in rules:
        expected = re.sub(pattern, replacement, expected, flags=re.MULTILINE)
    mapped = apply_filters(MappedText.copy(text), [Filter(*rule) for rule in rules])
    assert mapped.text == expected


def test_origin_of_replacements_inside_replacements() -> None:
    first = MappedText.copy("_abcde_").replace_ranges({(1, 6): "AB"})
    second = first.replace_ranges({(2, 2): "x"})
    assert second.text == "_AxB_"
    assert [second.origin(1, end) for end in (2, 3, 4, 5)] == [(1, 6)] * 3 + [(1, 7)]


def test_a_filter_ends_where_backtracking_would_not() -> None:
    text = "a" * 5000 + "b"
    rules = (Filter(r"(a+)+$", ""), Filter(r"(a|a)*c", ""), Filter("(a*)*b$", "end"))
    assert apply_filters(MappedText.copy(text), rules).text == "end"
