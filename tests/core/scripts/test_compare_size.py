"""Comparing outputs of every size and shape takes work in proportion to their size."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from coursebuild.core.model import Comparison
from coursebuild.core.model.results import DriftKind, Verdict
from coursebuild.core.scripts.lines import LineMatcher, find_parts
from coursebuild.core.scripts.numbers import Number
from support.growth import grows_in_proportion
from support.sample_lessons import DIGITS, DIGITS_ELLIPSIS, ELLIPSIS, EXACT
from support.sample_verdicts import verdict

pytestmark = pytest.mark.site

Texts = Callable[[int], tuple[str, str]]


def compared(texts: Texts, size: int, comparison: Comparison = EXACT) -> Verdict:
    """What was recorded and printed, made for a size and for twice that, compared."""

    def work(size: int) -> Verdict:
        return verdict(*texts(size), comparison)

    return grows_in_proportion(work, size)


def numbers(count: int, seed: int) -> list[str]:
    chance = random.Random(seed)
    return [
        f"row {chance.random():.6f} {chance.random():.3e} {chance.randint(0, 9)}"
        for _ in range(count)
    ]


@pytest.mark.parametrize("comparison", [EXACT, DIGITS, DIGITS_ELLIPSIS], ids=str)
def test_lines_that_all_differ(comparison: Comparison) -> None:
    def texts(size: int) -> tuple[str, str]:
        return "\n".join(numbers(size, 1)), "\n".join(numbers(size, 2))

    found = compared(texts, 250, comparison)
    assert len({change.span.line for change in found.changes}) > 490


def test_lines_that_all_differ_and_some_that_are_missing() -> None:
    def texts(size: int) -> tuple[str, str]:
        return "\n".join(numbers(size, 1)), "\n".join(numbers(size * 7 // 10, 2))

    assert compared(texts, 250, DIGITS_ELLIPSIS).changes[-1].kind is DriftKind.MISSING


def test_many_lines_with_a_few_changes() -> None:
    def texts(size: int) -> tuple[str, str]:
        rows = numbers(size, 1)
        half, end = size // 2, size * 9 // 10
        changed = [*rows[:10], "new", *rows[10:half], *rows[half + 3 : end], "row 9.5 1e-3 77"]
        return "\n".join(rows), "\n".join([*changed, *rows[end + 1 :]])

    found = compared(texts, 500)
    assert [change.kind for change in found.changes] == [
        DriftKind.EXTRA,
        DriftKind.MISSING,
        *[DriftKind.NUMERIC] * 3,
    ]
    assert [change.ran for change in found.changes[2:]] == ["9.5", "1e-3", "77"]


def test_lines_in_another_order() -> None:
    def texts(size: int) -> tuple[str, str]:
        rows = numbers(size, 1)
        return "\n".join(rows), "\n".join(random.Random(3).sample(rows, size))

    assert compared(texts, 500).status == "drift"


def test_many_equal_lines() -> None:
    def texts(size: int) -> tuple[str, str]:
        return "\n".join(["a", "b"] * size), "\n".join(["b", "b", "a"] * (size * 7 // 10))

    assert compared(texts, 250).status == "drift"


@pytest.mark.parametrize(("end", "status"), [("", "verified"), ("\nend", "drift")])
def test_many_lines_of_ellipses(end: str, status: str) -> None:
    def texts(size: int) -> tuple[str, str]:
        recorded = "\n".join(["a", "...", "b x...y 1.5", "..."] * size)
        return recorded + end, "\n".join(["a", "b x 2 y 1.52", "c"] * (size * 7 // 5))

    assert compared(texts, 200, DIGITS_ELLIPSIS).status == status


def test_long_blocks_that_nearly_fit() -> None:
    def texts(size: int) -> tuple[str, str]:
        return "...\n" + "a\n" * size + "b\n...", "a\n" * (2 * size)

    assert compared(texts, 250, ELLIPSIS).status == "drift"


def test_a_long_line_that_matches() -> None:
    def texts(size: int) -> tuple[str, str]:
        return "0.125 " * size, ("0.125 " * size).replace("0.125", "0.1250", 1)

    assert compared(texts, 1000, DIGITS).status == "verified"


def test_a_long_line_that_differs() -> None:
    def texts(size: int) -> tuple[str, str]:
        return "0.125 " * size, ("0.125 " * size).replace("0.125 0.125", "0.126 x", 1)

    assert compared(texts, 1000).status == "drift"


def test_a_line_of_ellipses() -> None:
    def texts(size: int) -> tuple[str, str]:
        return "0.5 ... " * size + "end", "0.5  " * (4 * size) + "end"

    assert compared(texts, 250, DIGITS_ELLIPSIS).status == "verified"


def test_a_line_between_ellipses_whose_first_number_does_not_stand_there() -> None:
    def texts(size: int) -> tuple[str, str]:
        return "...1.0 " + "0.5 " * size + "2.0...", "0.5 " * (4 * size)

    assert compared(texts, 250, DIGITS_ELLIPSIS).status == "drift"


def test_a_line_between_ellipses_that_nearly_fits_everywhere_is_given_up() -> None:
    """All its places would take tens of millions of comparisons."""
    matcher = LineMatcher(DIGITS_ELLIPSIS)
    count = 0

    def same(recorded: Number, ran: Number) -> bool:
        nonlocal count
        count += 1
        return recorded.text == ran.text

    parts = matcher.parts("..." + "0.5 " * 4000 + "2.0 ...")
    assert find_parts(parts, matcher.canon("0.5 " * 16_000), same) is None
    assert 1_000_000 < count < 2_100_000


@pytest.mark.parametrize("end", ["b", ""])
def test_many_lines_where_two_were_recorded(end: str) -> None:
    def texts(size: int) -> tuple[str, str]:
        return "a\nb", "a" + "\n" * size + end if end else "a\n" * size

    assert compared(texts, 1000).status == "drift"
