"""Outputs of every size and shape are compared in reasonable time."""

from __future__ import annotations

import random
import time

import pytest

from coursebuild.model import Comparison
from coursebuild.results import DriftKind, Verdict
from coursebuild.scripts.compare import compare
from support.sample_lessons import (
    DIGITS,
    DIGITS_ELLIPSIS,
    ELLIPSIS,
    EXACT,
    recording,
)


def quickly(seconds: float, recorded: str, printed: str, comparison: Comparison) -> Verdict:
    lesson = recording(recorded)
    start = time.perf_counter()
    found = compare(lesson, comparison, (), printed)
    assert time.perf_counter() - start < seconds
    return found


def numbers(count: int, seed: int) -> list[str]:
    chance = random.Random(seed)
    return [
        f"row {chance.random():.6f} {chance.random():.3e} {chance.randint(0, 9)}"
        for _ in range(count)
    ]


@pytest.mark.parametrize("comparison", [EXACT, DIGITS, DIGITS_ELLIPSIS], ids=str)
def test_ten_thousand_lines_that_all_differ(comparison: Comparison) -> None:
    rows, others = numbers(10_000, 1), numbers(10_000, 2)
    found = quickly(20, "\n".join(rows), "\n".join(others), comparison)
    assert len({c.span.line for c in found.changes}) > 9_900
    found = quickly(20, "\n".join(rows), "\n".join(others[:7000]), comparison)
    assert found.changes[-1].kind is DriftKind.MISSING


def test_ten_thousand_lines_with_a_few_changes() -> None:
    rows = numbers(10_000, 1)
    changed = [
        *rows[:100],
        "new",
        *rows[100:5000],
        *rows[5003:9000],
        "row 9.5 1e-3 77",
        *rows[9001:],
    ]
    found = quickly(20, "\n".join(rows), "\n".join(changed), EXACT)
    assert [c.kind for c in found.changes] == [
        DriftKind.EXTRA,
        DriftKind.MISSING,
        DriftKind.NUMERIC,
        DriftKind.NUMERIC,
        DriftKind.NUMERIC,
    ]
    assert [c.ran for c in found.changes[2:]] == ["9.5", "1e-3", "77"]


def test_lines_without_order() -> None:
    rows = numbers(10_000, 1)
    shuffled = random.Random(3).sample(rows, len(rows))
    quickly(30, "\n".join(rows), "\n".join(shuffled), EXACT)


def test_many_equal_lines() -> None:
    quickly(20, "\n".join(["a", "b"] * 5000), "\n".join(["b", "b", "a"] * 3500), EXACT)


def test_many_ellipses() -> None:
    recorded = "\n".join(["a", "...", "b x...y 1.5", "..."] * 2500)
    printed = "\n".join(["a", "b x 2 y 1.52", "c"] * 3500)
    assert quickly(20, recorded, printed, DIGITS_ELLIPSIS).status == "verified"
    assert quickly(30, recorded + "\nend", printed, DIGITS_ELLIPSIS).status == "drift"


def test_long_blocks_that_nearly_fit() -> None:
    recorded = "...\n" + "a\n" * 5000 + "b\n..."
    quickly(20, recorded, "a\n" * 10_000, ELLIPSIS)


def test_one_enormous_line() -> None:
    line = "0.125 " * 60_000
    assert quickly(20, line, line.replace("0.125", "0.1250", 1), DIGITS).status == "verified"
    found = quickly(30, line, line.replace("0.125 0.125", "0.126 x", 1), EXACT)
    assert found.status == "drift"


def test_a_line_of_ellipses() -> None:
    recorded = "0.5 ... " * 10_000 + "end"
    assert quickly(20, recorded, "0.5  " * 40_000 + "end", DIGITS_ELLIPSIS).status == "verified"
    quickly(20, "...1.0 " + "0.5 " * 10_000 + "2.0...", "0.5 " * 40_000, DIGITS_ELLIPSIS)
    quickly(20, "..." + "0.5 " * 10_000 + "2.0 ...", "0.5 " * 40_000, DIGITS_ELLIPSIS)


def test_hundreds_of_thousands_of_lines() -> None:
    quickly(20, "a\nb", "a" + "\n" * 2**18 + "b", EXACT)
    quickly(30, "a\nb", "a\n" * 2**18, EXACT)
