"""Outputs that differ between two runs, and the pattern that is proposed where they are times."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Filter
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import apply_edits
from coursebuild.core.scripts.findings import find_instability
from coursebuild.core.text.diagnostics import Diagnostic
from support.fixture_cases import fixture_tables
from support.sample_lessons import (
    DIGITS,
    ELLIPSIS,
    EXACT,
    describe,
    document,
    recording,
    recordings,
)

CASES = fixture_tables("times")

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
    assert "`lost` was printed in the first run only" in instability_text("a\nlost", "a")
    first, second = ("\n".join(f"{i}{x}" for i in range(12)) for x in ("", "x"))
    assert "note: and 2 more lines" in instability_text(first, second)


def test_runs_that_differ_where_nothing_is_compared_are_stable() -> None:
    assert instability("x 1.500", "x 1.5004", DIGITS) is None
    assert instability("x 1.500", "x 1.501", DIGITS) is not None
    assert instability("a 2\n0x1", "a 2\n0x2", ELLIPSIS, recorded="a 2\n...") is None
    filtered = Comparison(course_filters=(Filter("0x.", "0x"),))
    assert instability("b 0x1", "b 0x2", filtered) is None
    assert instability("took 1 s", "took 2 s", SECONDS) is None
    assert instability("a", "b", recorded="c") is not None
    assert instability("a", "a", recorded="c") is None, "a drift that repeats"


TIMES = CASES["patterns"]


@pytest.mark.parametrize(("first", "second", "pattern"), TIMES)
def test_a_time_that_differs_gets_a_pattern_that_makes_the_runs_the_same(
    first: str, second: str, pattern: str
) -> None:
    diagnostic = instability(first, second)
    assert diagnostic is not None
    assert diagnostic.help == f'a time varies: say `volatile="{pattern}"` on the fence'
    source = diagnostic.span.source
    lesson = document(apply_edits(source.text, diagnostic.edits), source.path)
    (mended,) = recordings(lesson)
    assert mended.comparison is not None and mended.comparison.volatile == pattern
    for printed in (first, second):
        assert compare(mended, mended.comparison, printed).status == "verified"


def test_a_second_time_is_added_to_what_varies_already() -> None:
    comparison = replace(SECONDS, volatile="load [0-9.]+ s")
    diagnostic = instability("load 1 s\nran 2.5 h", "load 2 s\nran 2.7 h", comparison)
    assert diagnostic is not None
    assert "load [0-9.]+ s|[0-9.]+ h" in diagnostic.help


@pytest.mark.parametrize(("first", "second"), CASES["unlike"])
def test_nothing_is_proposed_where_more_than_times_would_vary(first: str, second: str) -> None:
    diagnostic = instability(first, second)
    assert diagnostic is not None
    assert diagnostic.edits == ()
    assert "a fixed seed" in diagnostic.help
