"""What a file beside a model becomes, and everything that can be wrong in it."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import Declarations, Measured
from coursebuild.core.syntax.scenarios import parse_declarations
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Source
from support.positioned_nodes import shown

COMPLETE = """\
# the arm
[bench]
visible = 0.02
visible_angle = 2

[[scenario]]
name = "reach"
title = "A reach"
keyframe = "home"
qpos = [0, 1.5]
qvel = [0.5, 0]
duration = 2
sample = 0.1
controls = [[0.5, 0.3], [-0.5, 1.0], [0, 0]]
hold = 0.5
measure = "site:tip of it"
reference = "ode"
conserved = []
timesteps = [0.001, 0.05]

[[scenario]]
name = "rest"
keyframe = 0
reference = "closed:damped-spring-0.1"
conserved = ["energy", "angular-momentum"]

[[scenario]]
name = "other"
controls = [[1, 2]]
reference = "self"

[[keep]]
finding = "sensor-unread tip"
reason = "lesson 5.2 reads it"
"""


def parse(text: str) -> Parsed[Declarations | None]:
    return parse_declarations(Source("models/arms/arm.toml", text))


def told(text: str) -> list[str]:
    return shown(parse(text).diagnostics)


def test_everything_that_a_file_can_say() -> None:
    parsed = parse(COMPLETE)
    assert not parsed.diagnostics
    declared = parsed.value
    assert declared is not None
    assert declared.model == "arms/arm"
    assert (declared.visible.share, declared.visible.angle) == (0.02, 2.0)
    reach, rest, other = declared.scenarios
    assert (reach.name, reach.title, reach.keyframe) == ("reach", "A reach", "home")
    assert (reach.qpos, reach.qvel) == ((0.0, 1.5), (0.5, 0.0))
    assert (reach.duration, reach.sample, reach.hold) == (2.0, 0.1, 0.5)
    assert reach.controls == ((0.5, 0.3), (-0.5, 1.0), (0.0, 0.0))
    assert reach.measure == Measured("site", "tip of it")
    assert reach.measure.text == "site:tip of it"
    assert (reach.reference, reach.closed, reach.conserved) == ("ode", "", ())
    assert reach.timesteps == (0.001, 0.05)
    assert reach.place("keyframe").text == '"home"'
    assert reach.place("nothing").text == "[[scenario]]"
    assert (rest.keyframe, rest.reference, rest.closed) == (0, None, "damped-spring-0.1")
    assert rest.conserved == ("energy", "angular-momentum")
    assert (rest.duration, rest.sample, rest.hold, rest.measure) == (None, None, None, None)
    assert (other.title, other.keyframe, other.reference) == ("", None, "self")
    assert other.conserved is None
    (keep,) = declared.keep
    assert (keep.finding, keep.reason) == ("sensor-unread tip", "lesson 5.2 reads it")
    assert keep.finding_span.text == '"sensor-unread tip"'


@pytest.mark.parametrize("text", ["", "# nothing\n", "[bench]\n"])
def test_a_file_may_say_nothing(text: str) -> None:
    parsed = parse(text)
    assert parsed.diagnostics == ()
    assert parsed.value is not None
    assert (parsed.value.scenarios, parsed.value.keep) == ((), ())
    assert (parsed.value.visible.share, parsed.value.visible.angle) == (0.01, 1.0)


ONE = '[[scenario]]\nname = "a"\n'
EVEN = "the state is looked at in even steps, and a command changes at such a look"
SAME = "every timestep must end at the same times, or errors cannot be compared"

MISTAKES = [
    ("\ufeff", ["1:1-2 toml-syntax: U+FEFF (zero width no-break space) cannot stand"]),
    ("x = 1 2\n", ["1:7-8 toml-syntax: expected the end of the line, found `2`"]),
    ("[scenario]\nname = 'a'\n", ["1:1-11 field-type: `scenario` must be an array of tables"]),
    ("[[scenarios]]\nname = 'a'\n", ["1:3-12 field-unknown: unknown field `scenarios` [did you"]),
    ("[[scenario]]\n", ["1:1-13 field-missing: `name` is missing [`name`: by which reports"]),
    ('[[scenario]]\nname = "A b"\n', ["2:8-13 field-value: `name` cannot be `A b` [expected:"]),
    (ONE + 'keyfram = "x"\n', ["3:1-8 field-unknown: unknown field `keyfram` [did you mean `k"]),
    (ONE + "keyframe = -1\n", ["3:12-14 field-value: `keyframe` must be at least 0, not -1"]),
    (ONE + "keyframe = true\n", ["3:12-16 field-type: `keyframe` must be an integer or a string"]),
    (ONE + "duration = 0\n", ["3:12-13 field-value: `duration` must be greater than 0, not 0"]),
    (ONE + "duration = inf\n", ["3:12-15 field-value: `duration` must be a finite number, not i"]),
    (ONE + 'duration = "2"\n', ["3:12-15 field-type: `duration` must be a number, not a string"]),
    (ONE + "qpos = [1, 'a']\n", ["3:12-15 field-type: `qpos[1]` must be a number, not a string"]),
    (
        ONE + "controls = [1, 2]\n",
        ["3:13-14 field-type: `controls[0]` must be an a", "3:16-17 field-type: `controls[1]`"],
    ),
    (ONE + 'measure = "tip"\n', ["3:11-16 field-value: `measure` cannot be `tip` [expected: `b"]),
    (ONE + 'measure = "site:"\n', ["3:11-18 field-value: `measure` cannot be `site:` [expected:"]),
    (ONE + 'reference = "exact"\n', ["3:13-20 field-value: `reference` cannot be `exact` [expec"]),
    (
        ONE + 'reference = "closed:tumbling-bx"\n',
        [
            "3:13-33 field-value: no hard case with a closed form is called `tumbling-bx` "
            "[did you mean `tumbling-box`?]"
        ],
    ),
    (ONE + 'conserved = ["mass"]\n', ["3:14-20 field-value: `conserved[0]` cannot be `mass`"]),
    (
        ONE + "duration = 1\nsample = 0.3\n",
        [f"3:12-13 field-value: `duration` (1 s) is no multiple of `sample` (0.3 s) [{EVEN}]"],
    ),
    (
        ONE + "hold = 0.25\nsample = 0.1\ncontrols = [[1]]\n",
        [f"3:8-12 field-value: `hold` (0.25 s) is no multiple of `sample` (0.1 s) [{EVEN}]"],
    ),
    (
        ONE + "duration = 1\nsample = 1e-6\n",
        ["4:10-14 field-value: `sample` makes 1e+06 looks at the state [100000 are the most: "],
    ),
    (
        ONE + "sample = 0.1\ntimesteps = [0.1, 0.03]\n",
        [f"4:19-23 field-value: the timestep 0.03 s does not divide `sample` (0.1 s) [{SAME}]"],
    ),
    (
        ONE + "duration = 0.1\ntimesteps = [0.2]\n",
        [f"4:14-17 field-value: the timestep 0.2 s does not divide `duration` (0.1 s) [{SAME}]"],
    ),
    (ONE + "timesteps = [0.1, 1e-1]\n", ["3:19-23 field-value: the timestep 0.1 s is named twice"]),
    (
        ONE + "hold = 0.5\n",
        ["3:8-11 field-missing: `controls` is missing [`controls` are the commands, each held"],
    ),
    (
        ONE + "controls = [[1], [2]]\n",
        ["1:1-13 field-missing: `hold` is missing [`hold`: seconds for which each command holds]"],
    ),
    (
        ONE + "hold = 1\ncontrols = [[1, 2], [3]]\n",
        ["4:21-22 field-value: this command has 1 numbers, and the first one has 2 [give one n"],
    ),
    (
        ONE + "duration = 1\nhold = 1\ncontrols = [[1], [3]]\n",
        ["5:12-13 field-value: only 1 of 2 commands come before the end [make `duration` longer"],
    ),
    (ONE + ONE, ["4:8-11 field-value: two scenarios have the name `a`"]),
    ("[[keep]]\nfinding = 'x'\n", ["1:1-9 field-missing: `reason` is missing [`reason`: why it"]),
    (
        "[[keep]]\nfinding = 'x'\nreason = ' '\n",
        ["3:10-13 field-value: `reason` is empty"],
    ),
    (
        2 * "[[keep]]\nfinding = 'x'\nreason = 'y'\n",
        ["5:11-14 field-value: the finding `x` is kept twice"],
    ),
    ("[bench]\nvisible = 2\n", ["2:11-12 field-value: `visible` must be at most 1, not 2"]),
    ("[bench]\nvisibel = 1\n", ["2:1-8 field-unknown: unknown field `visibel` [did you mean `v"]),
]


@pytest.mark.parametrize(("text", "expected"), MISTAKES, ids=[text for text, _ in MISTAKES])
def test_each_mistake_in_scenarios_is_told_at_its_place(text: str, expected: list[str]) -> None:
    found = told(text)
    assert [one[: len(start)] for one, start in zip(found, expected, strict=True)] == expected
    assert parse(text).value is None


def test_every_mistake_is_told_in_one_go() -> None:
    text = COMPLETE.replace('"home"', "[]").replace("hold = 0.5", "hold = 0.55")
    text = text.replace('reason = "', 'reasons = "')
    assert [line.split(":")[0] for line in told(text)] == ["9", "34"]
    assert [line.split(":")[0] for line in told(text.replace("keyframe = []", ""))] == ["15", "34"]


def test_line_ends_of_windows() -> None:
    parsed = parse(COMPLETE.replace("\n", "\r\n"))
    assert parsed.diagnostics == ()
    assert parsed.value is not None
    assert parsed.value.scenarios[0].place("hold").text == "0.5"


@settings(max_examples=60)
@given(st.text(alphabet='[]{}"=.,#\nabcdefghijklmnopqrstuvwxyz0123456789- é', max_size=80))
def test_no_text_makes_reading_scenarios_raise(text: str) -> None:
    parse(text)
    parse(COMPLETE + text)
