"""What takes part in the motion and need not: actuators, contact, far things."""

from __future__ import annotations

import itertools

import pytest

from mjbench.reports.diet_report import INTERFACE_LABEL, MEASURED_LABEL, PROVED_LABEL
from samples.surveys import (
    PENDULUM,
    field,
    findings_by_kind,
    fixed_text,
    names,
    parse_declared,
    run_survey,
    scene,
)

pytestmark = pytest.mark.long


def test_actuators_that_nobody_commands() -> None:
    rest = """<actuator>
    <motor name="push" joint="pivot"/>
    <position name="servo" joint="pivot" kp="10"/>
    <motor name="lazy" joint="pivot" ctrllimited="true" ctrlrange="1 2"/>
    <motor name="brake" joint="rest" damping="1"/>
    <motor name="rotor" joint="rest" armature="1"/>
    <pid name="two" joint="rest" kp="5"/>
    <motor name="last" joint="rest"/>
  </actuator>
  <keyframe><key name="up" qpos="1 0" ctrl="0 0 0 0 0 0 0 0"/></keyframe>"""
    resting = '<body pos="9 0 0"><joint name="rest"/><geom size=".1"/></body>'
    clock = itertools.count(step=10**6).__next__
    survey = run_survey(scene(PENDULUM + resting, rest=rest), clock=clock)
    finding = findings_by_kind(survey)["actuator-idle"]
    assert names(finding) == ["push", "last"] and finding.label == INTERFACE_LABEL
    assert finding.saving.time == 1.0
    assert "0 0 0 0 0 0" in {edit.new for edit in finding.edits}, "of the keyframe"
    assert not finding.is_fault and rest in fixed_text(survey), "who commands may be elsewhere"


def test_proof_holds_in_states_that_no_scenario_passes_through() -> None:
    """MuJoCo compensates gravity by actuators only where there is one; at rest nothing shows it."""
    text = scene(
        """<body name="arm" pos="0 0 1" gravcomp="1"><joint name="h" actuatorgravcomp="true"
          axis="0 1 0"/><geom size=".05" pos="0 0 -.3"/></body>""",
        rest='<actuator><motor name="idle" joint="h"/></actuator>',
    )
    assert "actuator-idle" not in findings_by_kind(run_survey(text))


def test_tendons_along_which_nothing_acts() -> None:
    rest = """<tendon>
    <fixed name="pull"><joint joint="pivot" coef="1"/></fixed>
    <fixed name="soft" stiffness="3"><joint joint="pivot" coef="1"/></fixed>
    <fixed name="bound" limited="true" range="0 1"><joint joint="pivot" coef="1"/></fixed>
    <fixed name="measured"><joint joint="pivot" coef="1"/></fixed>
    <fixed name="lazy"><joint joint="pivot" coef="1"/></fixed>
    <fixed><joint joint="pivot" coef="2"/></fixed>
  </tendon>
  <actuator><motor name="m" tendon="pull"/></actuator>"""
    survey = run_survey(scene(rest=rest), lesson='data.ctrl[0]; data.tendon("measured").J')
    assert names(findings_by_kind(survey)["tendon-idle"]) == ["lazy", "mujoco/tendon/fixed[6]"]
    left = fixed_text(survey)
    assert left.count("<fixed") == 4 and "lazy" not in left
    survey = run_survey(scene(rest=rest), lesson="data.ctrl[0]; data.ten_length[4]")
    assert "tendon-idle" not in findings_by_kind(survey)
    assert names(findings_by_kind(survey)["coupling-idle"]) == ["bound"]  # it never was at its end


def test_contact_is_off_where_nothing_can_touch() -> None:
    world = PENDULUM + '<geom name="far" size=".1" pos="0 0 2"/>'
    survey = run_survey(scene(world))
    finding = findings_by_kind(survey)["contact-off"]
    assert finding.label == PROVED_LABEL and finding.proof.startswith("no two geoms can meet")
    left = fixed_text(survey)
    assert '<option><flag contact="disable"/></option>' in left
    assert run_survey(left).edits == ()


def test_what_only_did_not_touch_is_told_and_left() -> None:
    world = PENDULUM + '<geom name="near" size=".1" pos="0 0 1.35"/>'
    survey = run_survey(scene(world))
    finding = findings_by_kind(survey)["contact-idle"]
    assert finding.label == MEASURED_LABEL and not finding.fixable and not finding.is_fault
    assert fixed_text(survey) == scene(world)


