"""`check --fix` mends form and no word; `check --propose` asks; `undo` takes both back."""

from __future__ import annotations

import random
import re

import pytest

from support.fixture_cases import fixture_text
from support.scratch_course import GOOD, WAIT_FOR_GO, Make, block, kill_at_end
from support.waiting import wait_until

pytestmark = pytest.mark.site

QUIZ = fixture_text("documents/fixed_quiz.md")
SLIPS = GOOD.replace("text\n", "text rtol=1e-6\n") + QUIZ.replace('"}', '",}').replace(
    '"q",', '"q"'
)
MENDED = GOOD.replace("text\n", "text rtol=1e-6\n") + QUIZ
MISSPELT = (
    "See [friction](term:fricton) and [the other](lesson:tow).\n\nThe [friction]{term} slows.\n"
)
"""Names that are near others: what was meant, a human has to say."""


def test_fix_mends_all_form_and_undo_takes_it_back(make: Make) -> None:
    """And no other byte."""
    before = ("\ufeff" + SLIPS).replace("\n", "\r\n")
    folder = make(before, "## Two\n\nText.\n")
    result = folder.main("check", "--fix").require_success()
    assert folder.text(folder.lesson()) == ("\ufeff" + MENDED).replace("\n", "\r\n")
    assert '-  {"kind": "open", "q": "Why?", "reference": "Because.",}\n' in result.out
    assert "\nfixed 2 mistakes in 1 file (" in result.out
    assert "; nothing is left; `coursebuild undo` takes it back\n" in result.out
    assert folder.main("check").status == 0
    undone = folder.main("undo")
    assert (undone.status, undone.out) == (0, f"restored {folder.lesson()}\n")
    assert folder.text(folder.lesson()) == before
    again = folder.main("undo")
    assert (again.status, again.out) == (1, "")
    assert again.err.startswith("coursebuild: there is nothing to undo\n")


def test_numbers_that_a_script_printed_are_proposed_to_be_bound(make: Make) -> None:
    script = "```python file=examples/a.py\nprint('mass', 3 * 17.1, 'kg')\n```\n\n"
    lesson = f"{script}```output digits\nmass 51.3 kg\n```\n\nIt has a mass of 51.3 kg.\n"
    folder = make(lesson)
    assert "proposal" not in folder.main("check", "--propose").out.replace("there is nothing", "")
    out = folder.main("check", "--propose", "--truth").out
    assert "\n+It has a mass of `51.3`{out} kg.\n1 proposal; in a terminal" in out


def test_names_are_proposed_and_changed_by_nobody_else(make: Make) -> None:
    folder = make(MISSPELT, "## Two\n\nText.\n")
    result = folder.main("check", "--fix")
    assert result.status == 1
    assert "\nnothing fixed; 2 left; `coursebuild check --propose` has " in result.out
    result = folder.main("check", "--propose")
    assert result.status == 1
    assert "\n+See [friction](term:friction) and [the other](lesson:tow).\n" in result.out
    assert "; in a terminal, each can be accepted\n" in result.out
    assert folder.text(folder.lesson()) == MISSPELT


KNOWN = (
    "mj_data mj_step mjData MjData qpos qvel ctrl parentframe parent_frame joint_margin jnt_margin"
    " max_step step_height tex_height localpos local_pos geom_xpos body_mass timestep integrator"
    " compute_torque pd_controller wrist_3_link wrist_3_joint Heatmap heatmap numpy print range"
).split()
ALPHABETS = (
    "αβγδεθλμπω",
    "абвгдежзик",
    "אבגדהוזח",
    "अआइईउऊ",
    "一二三重力速度",
    "éèüöäßñçø",
    "abcdefgh",
)
NUMBER_FORMS = (
    "{a}.{b} m/s²", "{a},{b} kg", "−{a}.{b}e-{c}", "v{a}.{b}.{c}", "20{c:02}-0{d}-1{d}", "{a}/{b}",
    "{a}:{b}", "{a} %", "€{a}.{b:02}", "H{d}O", "{a}×{b}", "{a}–{b}", "[{a}, {b})", "0x{a:x}",
    "{a}st", "IPv{d}", "{a}e{c}", "{a}.{b}°", "1{d}:0{d}", "{a}·10⁻³", "x{a}", "#{a}",
)  # fmt: skip


