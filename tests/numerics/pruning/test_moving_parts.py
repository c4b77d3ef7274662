"""What takes part in the motion and need not: actuators, contact, far things."""

from __future__ import annotations

import mujoco
import pytest

from coursebuild.numerics.reports.diet import EQUAL, IDENTICAL, UNTOUCHED
from support.surveys import PATH, PENDULUM, fixed, found, names, opened, scene, tried

# ------------------------------------------------------------------------------ what takes part


def test_actuators_that_nobody_commands() -> None:
    rest = """<actuator>
    <motor name="push" joint="pivot"/>
    <position name="servo" joint="pivot" kp="10"/>
    <motor name="lazy" joint="pivot" ctrllimited="true" ctrlrange="1 2"/>
  </actuator>
  <keyframe><key name="up" qpos="1" ctrl="0 0 0"/></keyframe>"""
    model, survey = tried(scene(rest=rest))
    finding = found(survey)["actuator-idle"]
    assert names(finding) == ["push"] and finding.label == IDENTICAL
    assert '<key name="up" qpos="1" ctrl="0 0"/>' in fixed(model, survey)
    needed = [one for one in survey.tried if one.kind == "actuator-idle"]
    assert sorted(name for one in needed for name in one.places) == ["lazy", "servo"]
    for lesson in ("data.ctrl[0] = 1", 'model.actuator("push")', "range(model.nu)"):
        _, survey = tried(scene(rest=rest.replace('name="servo"', "")), lesson=lesson)
        assert "push" not in [name for f in found(survey).values() for name in names(f)]


def test_an_actuator_with_a_state_of_its_own() -> None:
    """Its activation is a coordinate; in a keyframe it may be another than 0."""
    rest = """<actuator><general name="slow" joint="pivot" dyntype="integrator" gainprm="5"/>
    <motor name="push" joint="pivot"/></actuator>
  <keyframe><key name="go" act="{}" ctrl="0 0"/></keyframe>"""
    _, survey = tried(scene(rest=rest.format("1")))
    assert names(found(survey)["actuator-idle"]) == ["push"]
    model, survey = tried(scene(rest=rest.format("0")))
    labels = {one.label: names(one) for one in survey.findings if one.kind == "actuator-idle"}
    assert labels == {IDENTICAL: ["push"], UNTOUCHED: ["slow"]}
    assert '<key name="go" act="0" ctrl="0"/>' in fixed(model, survey)


def test_scenarios_that_number_commands_keep_actuators_from_being_changed() -> None:
    rest = '<actuator><motor name="push" joint="pivot"/></actuator>'
    model, survey = tried(scene(rest=rest), numbered=frozenset({"controls"}))
    finding = found(survey)["actuator-idle"]
    assert finding.counts and not finding.fixable
    assert finding.unfixed.startswith("scenarios give commands by number")
    assert fixed(model, survey) == scene(rest=rest)


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
    model, survey = tried(scene(rest=rest), lesson='data.ctrl[0]; data.tendon("measured")')
    assert names(found(survey)["tendon-idle"]) == ["lazy", "mujoco/tendon/fixed[6]"]
    left = fixed(model, survey)
    assert left.count("<fixed") == 4 and "lazy" not in left
    _, survey = tried(scene(rest=rest), lesson="data.ctrl[0]; data.ten_length[4]")
    assert survey.findings == ()


def test_wind_in_a_vacuum() -> None:
    model, survey = tried(scene(head='<option wind="3 0 0" gravity="0 0 -5"/>'))
    assert found(survey)["fluid"].label == IDENTICAL
    assert '<option gravity="0 0 -5"/>' in fixed(model, survey)
    _, survey = tried(scene(head='<option density="1.2" wind="3 0 0"/>'))
    assert "fluid" not in found(survey)
    assert "fluid" in [one.kind for one in survey.tried]


# ------------------------------------------------------------------------------------ contact


