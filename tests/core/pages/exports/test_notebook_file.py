"""Notebooks as files: the bytes that Jupyter would write."""

from __future__ import annotations

import json

from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.pages.exports.notebook_file import Json, written

SCALARS = st.none() | st.booleans() | st.integers(-(1 << 40), 1 << 40) | st.text()
VALUES: st.SearchStrategy[Json] = st.recursive(
    SCALARS, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=20
)


@settings(max_examples=50)
@given(VALUES)
def test_json_is_as_the_standard_library_writes_it(value: Json) -> None:
    text = json.dumps(value, ensure_ascii=False, indent=1, sort_keys=True)
    assert written(value) == f"{text}\n".encode("utf-8", "replace")


def test_half_a_pair_of_surrogates_is_a_question_mark() -> None:
    assert written({"a": ["\ud800", {}]}) == b'{\n "a": [\n  "?",\n  {}\n ]\n}\n'
