"""`check --fix`: it mends what has one right cure, and `undo` takes it back."""

from __future__ import annotations

import pytest

from support.scratch_course import GOOD, WAIT_FOR_GO, Make, block, kill_at_end
from support.waiting import wait_until

pytestmark = pytest.mark.site

SLIPS = (
    GOOD.replace("```text", "```tetx").replace("Output:", "Ouput:")
    + "See [the other](lesson:two), and `3.15`{ouut}.\n\n> [!nte] Title\n>\n> Text.\n\n"
    '```quiz\n{"id": "q", "questions": [\n'
    '  {"kind": "open", "q": "Why?", "referense": "Because."},\n]}\n```\n'
)
"""A trailing comma hides a misspelt field, and a misspelt mark a wrong number."""
MENDED = (
    GOOD + "See [the other](lesson:1.2), and `3.14`{out}.\n\n> [!note] Title\n>\n> Text.\n\n"
    '```quiz\n{"id": "q", "questions": [\n'
    '  {"kind": "open", "q": "Why?", "reference": "Because."}\n]}\n```\n'
)


def test_fix_mends_all_that_has_one_cure_and_undo_takes_it_back(make: Make) -> None:
    """Also what comes to light only when something else is mended, and no other byte."""
    before = ("\ufeff" + SLIPS).replace("\n", "\r\n")
    folder = make(before, "## Two\n\nText.\n")
    result = folder.main("check", "--fix")
    assert result.status == 0, result.out
    assert folder.text(folder.lesson()) == ("\ufeff" + MENDED).replace("\n", "\r\n")
    assert '-  {"kind": "open", "q": "Why?", "referense": "Because."},\n' in result.out
    assert "\nfixed 8 mistakes in 1 file (" in result.out
    assert "; nothing is left; `coursebuild undo` takes it back\n" in result.out
    assert folder.main("check").status == 0
    undone = folder.main("undo")
    assert (undone.status, undone.out) == (0, f"restored {folder.lesson()}\n")
    assert folder.text(folder.lesson()) == before
    again = folder.main("undo")
    assert (again.status, again.out) == (1, "")
    assert again.err.startswith("coursebuild: there is nothing to undo\n")


def test_undo_leaves_what_was_edited_since(make: Make) -> None:
    folder = make(
        "[a](model:servoo)\n\n" + GOOD, "[a](lesson:one)\n\n" + GOOD.replace("hello.", "h.")
    )
    folder.write("models/servo.xml", "<mujoco/>")
    assert folder.main("check", "--fix").status == 0
    folder.write(folder.lesson(), new_text := folder.text(folder.lesson()) + "More.\n")
    result = folder.main("undo")
    assert result.status == 1
    assert result.out == f"restored {folder.lesson(2)}\n"
    assert (
        result.err
        == f"coursebuild: {folder.lesson()} has been edited since, and was left as it is\n"
    )
    assert folder.text(folder.lesson()) == new_text
    assert folder.text(folder.lesson(2)).startswith("[a](lesson:one)")


def test_fix_makes_what_is_likely_only_when_asked(make: Make) -> None:
    text = "See [friction](term:frict) and [rest](lesson:1.3).\n\nThe [friction]{term} slows.\n"
    folder = make(text)
    result = folder.main("check", "--fix")
    assert result.status == 1
    assert folder.text(folder.lesson()) == text
    assert (
        "\nnothing fixed; 2 left; 1 more with `--unsafe`, if they are what you meant\n"
        in result.out
    )
    result = folder.main("check", "--fix", "--unsafe")
    assert result.status == 1
    assert folder.text(folder.lesson()) == text.replace("term:frict)", "term:friction)")
    assert "\nfixed 1 mistake in 1 file (link-term); 1 left;" in result.out


def test_fix_of_one_lesson_leaves_others(make: Make) -> None:
    text = "> [!nte] Title\n>\n> Text.\n"
    folder = make(text, text)
    assert folder.main("check", "--fix", "1.2").status == 0
    assert folder.text(folder.lesson()) == text
    assert folder.text(folder.lesson(2)) == text.replace("nte", "note")


def test_fix_follows_no_link_and_changes_nothing_elsewhere(make: Make) -> None:
    slip = "> [!nte] Title\n>\n> Text.\n"
    folder = make(GOOD, slip)
    folder.write("notes/two.md", slip)
    (folder.root / folder.lesson(2)).unlink()
    (folder.root / folder.lesson(2)).symlink_to("../../notes/two.md")
    result = folder.main("check", "--fix")
    assert result.status == 1
    assert "\nnothing fixed; 1 left\n" in result.out
    assert folder.text("notes/two.md") == slip


def test_fix_is_refused_where_it_would_do_harm(make: Make) -> None:
    """Two things cannot have the same id; the other fix is made."""
    text = "## Friction {#frict .furher}\n\nText.\n\n## Friction\n\n> [!nte] Title\n>\n> Text.\n"
    folder = make(text)
    folder.main("check", "--fix")
    assert "[!note]" in folder.text(folder.lesson())


def test_fix_overwrites_nothing_that_was_edited_while_scripts_ran(make: Make) -> None:
    text = "> [!nte] Title\n>\n> Text.\n\n"
    folder = make(text + block("x.py", WAIT_FOR_GO + "print(1)", "1", info="timeout=600"))
    with (
        (folder.tmp / "fix").open("wb") as errors,
        kill_at_end(folder.start("check", "--fix", stderr=errors.fileno())) as process,
    ):
        wait_until(lambda: b"running scripts" in (folder.tmp / "fix").read_bytes(), "the script")
        folder.write(folder.lesson(), new_text := folder.text(folder.lesson()) + "More.\n")
        folder.write("go", "")
        assert process.wait(600) == 1
    assert b"was changed in the meantime" in (folder.tmp / "fix").read_bytes()
    assert folder.text(folder.lesson()) == new_text
    assert folder.main("undo").status == 1


def test_options_that_do_not_go_with_fix(make: Make) -> None:
    folder = make(GOOD)
    for words in (["--unsafe"], ["--fix", "--truth"], ["--fix", "--against", "latest"]):
        assert folder.main("check", *words).status == 2


def test_fix_mends_one_misspelt_name_of_a_model_after_the_other(make: Make) -> None:
    """MuJoCo tells the first one only."""
    model = (
        "<mujoco>\n  <worldbody>\n    <bdoy>\n      <joint dampping='1' type='hindge'/>\n"
        "      <gom size='1'/>\n    </bdoy>\n  </worldbody>\n</mujoco>\n"
    )
    mended = model
    for slip, name in (("bdoy", "body"), ("dampping", "damping"), ("hindge", "hinge")):
        mended = mended.replace(slip, name)
    mended = mended.replace("gom", "geom")
    folder = make(f"{GOOD}```mjcf\n{model}```\n")
    folder.write("models/ball.xml", model)
    result = folder.main("check", "--fix")
    assert folder.text(folder.lesson()) == f"{GOOD}```mjcf\n{mended}```\n"
    assert folder.text("models/ball.xml") == mended
    assert "\nfixed 8 mistakes in 2 files (mjcf-error 4, model-error 4);" in result.out
