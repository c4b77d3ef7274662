"""Marks of Markdown that are no marks where they stand."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.pages.exports import marks

SIGNS = st.text(st.sampled_from("\\`*[]<$|!~&_#;x1\n é"), max_size=12)


@given(SIGNS | st.text(max_size=40))
def test_a_text_without_signs_is_not_looked_at_closely(text: str) -> None:
    closely = marks._MARKS.sub(lambda match: f"\\{match[0]}", text)
    assert marks.escaped(text) == closely
