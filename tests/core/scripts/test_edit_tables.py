"""Recorded tables are updated in place, or the update is refused."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import Comparison, Filter
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import update_body
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from support.sample_lessons import DIGITS, EXACT, table, tolerance, update

HEAD = "| a | b | c |\n| --- | --- | --- |\n"


def table_after(
    rows: str, printed: str, comparison: Comparison = EXACT, filters: tuple[Filter, ...] = ()
) -> str:
    new = update(table(HEAD + rows), printed, comparison, filters)
    return new.body_span.text.removeprefix(HEAD)


def test_the_numbers_of_a_table_are_replaced_in_place() -> None:
    rows = "| `RK4` | **−0.000 %** |  3.9e-11|\n| Euler | +6.641 % | 6.9e-04 |"
    printed = "RK4    -0.001 % of 3.9e-11\nEuler  +6.702 % of 7.5e-04\n"
    assert table_after(rows, printed) == (
        "| `RK4` | **−0.001 %** |  3.9e-11|\n| Euler | +6.702 % | 7.5e-04 |"
    )
    assert table_after("| a | −1.5e-03 | 1.5e−03 |", "a -2.5e-03 -3.5e-03\n") == (
        "| a | −2.5e-03 | -3.5e−03 |"
    )


def test_a_table_under_digits_keeps_its_decimals() -> None:
    rows = "| Euler | 6.6 | 7e-04 |\n| RK4 | −1.25 | 4 |"
    printed = "Euler +6.7021 9.12e-04\nRK4 -2.349 5\n"
    assert table_after(rows, printed, DIGITS) == "| Euler | 6.7 | 9e-04 |\n| RK4 | −2.35 | 5 |"
    # a number with no more of them stays as it is printed
    assert table_after("| a | 0.123 | 4 |", "a 1.50e-01 4\n", DIGITS) == "| a | 1.50e-01 | 4 |"
    assert table_after(rows, printed, tolerance("0.01")) == (
        "| Euler | +6.7021 | 9.12e-04 |\n| RK4 | −2.349 | 5 |"
    )


CELLS = st.sampled_from(["Euler", "`RK4`", "**1.5 %**", "−2.50", "3.9e-11", "4", "x 7"])


@settings(max_examples=50)
@given(
    st.lists(st.tuples(CELLS, CELLS, CELLS), min_size=1, max_size=4),
    st.lists(
        st.sampled_from(["Euler 1.6 % -2.51 4", "RK4 1.5 % 3.8e-11 5", "x 7 x 8 -9.25", "4"]),
        min_size=1,
        max_size=5,
    ),
    st.sampled_from([EXACT, DIGITS, tolerance("0.5")]),
)
def test_tables_are_updated_right_or_refused(
    rows: list[tuple[str, str, str]], lines: list[str], comparison: Comparison
) -> None:
    lesson = table(HEAD + "\n".join(f"| {a} | {b} | {c} |" for a, b, c in rows))
    printed = "\n".join(lines)
    outcome = update_body(lesson, comparison, printed)
    if isinstance(outcome, Edit):
        update(lesson, printed, comparison)
    elif isinstance(outcome, Diagnostic):
        assert outcome.rule == "output-not-updatable"
    else:
        assert compare(lesson, comparison, printed).status == "verified"
