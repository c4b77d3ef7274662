"""Recorded tables: their cells are compared with what was printed."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Filter
from coursebuild.core.model.results import Verdict
from coursebuild.core.scripts.compare import compare
from support.sample_lessons import DIGITS, EXACT, VOLATILE, table, tolerance

OUTPUT = """\
integrators
  RK4           kinetic energy  -0.000 %   |change| 3.9e-11 kg m^2/s
  Euler         kinetic energy  +6.641 %   |change| 6.9e-04 kg m^2/s
  implicitfast  kinetic energy  -6.040 %   |change| 6.4e-04 kg m^2/s
  implicit      kinetic energy  -6.040 %   |change| 6.4e-04 kg m^2/s
"""
HEAD = "| integrator | energy | momentum |\n| --- | ---: | ---: |\n"
ROWS = """\
| RK4 | −0.000 % | 3.9e-11 |
| `Euler` | **+6.641 %** | 6.9e-04 |
| implicitfast | −6.040 % | 6.4e-04 |
| implicit | -6.040  % | 6.4e-04 kg m^2/s |"""


def verdict(
    rows: str,
    printed: str = OUTPUT,
    comparison: Comparison = EXACT,
    filters: tuple[Filter, ...] = (),
) -> Verdict:
    comparison = replace(comparison, course_filters=filters)
    return compare(table(HEAD + rows), comparison, printed)


def test_rows_stand_in_lines() -> None:
    assert verdict(ROWS).status == "verified"
    assert verdict(ROWS.split("\n")[2]).status == "verified"
    assert verdict("| Euler | | 6.9e-04 |").status == "verified"
    assert verdict("| | | |").status == "verified"


@pytest.mark.parametrize(
    "row",
    [
        "| implicit | 3.9e-11 | |",
        "| RK4 | 0.000 % | |",
        "| Euler | 6.641 % | |",
        "| Euler | +6.64 % | |",
        "| Eul | +6.641 % | |",
        "| Euler | +6.641 | 6.9 |",
        "| K4 | | |",
    ],
)
def test_words_and_numbers_stand_whole(row: str) -> None:
    assert verdict(row).status == "drift"


def test_numbers_match_by_the_mode() -> None:
    assert verdict("| Euler | 6.64 % | 6.9e-04 |", comparison=DIGITS).status == "verified"
    assert verdict("| Euler | 6.6 % | 7e-04 |", comparison=DIGITS).status == "verified"
    assert verdict("| Euler | 6.63 % | 7e-04 |", comparison=DIGITS).status == "drift"
    assert verdict("| Euler | 6.7 % | 7e-04 |", comparison=tolerance("0.1")).status == "verified"
    assert verdict("| Euler | 9.9 % | 7e-04 |", comparison=VOLATILE).status == "volatile"


def test_the_number_that_drifted_is_named() -> None:
    result = verdict(ROWS.replace("6.641", "6.702"))
    (change,) = result.changes
    assert (change.kind.value, change.recorded, change.printed) == ("numeric", "+6.702", "+6.641")
    assert change.span.text == "+6.702"
    assert change.span.source.line_text(change.span.line).startswith("| `Euler` | **+6.702")


def test_the_nearest_of_several_numbers_is_compared() -> None:
    (change,) = verdict("| Euler | | 6.8e-04 |").changes
    assert (change.recorded, change.printed) == ("6.8e-04", "6.9e-04")
    (change,) = verdict("| Euler | 7.0 | |", comparison=EXACT).changes
    assert (change.recorded, change.printed) == ("7.0", "+6.641")


def test_a_row_without_a_line_is_missing() -> None:
    (change,) = verdict(ROWS.replace("`Euler`", "`Midpoint`")).changes
    assert change.kind.value == "missing lines"
    assert change.recorded == "Midpoint +6.641 % 6.9e-04".replace(" +", "  +").replace("% ", "%  ")
    assert change.span.text == "`Midpoint` | **+6.641 %** | 6.9e-04"


def test_filters_apply_to_cells_and_lines() -> None:
    printed = "run 17: took 3.25 s, E 1.5\nrun 18: took 9.99 s, E 2.5\n"
    seconds = Filter(r"\d+\.\d+ s", "… s")
    rows = "| run 17 | took 1.00 s | 1.5 |\n| run 18 | took … s | 2.6 |"
    (change,) = verdict(rows, printed, EXACT, (seconds,)).changes
    assert (change.recorded, change.printed, change.span.text) == ("2.6", "2.5", "2.6")


def test_a_large_table() -> None:
    rows = "\n".join(f"| p{i} | {i / 7:.4f} |" for i in range(300))
    printed = "\n".join(f"noise {i}\nq p{i} = {i / 7:.4f}" for i in range(300))
    assert verdict(rows, printed).status == "verified"
    drifted = printed.replace(f"{70 / 7:.4f}", "99.5").replace("q p3 ", "q p_3 ")
    assert [(change.recorded, change.printed) for change in verdict(rows, drifted).changes] == [
        ("p3  0.4286", ""),
        ("10.0000", "99.5"),
    ]
