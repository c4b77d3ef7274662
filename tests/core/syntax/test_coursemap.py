"""How the course map says that outputs are compared; `test_data_texts` has all else."""

from __future__ import annotations

from decimal import Decimal

import pytest

from coursebuild.core.model import Comparison, Mode
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.text.source import Source


@pytest.mark.parametrize(
    ("verify", "expected"),
    [
        ("", Comparison()),
        ('compare = "exact"', Comparison()),
        ('compare = "digits"', Comparison(Mode.DIGITS)),
        ('compare = "rtol"\nrtol = 0.001', Comparison(Mode.TOLERANCE, Decimal("0.001"))),
        ("rtol = 1e-3", Comparison(Mode.TOLERANCE, Decimal("0.001"))),
        ("atol = 1_000.5", Comparison(Mode.TOLERANCE, Decimal(0), Decimal("1000.5"))),
        ("atol = 0x10", Comparison(Mode.TOLERANCE, Decimal(0), Decimal(16))),
        ("ellipsis = true", Comparison(ellipsis=True)),
    ],
)
def test_how_outputs_are_compared(verify: str, expected: Comparison) -> None:
    text = f'[course]\ntitle = "T"\n[verify]\n{verify}\n'
    course = parse_course_map(Source("content/course.toml", text)).value
    assert course is not None and course.comparison == expected
