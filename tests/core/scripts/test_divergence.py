"""A script is judged by what it says of itself, where it came to its end."""

from __future__ import annotations

from msgspec.structs import replace

from coursebuild.core.model.results import Divergence, Outcome, ScriptRun, Sign, Trace
from coursebuild.core.scripts.extract import Extraction, extract
from coursebuild.core.scripts.failures import divergence, is_lost
from support.sample_lessons import course, document, ran

LESSON = "```python file=examples/a.py\nprint(1)\n```\n"
LOST = Divergence(Sign.VELOCITIES, "0.1", "m", "examples/a.py", 1)
DEEP = Divergence(Sign.CONTACT, "0.1", "m", "examples/a.py", 1, "0.3", ("a", "b"))


def extraction(*, diverges: bool = False, deep: bool = False) -> Extraction:
    (found,) = extract(course(document(LESSON))).value
    return replace(found, script=replace(found.script, diverges=diverges, deep=deep))


def run(*found: Divergence, outcome: Outcome = Outcome.OK) -> ScriptRun:
    trace = Trace((), (), (), (), "", found)
    return replace(ran(outcome=outcome), trace=trace)


def rules(script: Extraction, result: ScriptRun) -> list[str]:
    return [diagnostic.rule for diagnostic in divergence(script, result, [script])]


def test_a_script_that_says_it_diverges_and_ends_well_without_is_wrong() -> None:
    assert rules(extraction(diverges=True), run()) == ["script-stable"]
    assert rules(extraction(diverges=True), run(LOST)) == []


def test_of_a_script_that_says_it_diverges_and_fails_nothing_is_said() -> None:
    assert rules(extraction(diverges=True), run(outcome=Outcome.FAILED)) == []


def test_of_a_script_that_nobody_watched_nothing_is_said() -> None:
    assert rules(extraction(diverges=True, deep=True), ran()) == []


def test_a_script_that_says_its_bodies_lie_deep_and_ends_well_without_is_wrong() -> None:
    assert rules(extraction(deep=True), run()) == ["script-shallow"]
    assert rules(extraction(deep=True), run(DEEP)) == []
    assert rules(extraction(deep=True), run(outcome=Outcome.FAILED)) == []


def test_what_a_script_does_not_say_of_itself_is_found() -> None:
    assert rules(extraction(), run()) == []
    assert rules(extraction(), run(LOST, DEEP)) == ["script-diverged"]
    assert rules(extraction(), run(DEEP)) == ["script-penetration"]
    assert rules(extraction(), run(LOST, outcome=Outcome.FAILED)) == ["script-diverged"]


def test_lost_is_a_simulation_that_diverged_unsaid() -> None:
    assert is_lost(extraction(), run(LOST))
    assert not is_lost(extraction(diverges=True), run(LOST))
    assert not is_lost(extraction(), run(DEEP))
    assert not is_lost(extraction(), ran())
