"""A pattern that is compiled when it is first used does what a compiled one does."""

from __future__ import annotations

import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.text.patterns import pattern

TEXTS = [r"a+", r"(?P<first>[ab])(c)?", r"", r"^x.$"]


@given(st.sampled_from(TEXTS), st.sampled_from([0, re.IGNORECASE, re.DOTALL]), st.text("abcxX\n"))
def test_it_is_like_a_compiled_one(text: str, flags: int, subject: str) -> None:
    ours, theirs = pattern(text, flags), re.compile(text, flags)
    for _ in range(2):  # first, and once it is compiled
        for name in ("match", "search", "fullmatch"):
            a, b = getattr(ours, name)(subject), getattr(theirs, name)(subject)
            assert (a and (a.span(), a.groups())) == (b and (b.span(), b.groups()))
        assert ours.findall(subject) == theirs.findall(subject)
        assert ours.sub("-", subject) == theirs.sub("-", subject)
        assert ours.split(subject) == theirs.split(subject)
    assert (ours.pattern, ours.flags, ours.groups) == (text, theirs.flags, theirs.groups)
    assert ours.groupindex == theirs.groupindex


def test_nothing_is_compiled_before_it_is_used() -> None:
    broken: Any = pattern("(")
    with pytest.raises(AttributeError, match="nothing"):
        broken.nothing  # noqa: B018
    with pytest.raises(re.error):
        broken.match("")


def test_it_shows_its_text() -> None:
    assert repr(pattern("a+")) == "pattern('a+')"
