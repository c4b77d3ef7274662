"""Formulas that were meant: found, and money left alone."""

from __future__ import annotations

import pytest

from coursebuild.core.syntax.unread_markup import unread_formula


@pytest.mark.parametrize(
    ("text", "at"),
    [
        (r"The angle is $4 - 2\pi = $ small.", 13),
        (r"It is $a_1", 6),
        ("so $ x^2$ is", 3),
        (r"\omega b$, as before", 8),
        (r"$x_{ij} and \$", 0),
        (r"$5\,\mathrm{m}", 0),
        ("It costs $5 and $6.", None),
        (r"$3.50, or $1,200. \frac is no command here", None),
        ("$HOME and $PATH", None),
        (r"\alpha alone", None),
        ("x_1 alone", None),
        ("", None),
    ],
)
def test_formulas_that_were_meant_are_found_and_money_is_not(text: str, at: int | None) -> None:
    assert unread_formula([(0, text)]) == at


def test_texts_with_something_between_them_are_no_command() -> None:
    assert unread_formula([(0, "$ and \\"), (20, "pi")]) is None
    assert unread_formula([(0, "$ and \\"), (7, "pi")]) == 0


def test_the_place_counts_from_the_content() -> None:
    assert unread_formula([(3, "so"), (9, r"$\pi")]) == 9
