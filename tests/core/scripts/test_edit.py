"""New outputs as edits of a lesson's text, and what is refused."""

from __future__ import annotations

import pytest

from coursebuild.core.model import Comparison, Filter
from coursebuild.core.scripts.edit import apply_edits, update_body
from coursebuild.core.text.diagnostics import Edit
from coursebuild.core.text.source import Source
from support.sample_lessons import (
    DIGITS,
    DIGITS_ELLIPSIS,
    ELLIPSIS,
    EXACT,
    VOLATILE,
    body,
    recording,
    refusal_text,
    update,
)

SECONDS = Comparison(volatile="[0-9.]+ s")

# ------------------------------------------------------------------------------------ new text


def test_the_output_is_written() -> None:
    assert body("a 1.5\nb", "a 2.5\nb\nc  \n\n\n") == "a 2.5\nb\nc\n"
    assert body("", "a\n") == "a\n"
    assert body("a\nb\nc", "\n\na") == "\n\na\n"


def test_line_ends_and_prefixes_are_the_lesson_s() -> None:
    assert body("a", "b\n\nc", eol="\r\n") == "b\r\n\r\nc\r\n"
    assert body("a", "b\n\nc", eol="\r") == "b\r\rc\r"
    assert body("a", "b\r\n\r\nc", prefix="> ") == "> b\n>\n> c\n"
    assert body("a", " b\n\nc", prefix="   ", eol="\r\n") == "    b\r\n\r\n   c\r\n"
    assert body("", "b\n\nc", prefix=">   ") == ">   b\n>\n>   c\n"


def test_what_matches_is_left_alone() -> None:
    for recorded, printed, comparison in (
        ("a", "a\n", EXACT),
        ("a  ", "a", EXACT),
        ("a 1.50", "a 1.502", DIGITS),
        ("a ... b", "a x b", ELLIPSIS),
        ("a\n...", "a\nb", ELLIPSIS),
        ("took 1 s", "took  23 s", VOLATILE),
        ("took   1.5 s, E 2", "took 23.5 s, E 2", SECONDS),
    ):
        assert update_body(recording(recorded), comparison, printed) is None


def test_volatile_text_is_refreshed_where_more_than_its_numbers_changed() -> None:
    new = update(recording("took 1 s"), "needed 2 s\n", VOLATILE)
    assert new.body_span.text == "needed 2 s\n"


def test_what_varies_is_written_with_the_rest_of_its_line_only() -> None:
    recorded, printed = "a 1 s, E 2\nb 1 s\n", "a 7 s, E 3\nb 7 s\n"
    new = update(recording(recorded), printed, SECONDS)
    assert new.body_span.text == "a 7 s, E 3\nb 1 s\n"


def test_a_tilde_fence_holds_backticks() -> None:
    assert body("a", "```\nb", fence="~~~") == "```\nb\n"
    assert body("a", "```\n~~~~\nb", fence="~~~~~") == "```\n~~~~\nb\n"
    assert body("a", "    ```\n``\nb") == "    ```\n``\nb\n"
    assert body("a", "```x", fence="~~~") == "```x\n"
    assert "would close this fence, or begin another" in refusal_text("a", " ```x\nb")


# ------------------------------------------------------------------------------------- refusals


def test_what_cannot_be_recorded_is_refused() -> None:
    assert refusal_text("a", "x\nb\x00\n").split("\n")[1:] == [
        "  line 2 of the output has a NUL character, which Markdown cannot hold",
        "  help: print text only",
    ]
    for comparison in (EXACT, VOLATILE):
        refusal = refusal_text("a", " \n", comparison)
        assert refusal.endswith("`Output:`\n  the script printed nothing to record")


# -------------------------------------------------------------------------------------- ellipsis


@pytest.mark.parametrize(
    ("recorded", "printed", "expected"),
    [
        ("a 1\n...\nb 2", "a 3\nx\ny\nb 4", "a 3\n...\nb 4\n"),
        ("a 1\n...\nb 2", "a 3\nb 2", "a 3\n...\nb 2\n"),
        ("t=... s\na 1", "t=0.3 s\na 2", "t=... s\na 2\n"),
        ("t=... s, E=1.5 J", "t=0.3 s, E=2.5 J", "t=... s, E=2.5 J\n"),
        ("E 1.5 at t=...", "E 2.5 at t=0.3", "E 2.5 at t=...\n"),
        ("a\n...\n...\nb 1", "a\nb 2", "a\n...\n...\nb 2\n"),
        ("...\nb 1\nc", "x\nb 2\nc", "...\nb 2\nc\n"),
        ("a 1\n...", "a 2", "a 2\n...\n"),
        ("a\nb\nc\n...\nd", "a\nc\nx\nd", "a\nc\n...\nd\n"),
        ("a x\nb\n...\nz 1", "a x\nnew\nb\nw\nz 1", "a x\nnew\nb\n...\nz 1\n"),
    ],
)
@pytest.mark.parametrize("comparison", [ELLIPSIS, DIGITS_ELLIPSIS], ids=["exact", "digits"])
def test_ellipses_are_kept(
    recorded: str, printed: str, expected: str, comparison: Comparison
) -> None:
    assert body(recorded, printed, comparison) == expected


# --------------------------------------------------------------------------------------- filters


def test_what_matches_by_a_filter_stays_as_written() -> None:
    filters = (Filter(r"\d+ ms", "T ms"), Filter(r"^#.*\n", ""))
    recorded = "# kept\nrun T ms\nE 1.5\n# also"
    printed = "# other\n# more\nrun 17 ms\nE 2.5\n"
    # What a filter deletes before a line goes with the line above it.
    assert body(recorded, printed, EXACT, filters) == "# kept\nrun T ms\nE 2.5\n"


# ----------------------------------------------------------------------------------------- edits


def test_edits_that_overlap_or_are_of_another_text_are_refused() -> None:
    def apply_changes(*changes: tuple[int, int, str], text: str = "abcdef") -> str:
        source = Source("a.md", text)
        return apply_edits("abcdef", [Edit(source.span(a, b), new) for a, b, new in changes])

    assert (
        apply_changes((4, 5, "X"), (0, 1, ""), (1, 3, "YZW"), (6, 6, "!"), (3, 3, "-"))
        == "YZW-dXf!"
    )
    for first, second in (
        ((0, 2, ""), (1, 3, "")),
        ((1, 1, "x"), (1, 1, "y")),
        ((0, 3, ""), (1, 1, "")),
    ):
        with pytest.raises(ValueError, match="edits overlap at offset 1 of"):
            apply_changes(first, second)
    with pytest.raises(ValueError, match=r"an edit of another text than a\.md is now"):
        apply_changes((0, 1, "x"), text="abc")