def test_contact_is_off_where_nothing_can_touch() -> None:
    world = PENDULUM + '<geom name="far" size=".1" pos="0 0 2"/>'
    model, survey = tried(scene(world))
    finding = found(survey)["contact-off"]
    assert finding.label == IDENTICAL and finding.proof.startswith("none of 1 pair of geoms")
    left = fixed(model, survey)
    assert '<option><flag contact="disable"/></option>' in left
    assert tried(left)[1].edits == ()


def test_what_only_did_not_touch_is_told_and_left() -> None:
    world = PENDULUM + '<geom name="near" size=".1" pos="0 0 1.35"/>'
    model, survey = tried(scene(world))
    finding = found(survey)["contact-off"]
    assert finding.label == UNTOUCHED and not finding.fixable and not finding.counts
    assert fixed(model, survey) == scene(world)


def test_a_lesson_that_moves_geoms_takes_the_proof_away() -> None:
    world = PENDULUM + '<geom name="far" size=".1" pos="0 0 2"/>'
    _, survey = tried(scene(world), lesson="model.geom_pos[1] = 0")
    assert found(survey)["contact-off"].label == UNTOUCHED


def test_geoms_that_can_touch_nothing_need_no_contact() -> None:
    world = """<geom name="floor" type="plane" size="1 1 1"/>
    <geom name="lamp" size=".1" pos="0 0 9"/>
    <body name="swing" pos="0 0 5"><joint axis="0 1 0"/>
      <geom name="s" size=".1" pos="1 0 0"/></body>
    <body name="near" pos="1.5 0 .15"><joint axis="0 1 0"/>
      <geom name="n" size=".1" pos=".2 0 0"/></body>"""
    model, survey = tried(scene(world))
    finding = found(survey)["collision-unreachable"]
    assert names(finding) == ["lamp", "s"] and finding.label == IDENTICAL
    left = fixed(model, survey)
    assert '<geom name="lamp" size=".1" pos="0 0 9" contype="0" conaffinity="0"/>' in left
    assert '<geom name="n" size=".1" pos=".2 0 0"/>' in left
    assert "collision-unreachable" not in found(tried(left)[1])


# --------------------------------------------------------------------------------- far things


def rubble(count: int, *, extra: str = "") -> str:
    pieces = "\n    ".join(
        f'<body pos="{30 + 2 * (i % 8)} {2 * (i // 8)} .1"><freejoint/>'
        '<geom type="box" size=".1 .1 .1"/></body>'
        for i in range(count)
    )
    arm = """<body name="arm" pos="0 0 2"><joint name="a" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 .5 0 0" size=".02"/>
      <body pos=".5 0 0"><joint name="b" axis="0 1 0"/><geom size=".05" pos=".2 0 0"/></body>
    </body>"""
    floor = '<geom type="plane" size="60 60 1"/>'
    sensors = "".join(f'<framepos objtype="body" objname="arm" name="s{i}"/>' for i in range(30))
    rest = f"<sensor>{sensors}</sensor>"
    state = " ".join(f"{30 + 2 * (i % 8)} {2 * (i // 8)} .1 1 0 0 0" for i in range(count))
    rest += f'\n  <keyframe><key name="go" qpos="0.1 0.2 {state}"/></keyframe>'
    return scene(f"{floor}\n    {arm}\n    {pieces}\n    {extra}", rest=rest)


@pytest.mark.site
def test_a_scene_with_far_bodies_and_unread_sensors_becomes_a_tenth() -> None:
    """What a step costs goes with degrees of freedom, contacts and sensors: each by ten or more."""
    model, survey = tried(rubble(12), quick=False)
    seen = found(survey)
    assert len(names(seen["far-body"])) == 12 and len(names(seen["sensor-unread"])) == 30
    assert seen["far-body"].label in (IDENTICAL, EQUAL)
    assert survey.slim_difference is not None and survey.slim_difference < 1e-12
    left = opened({PATH: fixed(model, survey)}).model
    before = model.model
    assert before.nv >= 30 * left.nv and before.nsensor == 30 and left.nsensor == 0
    contacts = []
    for one in (before, left):
        data = mujoco.MjData(one)
        mujoco.mj_resetDataKeyframe(one, data, 0)
        mujoco.mj_forward(one, data)
        contacts.append(data.ncon)
    assert contacts[0] == 48 and contacts[1] == 0
    assert left.key_qpos.tolist() == [[0.1, 0.2]]


