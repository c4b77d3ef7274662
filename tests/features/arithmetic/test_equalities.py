"""Verdicts on formulas that nobody wrote are those of SymPy, or there is none."""

from __future__ import annotations

from benchmarks.equalities import KINDS, judge, make_cases

COUNT = 480


def test_no_verdict_on_generated_formulas_is_false() -> None:
    cases = [*make_cases(COUNT, seed=20)]
    verdicts = [(case, judge(case)) for case in cases]
    mistakes = [pair for pair in verdicts if pair[1] not in (None, pair[0].truth)]
    assert mistakes == []
    for kind in KINDS:
        mine = [(case, verdict) for case, verdict in verdicts if case.kind == kind.__name__]
        decided = [verdict for case, verdict in mine if case.truth is not None]
        assert decided.count(None) < len(decided) / 2, kind.__name__
        assert {True, False} <= set(decided), kind.__name__
