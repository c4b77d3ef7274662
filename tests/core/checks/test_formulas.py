"""Formulas: which a course has, and where those that do not parse stand."""

from __future__ import annotations

import pytest

from coursebuild.core.checks.formulas import check_formulas, course_formulas
from coursebuild.core.model.results import Formula, MathError
from support.made_courses import make_course, said, told


def test_each_formula_is_listed_once_in_order_of_first_use() -> None:
    course = make_course("A $b$ and $$a$$ and $b$.\n", "$$\nb\n$$\n\n- $a$ and $$a$$\n", "$c$\n")
    assert course_formulas(course) == (
        Formula("b", False),
        Formula("a", True),
        Formula("b", True),
        Formula("a", False),
        Formula("c", False),
    )


@pytest.mark.parametrize(
    ("position", "expected"),
    [(None, "x + y"), (0, "x"), (4, "y"), (5, "y"), (99, "y")],
)
def test_a_formula_is_told_where_it_stops_to_parse(position: int | None, expected: str) -> None:
    course = make_course("Text $a$ and $x + y$.\n")
    typeset: dict[Formula, str | MathError] = {
        Formula("a", False): "",
        Formula("x + y", False): MathError("no good", position),
    }
    found = check_formulas(course, typeset)
    assert told(found) == [f"math-syntax: {expected}"]
    assert said(found) == ["the formula does not parse: no good"]


def test_each_place_of_a_wrong_formula_is_told() -> None:
    course = make_course("A $x$.\n", "> B $x$, $$x$$.\n")
    typeset: dict[Formula, str | MathError] = {
        Formula("x", False): MathError("no", 0),
        Formula("x", True): "",
    }
    found = check_formulas(course, typeset)
    places = [(d.span.path, d.span.column) for d in found]
    assert places == [("content/lessons/1.1-first.md", 4), ("content/lessons/1.2-second.md", 6)]


def test_formulas_that_all_parse_are_good() -> None:
    assert check_formulas(make_course("A $x$.\n"), {Formula("x", False): "<math/>"}) == ()
