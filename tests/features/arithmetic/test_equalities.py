"""Verdicts on formulas that nobody wrote are those of SymPy, or there is none."""

from __future__ import annotations

from benchmarks.equalities import judge, make_cases
from benchmarks.formulas import functions, notations, symbols, values


def test_no_verdict_on_generated_formulas_is_false() -> None:
    kinds = (*values.KINDS, *symbols.KINDS)
    verdicts = [(case, judge(case)) for case in make_cases(480, seed=20, kinds=kinds)]
    mistakes = [pair for pair in verdicts if pair[1] not in (None, pair[0].truth)]
    assert mistakes == []
    for kind in kinds:
        mine = [(case, verdict) for case, verdict in verdicts if case.kind == kind.__name__]
        decided = [verdict for case, verdict in mine if case.truth is not None]
        assert decided.count(None) < len(decided) / 2, kind.__name__
        assert {True, False} <= set(decided), kind.__name__


def test_no_verdict_on_other_notations_is_false() -> None:
    kinds = [*notations.KINDS, *functions.KINDS]
    kinds.remove(functions.integrals)  # they take long
    verdicts = [(case, judge(case)) for case in make_cases(960, seed=20, kinds=kinds)]
    mistakes = [pair for pair in verdicts if pair[1] not in (None, pair[0].truth)]
    assert mistakes == []
    for verdict in (True, False):
        judged = {case.kind for case, v in verdicts if v is verdict}
        assert {"units", "rates", "percents", "commas", "chains", "series", "angles"} <= judged
