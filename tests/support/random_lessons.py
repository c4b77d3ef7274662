"""Random texts made of what lessons are made of."""

from __future__ import annotations

from hypothesis import strategies as st

from coursebuild.core.model.course import CALLOUTS
from support.fixture_cases import fixture_tables

KINDS = frozenset(CALLOUTS)

PIECES = [*fixture_tables("lesson_pieces")["pieces"], "\ud800"]
PREFIXES = ["", "> ", "  ", "   ", "- ", "> - ", "\t", "    "]
LINE_ENDS = ["\n", "\r\n", "\r"]


@st.composite
def markdown(draw: st.DrawFn) -> str:
    """A text that likes to look like a lesson, in a quote or a list or not."""
    pieces = draw(st.lists(st.sampled_from(PIECES) | st.text(max_size=8), max_size=24))
    text = "".join(pieces)
    prefix = draw(st.sampled_from(PREFIXES))
    rest = prefix.replace("-", " ")
    text = prefix + text.replace("\n", "\n" + rest)
    line_end = draw(st.sampled_from(LINE_ENDS))
    return text.replace("\n", line_end) if line_end != "\n" else text
