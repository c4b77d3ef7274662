"""Texts with HTML that nobody should write, but somebody does."""

from __future__ import annotations

from hypothesis import strategies as st

from support.fixture_cases import fixture_tables

_TABLES = fixture_tables("hostile_html")
HOSTILE: list[str] = _TABLES["texts"]

REFUSED_TEXTS = [
    text for text in HOSTILE if text.startswith(("<b>bold\n", "</textarea")) or "\x0b" in text
]
"""Those that a check rejects: elements that are not closed, or not open; a control character."""

PAGES = st.lists(st.sampled_from([*_TABLES["pieces"], "\ud800"]), max_size=20).map("".join)
"""Pages of pieces that fit together or do not."""
