"""Declared scenarios against the compiled model."""

from __future__ import annotations

import pytest

from coursebuild.core.checks.compiled import check_scenarios
from support.made_courses import facts, make_course, said, told

MODEL = facts(
    nq=3,
    nv=2,
    nu=1,
    timestep=0.002,
    keyframes=("home", "", "up"),
    body_names=("world", "arm"),
    sites=("tip",),
    sensors=("", "gyro"),
)


def findings(*lines: str, model: object = MODEL) -> list[str]:
    text = "\n".join(('[[scenario]]\nname = "swing"', *lines))
    (declared,) = make_course(models={}, declared={"box": text}).declarations
    found = tuple(check_scenarios(declared, MODEL if model is MODEL else facts()))
    return [f"{a}; {b}" for a, b in zip(told(found), said(found), strict=True)]


@pytest.mark.parametrize(
    "line",
    [
        "",
        "keyframe = 0",
        "keyframe = 2",
        'keyframe = "up"',
        "qpos = [1, 2, 3]",
        "qvel = [1, 2]",
        "controls = [[1], [2]]\nhold = 0.5",
        'measure = "body:arm"',
        'measure = "site:tip"',
        'measure = "sensor:gyro"',
        "duration = 1.0\nsample = 0.01",
        "duration = 0.5",
        "duration = 0.002\nsample = 0.002",
    ],
)
def test_a_scenario_that_fits_its_model_is_good(line: str) -> None:
    assert findings(line) == []


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("keyframe = 3", "3; the model has no keyframe 3: it has 3, counted from 0"),
        ('keyframe = "hom"', '"hom"; the model has no keyframe `hom` [did you mean `home`?]'),
        ('keyframe = "zzzzz"',
         '"zzzzz"; the model has no keyframe `zzzzz` [known: `home`, `up`]'),
        ("qpos = [1, 2]",
         "[; `qpos` has 2 numbers, and the model has 3 positions (`nq`)"),
        ("qvel = [1, 2, 3]",
         "[; `qvel` has 3 numbers, and the model has 2 velocities (`nv`)"),
        ("controls = [[1, 2], [1, 2]]\nhold = 0.5",
         "[; a command has 2 numbers, and the model has 1 actuators"),
        ('measure = "body:arn"',
         '"body:arn"; the model has no body `arn` [did you mean `arm`?]'),
        ('measure = "site:top"', '"site:top"; the model has no site `top` [did you mean `tip`?]'),
        ('measure = "sensor:tip"',
         '"sensor:tip"; the model has no sensor `tip` [known: `gyro`]'),
        ("duration = 1.0\nsample = 0.005",
         "0.005; the model's timestep, 0.002 s, does not divide `sample` (0.005 s)"
         " [a multiple near it is 0.004]"),
        ("duration = 0.001",
         "0.001; the model's timestep, 0.002 s, does not divide `duration` (0.001 s)"
         " [a multiple near it is 0.002]"),
        ("controls = [[1], [2]]\nhold = 0.003",
         "0.003; the model's timestep, 0.002 s, does not divide `hold` (0.003 s)"
         " [a multiple near it is 0.004]"),
    ],
)  # fmt: skip
def test_what_does_not_fit_the_model_is_told_at_its_value(line: str, expected: str) -> None:
    assert findings(line) == [f"scenario-model: {expected}"]


def test_a_model_without_keyframes_says_so() -> None:
    assert findings("keyframe = 0", model=None) == [
        "scenario-model: 0; the model has no keyframe 0: it has none, counted from 0"
    ]


def test_all_that_is_wrong_with_all_scenarios_is_told() -> None:
    second = '[[scenario]]\nname = "fall"\nkeyframe = 7\nqvel = [1]'
    found = findings("keyframe = 8", "duration = 0.003", second)
    assert [one.split(";")[0] for one in found] == [
        "scenario-model: 8",
        "scenario-model: 0.003",
        "scenario-model: 7",
        "scenario-model: [",
    ]
