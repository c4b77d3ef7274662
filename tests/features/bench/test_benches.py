"""Shown reports: their model, their scenario, and whether something was recorded."""

from __future__ import annotations

import pytest

from coursebuild.features.bench.checks import check_benches, check_keyframes
from coursebuild.numerics.reports.records import BENCH
from support.made_courses import BOX, facts, make_course, said, told


def findings(info: str, declared: str = "", files: tuple[str, ...] = ()) -> list[str]:
    named = {"box": declared} if declared else {}
    course = make_course(
        f"```bench {info}\n```\n", models={"box": BOX}, declared=named, files=files
    )
    found = tuple(check_benches(course, course.documents))
    return [f"{a}; {b}" for a, b in zip(told(found), said(found), strict=True)]


def test_a_model_that_is_not_there_is_all_that_is_told() -> None:
    assert findings("bix scenario=x") == [
        "bench-model: bix; no model `bix` in models/ [did you mean `box`?]"
    ]


def test_a_model_of_which_nothing_was_recorded_is_told() -> None:
    assert findings("box") == [
        "bench-unrecorded: box; nothing was recorded of the model `box`, so the page says so"
        " [measure it with `coursebuild bench box --record`]"
    ]


def test_a_recorded_model_with_a_declared_scenario_is_good() -> None:
    files = (BENCH.path("box"),)
    declared = '[[scenario]]\nname = "swing"\n'
    assert findings("box", files=files) == []
    assert findings("box scenario=swing", declared, files) == []
    assert findings("box scenario=swung", declared, files) == [
        "bench-scenario: swung; the model `box` has no scenario `swung` [did you mean `swing`?]"
    ]
    declared += '[[sweep]]\nname = "soft"\nvary = { "option.timestep" = [0.001] }\n'
    assert findings("box sweep=soft", declared, files) == []
    assert findings("box sweep=sift", declared, files) == [
        "bench-scenario: sift; the model `box` has no sweep `sift` [did you mean `soft`?]"
    ]
    # Of a model that declares none, nobody knows before it is compiled.
    assert findings("box scenario=swung", files=files) == []


@pytest.mark.parametrize(
    ("info", "keyframes", "expected"),
    [
        ("box", ("home",), []),
        ("box scenario=home", ("home",), []),
        ("box scenario=keyframe-1", ("home", ""), []),
        ("box scenario=start", (), []),
        ("box scenario=start", ("home",), ["bench-scenario: start"]),
        ("box scenario=hom", ("home",), ["bench-scenario: hom"]),
    ],
)
def test_keyframes_are_the_scenarios_of_a_model_that_declares_none(
    info: str, keyframes: tuple[str, ...], expected: list[str]
) -> None:
    course = make_course(f"```bench {info}\n```\n")
    found = check_keyframes(course, lambda _: facts(keyframes=keyframes))
    assert told(found) == expected
