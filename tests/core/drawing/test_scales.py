"""Logarithmic axes, and text that has its place."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.drawing.scales import log_ticks, markup_text, separate_labels
from support.fixture_cases import fixture_tables


@pytest.mark.parametrize(("low", "high", "most", "texts"), fixture_tables("ticks")["logarithmic"])
def test_ticks_of_a_logarithmic_axis(low: float, high: float, most: int, texts: str) -> None:
    assert " ".join(text for _, text in log_ticks(low, high, most)) == texts


@given(low=st.floats(-290, 290), span=st.floats(0.05, 500), most=st.integers(2, 12))
def test_ticks_rise_and_are_within_the_axis(low: float, span: float, most: int) -> None:
    high = min(low + span, 300.0)
    ticks = log_ticks(low, high, most)
    assert all(low - 1e-6 <= at <= high + 1e-6 for at, _ in ticks)
    assert all(a < b for (a, _), (b, _) in pairwise(ticks))
    assert len({text for _, text in ticks}) == len(ticks)


@given(st.text())
def test_markup_can_hold_any_text(text: str) -> None:
    from xml.etree import ElementTree

    ElementTree.fromstring(f"<text>{markup_text(text)}</text>".encode())


@given(heights=st.lists(st.floats(0, 100), max_size=6), gap=st.floats(1, 10))
def test_labels_keep_apart(heights: list[float], gap: float) -> None:
    places = separate_labels(sorted(heights), gap, 0, 100)
    assert all(b - a >= gap - 1e-9 for a, b in pairwise(places))
    assert all(place <= 100 + 1e-9 for place in places)