def test_who_counts_coordinates_keeps_bodies_from_being_changed() -> None:
    _, survey = tried(rubble(2), lesson="data.qpos[0]", quick=False)
    finding = found(survey)["far-body"]
    assert not finding.counts and not finding.fixable
    assert finding.unfixed == ("content/lessons/1.1-a.md may count coordinates or bodies by number")


@pytest.mark.parametrize(
    ("extra", "lesson"),
    [
        ('<body name="probe" pos="90 0 5"><freejoint/><geom size=".1"/></body>', '"probe"'),
        ('<body mocap="true" pos="90 0 5"><geom size=".1"/></body>', ""),
    ],
)
def test_what_somebody_looks_at_is_not_far(extra: str, lesson: str) -> None:
    _, survey = tried(rubble(2, extra=extra), lesson=lesson)
    finding = found(survey).get("far-body")
    assert finding is None or not {"probe"} & set(names(finding))


def piece(x: float, z: float = 0.1, *, name: str = "") -> str:
    named = f'name="{name}"' if name else ""
    geom = f'<geom name="g{x}-{z:.1f}" type="box" size=".1 .1 .1"/>'
    return f'<body {named} pos="{x} 0 {z}"><freejoint/>{geom}</body>'


ARM = """<geom type="plane" size="9 9 1"/>
    <body name="arm" pos="0 0 .2"><joint axis="0 1 0"/><geom size=".05" pos="-.7 0 0"/></body>"""


def far(world: str, *, lesson: str = "") -> list[str]:
    """Where the bodies are that are called far."""
    model, survey = tried(scene(world), lesson=lesson)
    finding = found(survey).get("far-body")
    if finding is None:
        return []
    elements = {(p.line, p.column): p for p in finding.places}
    bodies = [e for e in model.elements if e.document.position(e.start) in elements]
    return [(body.get("pos") or "").split()[0] for body in bodies]


def test_what_an_arm_cannot_reach_and_what_leans_on_what_it_can() -> None:
    """The arm reaches 0.75 m; boxes on one that it reaches stay, though they are out of reach."""
    stack = piece(0.85) + "".join(piece(0.85, 0.3 + 0.2 * i) for i in range(3))
    assert far(ARM + stack + piece(1.049) + piece(1.6)) == ["1.6"]
    assert far(ARM + piece(1.05) + piece(1.6)) == ["1.05", "1.6"]


def test_what_has_a_name_or_a_joint_is_far_only_where_it_is_far_indeed() -> None:
    """Two pendulums side by side are a scene, though a sensor is on one of them only."""
    assert far(ARM + piece(1.6, name="ball")) == []
    assert far(ARM + piece(99, name="ball")) == ["99"]
    pendulum = '<body pos="{} 0 2"><joint axis="0 1 0"/><geom size=".1" pos=".2 0 0"/></body>'
    assert far(ARM + pendulum.format(3), lesson="the arm") == []
    assert far(ARM + pendulum.format(99), lesson="the arm") == ["99"]


def test_where_all_bodies_are_alike_none_is_far() -> None:
    world = "".join(f'<body pos="{i}00 0 1"><freejoint/><geom size=".1"/></body>' for i in range(3))
    assert "far-body" not in found(tried(scene(world))[1])


def test_a_body_that_comes_near_is_not_far() -> None:
    world = """<body name="arm" pos="0 0 2"><joint axis="0 1 0"/>
      <geom size=".05" pos=".2 0 0"/></body>
    <body name="shot" pos="30 0 2"><freejoint/><geom size=".05"/></body>"""
    rest = '<keyframe><key qpos="0 30 0 2 1 0 0 0" qvel="0 -100 0 10 0 0 0"/></keyframe>'
    _, survey = tried(scene(world, rest=rest))
    assert "far-body" not in found(survey)
