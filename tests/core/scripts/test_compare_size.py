"""Large outputs of every shape are compared, whole and in part."""

from __future__ import annotations

import random

from coursebuild.core.model.results import DriftKind
from support.sample_lessons import DIGITS, DIGITS_ELLIPSIS, ELLIPSIS, EXACT, verdict


def numbers(count: int, seed: int) -> list[str]:
    chance = random.Random(seed)
    return [
        f"row {chance.random():.6f} {chance.random():.3e} {chance.randint(0, 9)}"
        for _ in range(count)
    ]


def test_a_few_changes_among_thousands_of_lines_are_found() -> None:
    rows = numbers(4000, 1)
    new_rows = [*rows[:10], "new", *rows[10:2000], *rows[2003:3600], "row 9.5 1e-3 77"]
    result = verdict("\n".join(rows), "\n".join([*new_rows, *rows[3601:]]))
    assert [change.kind for change in result.changes] == [
        DriftKind.EXTRA,
        DriftKind.MISSING,
        *[DriftKind.NUMERIC] * 3,
    ]
    assert [change.printed for change in result.changes[2:]] == ["9.5", "1e-3", "77"]


def test_thousands_of_lines_that_all_differ_are_compared_in_step() -> None:
    recorded, printed = "\n".join(numbers(2000, 1)), "\n".join(numbers(2000, 2))
    result = verdict(recorded, printed, DIGITS_ELLIPSIS)
    assert len({change.span.line for change in result.changes}) > 1990


def test_large_outputs_of_every_shape() -> None:
    rows = numbers(2000, 1)
    ellipses = "\n".join(["a", "...", "b x...y 1.5", "..."] * 400)
    output = "\n".join(["a", "b x 2 y 1.52", "c"] * 560)
    for recorded, printed, comparison, status in (
        ("\n".join(rows), "\n".join(random.Random(3).sample(rows, 2000)), EXACT, "drift"),
        ("\n".join(["a", "b"] * 1000), "\n".join(["b", "b", "a"] * 700), EXACT, "drift"),
        (ellipses, output, DIGITS_ELLIPSIS, "verified"),
        (ellipses + "\nend", output, DIGITS_ELLIPSIS, "drift"),
        ("...\n" + "a\n" * 400 + "b\n...", "a\n" * 800, ELLIPSIS, "drift"),
        ("0.125 " * 4000, "0.1250 " + "0.125 " * 3999, DIGITS, "verified"),
        ("0.125 " * 2000, "0.126 x " + "0.125 " * 1998, EXACT, "drift"),
        ("0.5 ... " * 500 + "end", "0.5  " * 2000 + "end", DIGITS_ELLIPSIS, "verified"),
        ("...1.0 " + "0.5 " * 500 + "2.0...", "0.5 " * 2000, DIGITS_ELLIPSIS, "drift"),
        ("a\nb", "a" + "\n" * 20_000 + "b", EXACT, "drift"),
        ("a", "a" + " " * 100_000 + "\n" * 100_000, EXACT, "verified"),
        ("a", "a" + " " * 100_000 + "b", EXACT, "drift"),
    ):
        result = verdict(recorded, printed, comparison)
        assert result.status == status, (recorded[:40], printed[:40])
