"""Items are put into groups by their paths, and one more moves no other far."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from coursebuild.pipeline.groups import groups


@given(st.lists(st.text(max_size=4), max_size=40), st.integers(0, 40), st.text(max_size=4))
def test_groups_are_cut_by_paths_alone(paths: list[str], at: int, new: str) -> None:
    before = list(groups(paths, str, 5))
    assert [path for group in before for path in group] == paths
    assert all(1 <= len(group) <= 25 for group in before)
    after = list(groups([*paths[:at], new, *paths[at:]], str, 5))
    # What was added changes the group that it is in, or cuts it in two.
    assert len([group for group in after if group not in before]) <= 2
