"""What a file beside a model becomes, and everything that can be wrong in it."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import Declarations, Measured
from coursebuild.core.syntax.declarations import parse_declarations
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Source

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

[[sweep]]
name = "soft"
scenario = "rest"
vary = { "geom:a b.solref" = [[0.1, 1]], "option.cone" = ["elliptic"], "body.mass" = "± 2.5 %" }
show = ["penetration"]

[[keep]]
finding = "sensor-unread tip"
reason = "lesson 5.2 reads it"
"""


def parse(text: str) -> Parsed[Declarations | None]:
    return parse_declarations(Source("models/arms/arm.toml", text))


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_a_complete_file(newline: str) -> None:
    parsed_file = parse(COMPLETE.replace("\n", newline))
    assert not parsed_file.diagnostics
    declarations = parsed_file.value
    assert declarations is not None
    assert declarations.model == "arms/arm"
    assert (declarations.bench.visible, declarations.bench.visible_angle) == (0.02, 2.0)
    first, second, third = declarations.scenarios
    assert (first.name, first.title, first.keyframe) == ("reach", "A reach", "home")
    assert (first.qpos, first.qvel) == ((0.0, 1.5), (0.5, 0.0))
    assert (first.duration, first.sample, first.hold) == (2.0, 0.1, 0.5)
    assert first.controls == ((0.5, 0.3), (-0.5, 1.0), (0.0, 0.0))
    assert first.observable == Measured("site", "tip of it")
    assert (first.reference, first.closed_form, first.conserved) == ("ode", "", ())
    assert first.timesteps == (0.001, 0.05)
    assert first.place("keyframe").text == '"home"'
    assert first.place("nothing").text == "[[scenario]]"
    assert (second.keyframe, second.closed_form) == (0, "damped-spring-0.1")
    assert second.conserved == ("energy", "angular-momentum")
    assert (second.duration, second.sample, second.hold, second.measure) == (None, None, None, None)
    assert (third.title, third.keyframe, third.reference) == (None, None, "self")
    assert third.conserved is None
    (sweep,) = declarations.sweeps
    assert (sweep.name, sweep.scenario, sweep.show) == ("soft", "rest", ("penetration",))
    assert [
        (variation.parameter, variation.values, variation.relative)
        for variation in sweep.variations
    ] == [
        ("geom:a b.solref", ((0.1, 1.0),), False),
        ("option.cone", ("elliptic",), False),
        ("body.mass", (0.975, 1.025), True),
    ]
    assert sweep.variations[0].span.text == '"geom:a b.solref"'
    (keep,) = declarations.keep
    assert (keep.finding, keep.reason) == ("sensor-unread tip", "lesson 5.2 reads it")
    assert keep.finding_span.text == '"sensor-unread tip"'


@pytest.mark.parametrize("text", ["", "# nothing\n", "[bench]\n"])
def test_an_empty_file(text: str) -> None:
    parsed_file = parse(text)
    assert parsed_file.diagnostics == ()
    assert parsed_file.value is not None
    assert (parsed_file.value.scenarios, parsed_file.value.keep) == ((), ())
    assert (parsed_file.value.bench.visible, parsed_file.value.bench.visible_angle) == (0.01, 1.0)


@settings(max_examples=60)
@given(st.text(alphabet='[]{}"=.,#\nabcdefghijklmnopqrstuvwxyz0123456789- é', max_size=80))
def test_no_text_makes_reading_scenarios_raise(text: str) -> None:
    parse(text)
    parse(COMPLETE + text)
