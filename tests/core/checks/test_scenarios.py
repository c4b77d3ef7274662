"""Declared scenarios against the compiled model: what `fixtures/rules` does not show."""

from __future__ import annotations

import pytest

from coursebuild.core.checks.compiled import check_scenarios
from support.made_courses import facts, make_course, messages, rules_and_texts

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
GOOD = (
    *("", "keyframe = 0", "keyframe = 2", 'keyframe = "up"', "qpos = [1, 2, 3]", "qvel = [1, 2]"),
    *("controls = [[1], [2]]\nhold = 0.5", 'measure = "body:arm"', 'measure = "site:tip"'),
    *('measure = "sensor:gyro"', "duration = 1.0\nsample = 0.01", "duration = 0.5"),
    "duration = 0.002\nsample = 0.002",
)


def messages_of(*scenarios: str) -> list[str]:
    texts = (f'[[scenario]]\nname = "s{n}"\n{text}\n' for n, text in enumerate(scenarios))
    (declarations,) = make_course(models={}, declaration_texts={"box": "".join(texts)}).declarations
    diagnostics = tuple(check_scenarios(declarations, MODEL))
    return [
        f"{a}; {b}"
        for a, b in zip(rules_and_texts(diagnostics), messages(diagnostics), strict=True)
    ]


def test_scenarios_that_fit_their_model_are_good() -> None:
    assert messages_of(*GOOD) == []


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ('keyframe = "zzzzz"',
         '"zzzzz"; the model has no keyframe `zzzzz` [known: `home`, `up`]'),
        ('measure = "site:top"', '"site:top"; the model has no site `top` [did you mean `tip`?]'),
        ('measure = "sensor:tip"',
         '"sensor:tip"; the model has no sensor `tip` [known: `gyro`]'),
        ("duration = 0.001",
         "0.001; the model's timestep, 0.002 s, does not divide `duration` (0.001 s)"
         " [a multiple near it is 0.002]"),
        ("controls = [[1], [2]]\nhold = 0.003",
         "0.003; the model's timestep, 0.002 s, does not divide `hold` (0.003 s)"
         " [a multiple near it is 0.004]"),
    ],
)  # fmt: skip
def test_a_mismatch_with_the_model_is_reported_at_its_value(line: str, expected: str) -> None:
    assert messages_of(line) == [f"scenario-model: {expected}"]


def test_all_mismatches_of_all_scenarios_are_reported() -> None:
    messages = messages_of("keyframe = 8\nduration = 0.003", "keyframe = 7\nqvel = [1]")
    assert [message.partition(";")[0] for message in messages] == [
        f"scenario-model: {place}" for place in ("8", "0.003", "7", "[")
    ]
