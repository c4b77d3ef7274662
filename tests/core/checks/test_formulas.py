"""Formulas: which a document has, and where those that do not parse stand."""

from __future__ import annotations

from coursebuild.core.checks.lessons import check_formulas, document_formulas
from coursebuild.core.model.results import Formula, MathError
from support.made_courses import make_course, messages, rules_and_texts


def test_each_formula_is_listed_once_in_order_of_first_use() -> None:
    course = make_course("A $b$ and $$a$$ and $b$.\n\n$$\nb\n$$\n\n- $a$ and $$a$$\n\n$c$\n")
    assert document_formulas(course.documents[0]) == (
        Formula("b", False),
        Formula("a", True),
        Formula("b", True),
        Formula("a", False),
        Formula("c", False),
    )


def test_a_wrong_formula_is_reported_at_each_place() -> None:
    document = make_course("Text $a$ and $x + y$.\n\n> $x + y$, $$x + y$$\n").documents[0]
    good = {Formula("a", False): "", Formula("x + y", True): ""}
    for position, expected in ((None, "x + y"), (0, "x"), (4, "y"), (5, "y"), (99, "y")):
        typeset = {**good, Formula("x + y", False): MathError("no good", position)}
        diagnostics = check_formulas(document, typeset)
        assert rules_and_texts(diagnostics) == [f"math-syntax: {expected}"] * 2
        assert messages(diagnostics) == ["the formula does not parse: no good"] * 2
        assert [d.span.line for d in diagnostics] == [1, 3]
