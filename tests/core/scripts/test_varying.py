"""Outputs that differ between two runs."""

from __future__ import annotations

from coursebuild.core.model import Comparison, Filter
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.findings import find_instability
from coursebuild.core.text.diagnostics import Diagnostic
from support.sample_lessons import DIGITS, ELLIPSIS, EXACT, describe, recording

SECONDS = Comparison(volatile="[0-9.]+ s")


def instability(
    first: str, second: str, comparison: Comparison = EXACT, recorded: str | None = None
) -> Diagnostic | None:
    """What is said of two runs that printed this; the first is recorded, if nothing else is."""
    lesson = recording(first if recorded is None else recorded)
    assert lesson.script is not None
    runs = [ScriptRun(lesson.script, Outcome.OK, 0, text, "", 1.0) for text in (first, second)]
    verdict = compare(lesson, comparison, second)
    return find_instability(verdict, runs[1], {lesson.script: runs[0]})


def instability_text(first: str, second: str, comparison: Comparison = EXACT) -> str:
    diagnostic = instability(first, second, comparison)
    assert diagnostic is not None
    return describe(diagnostic)


def test_lines_that_one_run_alone_printed_are_told() -> None:
    assert "-lost" in instability_text("a\nlost", "a")


def test_runs_that_differ_where_nothing_is_compared_are_stable() -> None:
    assert instability("x 1.500", "x 1.5004", DIGITS) is None
    assert instability("x 1.500", "x 1.501", DIGITS) is not None
    assert instability("a 2\n0x1", "a 2\n0x2", ELLIPSIS, recorded="a 2\n...") is None
    filtered = Comparison(course_filters=(Filter("0x.", "0x"),))
    assert instability("b 0x1", "b 0x2", filtered) is None
    assert instability("took 1 s", "took 2 s", SECONDS) is None
    assert instability("a", "b", recorded="c") is not None
    assert instability("a", "a", recorded="c") is None, "a drift that repeats"