def right_words(chance: random.Random) -> str:
    """A name or a number that an author may well mean, at times near to a known one."""
    name = chance.choice(KNOWN)
    at = chance.randrange(len(name))
    near = name[:at] + chance.choice(["", name[at] * 2, "_", "x"]) + name[at + 1 :]
    word = "".join(chance.choices(chance.choice(ALPHABETS), k=chance.randint(2, 9)))
    a, b, c, d = (chance.randrange(n) for n in (1000, 100, 30, 10))
    number = chance.choice(NUMBER_FORMS).format(a=a, b=b, c=c, d=d)
    return chance.choice(
        [
            f"`{near}`", f"`{near}()`", f"`model.{near}[{d}]`", f"`{number}`", f"{word} {number}",
            number, f"${word[:1]}_{{{c}}} \\approx {a}.{b}$", f"**{word}**",
            f"[{near} {number}][1]", f"[{word}](lesson:1.{d % 2 + 1})",
            f"`<{name} {near}=\"{number}\"/>`", f"`{word}`{d}",
        ]
    )  # fmt: skip


OPEN_QUESTION = '{"kind": "open", "q": "Why?", "reference": "So.",}'
FORM_SLIPS = (
    f'```quiz\n{{"id": "q%d", "questions": [{OPEN_QUESTION}]}}\n```\n',
    "## Part {#part-%d\n",
    "A bell \x07 rings %d times.\n",
)


def test_fix_changes_none_of_500_right_names_and_numbers(make: Make) -> None:
    chance = random.Random(57)
    texts = []
    for lesson in range(2):
        parts = ["## Words\n", "[1]: https://example.org/\n"]
        for part in range(25):
            parts.append(", ".join(right_words(chance) for _ in range(10)) + ".\n")
            parts.append(FORM_SLIPS[part % len(FORM_SLIPS)] % (100 * lesson + part))
        texts.append("\n".join(parts))
    folder = make(*texts)
    result = folder.main("check", "--fix")
    assert int(re.findall(r"fixed (\d+) mistakes", result.out)[0]) >= 25, "there was much to mend"
    mended = [folder.text(folder.lesson(n)) for n in (1, 2)]
    for before, after in zip(texts, mended, strict=True):
        words = [
            re.findall(r"(?<!\w)[-−+]?\d[\d.,]*\d|\w+", text.replace("\x07", ""))
            for text in (before, after)
        ]
        assert words[0] == words[1]
    again = folder.main("check", "--fix")
    assert "nothing fixed; " in again.out
    assert [folder.text(folder.lesson(n)) for n in (1, 2)] == mended


def test_undo_leaves_what_was_edited_since(make: Make) -> None:
    folder = make("## A {#a\n\n" + GOOD, "## A {#a\n\n" + GOOD.replace("hello.", "h."))
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
    assert folder.text(folder.lesson(2)).startswith("## A {#a\n")


def test_fix_of_one_lesson_leaves_others(make: Make) -> None:
    text = "## A {#a\n\nText.\n"
    folder = make(text, text)
    assert folder.main("check", "--fix", "1.2").status == 0
    assert folder.text(folder.lesson()) == text
    assert folder.text(folder.lesson(2)) == text.replace("#a", "#a}")


def test_fix_follows_no_link_and_changes_nothing_elsewhere(make: Make) -> None:
    slip = "## A {#a\n\nText.\n"
    folder = make(GOOD, slip)
    folder.write("notes/two.md", slip)
    (folder.root / folder.lesson(2)).unlink()
    (folder.root / folder.lesson(2)).symlink_to("../../notes/two.md")
    result = folder.main("check", "--fix")
    assert result.status == 1
    assert "\nnothing fixed; 1 left\n" in result.out
    assert folder.text("notes/two.md") == slip


def test_fix_is_refused_where_it_would_do_harm(make: Make) -> None:
    """Without the white space before it, a block that is only shown would have more mistakes."""
    block = '    ```quiz\n    {"id": "q", "one": 1, "two": 2}\n    ```\n'
    text = f"## One {{#a\n\nText.\n\n{block}"
    folder = make(text)
    folder.main("check", "--fix")
    assert folder.text(folder.lesson()) == text.replace("#a", "#a}")


def test_fix_overwrites_nothing_that_was_edited_while_scripts_ran(make: Make) -> None:
    text = "## A {#a\n\nText.\n\n"
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
    for words in (
        ["--fix", "--propose"],
        ["--propose", "--shard", "1/2"],
        ["--fix", "--truth"],
        ["--fix", "--against", "latest"],
    ):
        assert folder.main("check", *words).status == 2
