"""The line-by-line difference between a recorded output and a run, as a page shows it."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.diff import diff_rows
from support.sample_lessons import DIGITS_ELLIPSIS, EXACT, recording, table


def rows(recorded: str, printed: str) -> list[str]:
    """Each row as text; what changed is in brackets."""
    block = recording(recorded)
    verdict = compare(block, DIGITS_ELLIPSIS, printed)
    return [
        mark + "".join(f"[{text}]" if is_changed else text for text, is_changed in parts)
        for mark, parts in diff_rows(verdict, printed)
    ]


@pytest.mark.parametrize(
    ("recorded", "printed", "expected"),
    [
        ("pi 3.14\nn 2", "pi 3.14159\nn 3", [" pi 3.14", "-n [2]", "+n [3]"]),
        ("a\n...\nz 1", "a\nb\nc\nz 2", [" a", " ...", "-z [1]", "+z [2]"]),
        ("a 1\nb 2\nc 3", "a 1\nb 4\nc 3", [" a 1", "-b [2]", "+b [4]", " c 3"]),
        ("a 1\nb 2", "a 3\nb 4", ["-a [1]", "-b [2]", "+a [3]", "+b [4]"]),
        ("one\ntwo", "one", [" one", "-[two]"]),
        ("one", "one\ntwo", [" one", "+[two]"]),
        # half of their words make two lines one; what is between such is one after the other
        (
            "first\nmass one",
            "mass two\nlast",
            ["-[first]", "-mass [one]", "+mass [two]", "+[last]"],
        ),
        ("the mass is 3", "the mass was 3", ["-the mass [is] 3", "+the mass [was] 3"]),
        ("a\n\nb 1", "a\n\nb 2", [" a", " ", "-b [1]", "+b [2]"]),
    ],
)
def test_rows(recorded: str, printed: str, expected: list[str]) -> None:
    assert rows(recorded, printed) == expected


def test_rows_of_a_table_are_the_cells_that_changed() -> None:
    block = table("| n | x |\n| --- | --- |\n| 1 | 2.5 |")
    verdict = compare(block, EXACT, "1 3.5\n")
    cell_rows = [(mark, parts[0][0]) for mark, parts in diff_rows(verdict, "1 3.5\n")]
    assert cell_rows == [("-", "2.5"), ("+", "3.5")]


# No digits beside spaces: `1` and ` 1` are the same number, shown as it was recorded.
LINE = st.text("ab1", max_size=6) | st.text("ab ", max_size=6).map(str.rstrip)
LINES = st.lists(LINE, min_size=1, max_size=6)


@settings(max_examples=50)
@given(LINES, LINES)
def test_the_rows_are_both_texts(recorded: list[str], printed: list[str]) -> None:
    """Without added rows they are the recorded text; without removed rows, the printed one."""
    recorded_text, printed_text = "\n".join(recorded).rstrip("\n"), "\n".join(printed).rstrip("\n")
    if (
        not recorded_text
        or compare(recording(recorded_text), DIGITS_ELLIPSIS, printed_text).status != "drift"
    ):
        return
    lines = [row.replace("[", "").replace("]", "") for row in rows(recorded_text, printed_text)]
    assert [row[1:] for row in lines if row[0] != "+"] == recorded_text.split("\n")
    assert [row[1:] for row in lines if row[0] != "-"] == (
        printed_text.split("\n") if printed_text else []
    )
