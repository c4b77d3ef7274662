"""A sample of the mistakes that `benchmarks/mistakes.py` makes, of each kind, in a small course."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from benchmarks.mistakes import describe, run, table  # noqa: E402
from benchmarks.slips.changes import KINDS  # noqa: E402

COURSE = ROOT / "tests/courses/full/course"
EXPECTED = Path(__file__).parent / "mistakes.md"


@pytest.mark.site
def test_mistakes_of_each_kind_end_as_they_did(rewriting: bool) -> None:
    outcomes = list(run(COURSE, [37], 2 * len(KINDS), KINDS, 1))
    lines = table(outcomes)
    for outcome in outcomes:
        if outcome.end in ("silent", "elsewhere", "reason"):
            lines += ["", *describe(outcome, (COURSE / outcome.change.path).read_text("utf-8"))]
    text = "\n".join(["# How a sample of mistakes ends", "", *lines, ""])
    if rewriting:
        EXPECTED.write_text(text, encoding="utf-8")
    assert text == EXPECTED.read_text(encoding="utf-8")
    assert {outcome.change.kind for outcome in outcomes} >= {*KINDS} - {"declarations of models"}