def test_geoms_that_can_touch_nothing_need_no_contact() -> None:
    world = """<geom name="floor" type="plane" size="1 1 1"/>
    <geom name="lamp" size=".1" pos="0 0 9"/>
    <body name="swing" pos="0 0 5"><joint axis="0 1 0"/>
      <geom name="s" size=".1" pos="1 0 0"/></body>
    <body name="near" pos="1.5 0 .15"><joint axis="0 1 0"/>
      <geom name="n" size=".1" pos=".2 0 0"/></body>"""
    survey = run_survey(scene(world))
    finding = findings_by_kind(survey)["collision-unreachable"]
    assert names(finding) == ["lamp", "s"] and finding.label == PROVED_LABEL
    left = fixed_text(survey)
    assert '<geom name="lamp" size=".1" pos="0 0 9" contype="0" conaffinity="0"/>' in left
    assert '<geom name="n" size=".1" pos=".2 0 0"/>' in left
    assert "collision-unreachable" not in findings_by_kind(run_survey(left))


@pytest.mark.long
def test_all_of_a_field_of_rubble_goes_and_the_arm_stays() -> None:
    """All forty boxes and sixty fixed geoms, of which no single one is in the arm's way."""
    posts = "".join(
        f'<geom type="cylinder" size=".05 1" pos="{40 + i % 10} {i // 10} 1"/>' for i in range(60)
    )
    survey = run_survey(field(3, 40).replace("</worldbody>", posts + "</worldbody>"))
    far = findings_by_kind(survey)["far-body"]
    assert len(names(far)) == 40 and far.label == MEASURED_LABEL and far.difference < 1e-9
    assert not far.fixable and not far.is_fault and far.doubt == ""
    posts = {f"mujoco/worldbody/geom[{number}]" for number in range(2, 62)}
    assert set(names(findings_by_kind(survey)["collision-idle"])) >= posts
    assert fixed_text(survey).count("<freejoint/>") == 40
    survey = run_survey(field(3, 2), lesson="import mujoco\nprint(data.qpos[0])")
    assert findings_by_kind(survey)["far-body"].doubt == "examples/a.py may notice"


def far(world: str, *, lesson: str = "", rest: str = "") -> list[str]:
    finding = findings_by_kind(run_survey(scene(world, rest=rest), lesson=lesson)).get("far-body")
    return [] if finding is None else names(finding)


def piece(x: float, name: str = "") -> str:
    name_attribute = f'name="{name}"' if name else ""
    geom = f'<geom name="g{x}" type="box" size=".1 .1 .1"/>'
    return f'<body {name_attribute} pos="{x} 0 .1"><freejoint/>{geom}</body>'


ARM = """<geom type="plane" size="9 9 1"/>
    <body name="arm" pos="0 0 .2"><joint axis="0 1 0"/><geom size=".05" pos="-.7 0 0"/></body>"""


def test_what_the_scene_is_about_stays() -> None:
    assert far(ARM + piece(3, "box") + piece(5, "probe"), lesson='"probe"') == ["arm", "box"]
    assert far(ARM + piece(3, "box") + piece(5, "probe")) == ["box", "probe"]
    assert far(ARM + piece(-0.7, "hit")) == []  # where the arm comes down
    assert far(piece(0) + piece(9) + piece(18)) == []  # all are alike
    key = '<keyframe><key qpos="0 0 .1 1 0 0 0 9 0 .1 1 0 0 0" qvel="1 0 0 0 0 0 0 0 0 0 0 0"/>'
    assert far(piece(0, "thrown") + piece(9, "still"), rest=key + "</keyframe>") == ["still"]
    push = '<actuator><motor joint="j" name="m"/></actuator>'
    pendulum = (
        '<body name="p{0}" pos="{0} 0 2"><joint name="{1}" axis="0 1 0"/><geom size=".1"/></body>'
    )
    pair = scene(pendulum.format(0, "j") + pendulum.format(9, "k"), rest=push)
    finding = findings_by_kind(run_survey(pair))["far-body"]
    assert names(finding) == ["p9"] and "is about (p0) moves" in finding.message
    layout = '[[scenario]]\nname = "go"\nduration = 0.1\nqpos = [0, {}]\n'
    for angle, is_placed in ((0, False), (0.3, True)):
        survey = run_survey(pair, declarations=parse_declared(layout.format(angle)))
        assert ("far-body" not in findings_by_kind(survey)) is is_placed
