"""Scenarios of a model, with what their author left out filled in."""

from __future__ import annotations

from typing import Any

import mujoco
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mjbench.declarations import is_multiple
from mjbench.scene import Scene, SceneError, scenes
from samples.surveys import NO_DECLARATIONS, parse_declared

ARM = """\
<mujoco>
  <option timestep="{step}"/>
  <worldbody>
    <body>
      <joint name="a" axis="0 1 0"/>
      <geom type="capsule" size="0.02" fromto="0 0 0 0.4 0 0"/>
      <body pos="0.4 0 0">
        <joint type="ball"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 0.4 0 0" contype="0"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="a"/></actuator>
  <keyframe><key name="home" qpos="0.1 1 0 0 0"/><key qpos="0.2 1 0 0 0"/></keyframe>
</mujoco>
"""


def arm(step: float = 0.002) -> Any:
    return mujoco.MjModel.from_xml_string(ARM.format(step=step))


def only(text: str, model: Any = None) -> Scene:
    (scene,) = scenes(arm() if model is None else model, parse_declared("[[scenario]]\n" + text))
    return scene


def test_keyframes_are_scenarios_by_themselves() -> None:
    first, second = scenes(arm(), NO_DECLARATIONS)
    assert (first.name, first.scenario.keyframe) == ("home", 0)
    assert (second.name, second.scenario.keyframe) == ("keyframe-1", 1)
    assert first.scenario.duration == 2.0
    assert scenes(arm(), parse_declared("[[keep]]\nfinding='x'\nreason='y'\n"))[0].name == "home"


def test_where_nothing_moves_there_is_nothing_to_measure() -> None:
    still = mujoco.MjModel.from_xml_string("<mujoco/>")
    assert scenes(still, NO_DECLARATIONS) == ()
    with pytest.raises(SceneError, match="nothing can move"):
        scenes(still, parse_declared('[[scenario]]\nname = "a"\n'))


def test_what_is_declared_is_taken() -> None:
    scene = only(
        'name = "a"\nkeyframe = "home"\nqpos = [0, 2, 0, 0, 0]\nqvel = [1, 2, 3, 4]\n'
        "controls = [[1], [-1]]\nhold = 0.2\nsample = 0.04\nduration = 0.8\n"
        "timesteps = [0.04, 0.0005]\n"
    )
    scenario = scene.scenario
    assert scenario.qpos == (0, 1, 0, 0, 0), "quaternions are made unit ones"
    assert scenario.qvel == (1, 2, 3, 4)
    assert (scenario.duration, scenario.sample, scenario.hold) == (0.8, 0.04, 0.2)
    assert (scenario.keyframe, scenario.controls) == (0, ((1,), (-1,)))
    assert scene.timesteps == (0.0005, 0.002, 0.04)
    assert (scene.timestep, scene.title) == (0.002, "a")


@settings(max_examples=150, deadline=None)
@given(
    step=st.sampled_from([1e-4, 3e-4, 5e-4, 1e-3, 1 / 480, 2e-3, 3e-3, 5e-3, 0.01, 1 / 60, 0.1]),
    steps=st.integers(1, 30_000) | st.none(),
    sample=st.integers(1, 200) | st.none(),
    hold=st.integers(1, 400) | st.none(),
    count=st.integers(1, 40),
    quick=st.booleans(),
)
def test_all_times_are_whole_numbers_of_each_other(
    step: float, steps: int | None, sample: int | None, hold: int | None, count: int, quick: bool
) -> None:
    given_ones = {"duration": steps, "sample": sample, "hold": hold}
    lines = [f"{k} = {v * step!r}" for k, v in given_ones.items() if v is not None]
    if hold is not None:
        lines.append("controls = [" + "[1]," * count + "]")
    text = '[[scenario]]\nname = "a"\n' + "\n".join(lines) + "\n"
    declarations = parse_declared(text)
    try:
        (scene,) = scenes(arm(step), declarations, quick=quick)
    except SceneError:
        assume(False)
    scenario = scene.scenario
    assert is_multiple(scenario.duration, scenario.sample)
    assert is_multiple(scenario.sample, scene.timestep)
    if hold is not None:
        assert is_multiple(scenario.hold, scenario.sample)
    if steps is not None:
        assert scenario.duration == pytest.approx(steps * step)
    else:
        commanded = 0 if hold is None or count == 1 else hold * count * step
        assert scenario.duration >= max(2.0, commanded) * (1 - 1e-9)
        assert len(scenario.times) >= 2
    assert scene.timestep in scene.timesteps
    assert sorted(set(scene.timesteps)) == list(scene.timesteps)
    for timestep in scene.timesteps:
        assert is_multiple(scenario.sample, timestep)


def test_a_tiny_timestep_makes_a_short_scenario_from_the_models_own_state() -> None:
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><option timestep='1e-6'/><worldbody><body><joint/><geom size='1'/></body>"
        "</worldbody></mujoco>"
    )
    (scene,) = scenes(model, NO_DECLARATIONS)
    assert (scene.name, scene.scenario.keyframe) == ("start", -1)
    assert scene.scenario.duration == pytest.approx(0.02, rel=0.01)


@pytest.mark.parametrize(
    ("text", "message", "field"),
    [
        ("duration = 1.0001", "the model's timestep, 0.002 s, does not divide `duration`", ""),
        (
            "duration = 0.5\ntimesteps = [0.25, 0.1]",
            "the timestep 0.25 s does not divide the sample, 0.004 s",
            "timesteps",
        ),
        ("duration = 1e9", "1e+09 s in steps of 0.0005 s are over 10,000,000 steps", "duration"),
        (
            "sample = 0.1\ntimesteps = [1e-8]",
            "2.5 s in steps of 1e-08 s are over 10,000,000 steps",
            "timesteps",
        ),
        ("keyframe = 2", "the model has no keyframe `2`", "keyframe"),
        ("keyframe = 'work'", "the model has no keyframe `work`", "keyframe"),
        ("qpos = [1]", "`qpos` has 1 numbers, and the model takes 5", "qpos"),
        ("controls = [[1, 2]]", "`controls` has 2 numbers, and the model takes 1", "controls"),
        ("measure = 'site:tip'", "the model has no site `tip`", "measure"),
        ("sample = 0.1\nduration = 0.25", "`duration` (0.25 s) is not a multiple", "duration"),
    ],
)
def test_what_does_not_fit_or_would_take_hours_is_refused(
    text: str, message: str, field: str
) -> None:
    with pytest.raises(SceneError) as caught:
        scenes(arm(), parse_declared(f'[[scenario]]\nname = "a"\n{text}\n'), quick=True)
    assert caught.value.message.startswith(message)
    place = caught.value.place
    assert (place.keys[2:] if place else ()) == ((field,) if field else ())
