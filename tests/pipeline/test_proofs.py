"""What was proved, still stands in a lesson, and is proved no longer."""

from __future__ import annotations

import pytest

from support.fixture_cases import fixture_tables
from support.scratch_course import Make, block

pytestmark = pytest.mark.site

OUTPUT = "time 0.357 s\nspeed 3.5 m/s"
LESSON = (
    "## Fall\n\n"
    + block("fall.py", "print('time 0.357 s')\nprint('speed 3.5 m/s')", OUTPUT)
    + "It takes `0.357 s`{out}, and ends with `3.5 m/s`{out}.\n"
)
"""An output and two values."""


def assert_told(make: Make, lesson: str, old: str, new: str, remark: str) -> None:
    """Check a right lesson, change it, and check that a remark comes of it; if empty, none."""
    folder = make(lesson)
    result = folder.main("check").require_success()
    assert "is not now" not in result.out
    folder.write(folder.lesson(1), lesson.replace(old, new))
    out = folder.main("check").out
    assert remark in out
    assert ("is not now" in out or "gave way" in out) is bool(remark)


@pytest.mark.parametrize(("old", "new", "remark"), fixture_tables("proofs")["values"])
def test_a_value_that_is_bound_no_longer_is_told(
    make: Make, old: str, new: str, remark: str
) -> None:
    assert_told(make, LESSON, old, new, remark)


def test_another_number_behind_the_words_that_chose_one_is_told(make: Make) -> None:
    code = "print('Euler: limit 10.65 ms')\nprint('RK4: limit 12.65 ms')"
    output = "Euler: limit 10.65 ms\nRK4: limit 12.65 ms"
    text = 'They are `10.65 ms`{out="limit"} and `12.65 ms`{out="limit"}.\n'
    lesson = f"## Limits\n\n{block('limits.py', code, output)}{text}"
    assert_told(make, lesson, "`10.65 ms`", "`12.65 ms`", "`10.65 ms` gave way to `12.65 ms`")


@pytest.mark.parametrize(("old", "new", "remark"), fixture_tables("proofs")["formulas"])
def test_a_formula_that_is_not_decided_any_more_is_told(
    make: Make, old: str, new: str, remark: str
) -> None:
    lesson = (
        "## Plate\n\nIt has $16\\cdot0.2\\cdot0.2 = 0.64$ kg.\n"
        '$p${symbol="momentum" unit="kg m/s"} and $F${symbol="force" unit="N"}'
        ", and $\\dot p = F$.\n"
    )
    assert_told(make, lesson, old, new, remark)


def test_an_output_that_became_an_illustration_is_told_once(make: Make) -> None:
    lesson = "## Fall\n\n" + block("fall.py", "print('time', 0.357, 's')", "time 0.357 s")
    folder = make(lesson)
    assert folder.main("check").status == 0
    illustration = lesson.replace("Output:\n\n```text", "```text illustration")
    remark = (
        "1.1: the output of `examples/fall.py` in line 8 was proved before and is not now "
        "(proved: nothing)"
    )
    for text, is_told in ((illustration, True), (f"{illustration}\nIt fell.\n", False)):
        folder.write(folder.lesson(1), text)
        result = folder.main("check")
        assert (result.status, remark in result.out) == (0, is_told), result.out


def test_what_was_proved_is_kept_while_there_are_errors(make: Make) -> None:
    folder = make(LESSON)
    folder.main("check")
    changed = LESSON.replace("`0.357 s`{out}", "`0.357 s`")
    for text in (changed + "\n[a](lesson:9.9)\n", changed):
        folder.write(folder.lesson(1), text)
        assert "`0.357 s` in line 15 was proved before" in folder.main("check").out


def test_another_lesson_with_the_same_text_is_not_meant(make: Make) -> None:
    folder = make(LESSON, "## Two\n\nIt takes `0.357 s`.\n")
    folder.main("check")
    folder.write(folder.lesson(2), "## Two\n\nIt takes 0.357 s.\n")
    assert "is not now" not in folder.main("check").out


def test_a_table_without_its_caption_is_told(make: Make) -> None:
    rows = "| t | x |\n| --- | --- |\n| 1 | 22.5 |\n"
    code = "```python file=examples/t.py\nprint('t x')\nprint('1 22.5')\n```\n\n"
    remark = "the table of `examples/t.py` in line 11 was proved"
    lesson = f"## T\n\n{code}Output:\n\n{rows}"
    assert_told(make, lesson, "Output:", "Table: Data", remark)


@pytest.mark.parametrize(("old", "new", "remark"), fixture_tables("proofs")["links"])
def test_a_link_that_became_text_is_told(make: Make, old: str, new: str, remark: str) -> None:
    lesson = "## Fall\n\nAs [there](#fall), not [so](#fall).\n"
    assert_told(make, lesson, old, new, remark)


@pytest.mark.parametrize(("old", "new", "remark"), fixture_tables("proofs")["blocks"])
def test_a_block_or_section_whose_word_is_misspelt_is_told(
    make: Make, old: str, new: str, remark: str
) -> None:
    question = '{"kind": "numeric", "id": "a", "q": "One and one?", "answer": 2, "tol": 0.1}'
    quiz = f'```quiz\n{{"id": "1.1-q", "title": "Q", "questions": [\n{question}]}}\n```\n\n'
    section = "\n### The *sum* of [it](#sum) {#sum .further}\n\nIt is two.\n"
    lesson = f"## Sums\n\n{quiz}```mjcf\n<mujoco/>\n```\n{section}"
    assert_told(make, lesson, old, new, remark)
