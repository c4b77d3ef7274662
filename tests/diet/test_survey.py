"""What is found in a model, with its label, and the text without it."""

from __future__ import annotations

import mujoco
import pytest
from dietkit import PATH, fixed, found, names, opened, tried

from coursebuild.measured.diet import EQUAL, IDENTICAL, UNTOUCHED
from coursebuild.physics.detector import Status

PENDULUM = """<body name="bob" pos="0 0 1"><joint name="pivot" axis="0 1 0"/>
      <geom name="ball" size=".05" pos=".3 0 0"/></body>"""


def scene(world: str = PENDULUM, *, head: str = "", rest: str = "") -> str:
    return f"<mujoco>\n  {head}\n  <worldbody>\n    {world}\n  </worldbody>\n  {rest}\n</mujoco>\n"


def test_a_model_without_anything_in_vain() -> None:
    model, survey = tried(scene())
    assert survey.findings == () and survey.edits == () and survey.stale == ()
    assert survey.fixed is None and survey.slim is None
    assert [one.judgement.status for one in survey.seen] == [Status.OK]
    assert fixed(model, survey) == scene()


@pytest.mark.parametrize("world", ["", "<!-- nothing -->", "<geom size='1'/>"])
def test_nothing_that_moves(world: str) -> None:
    _, survey = tried(scene(world))
    assert survey.findings == ()
    _, survey = tried("<mujoco/>")
    assert survey.findings == ()


# ---------------------------------------------------------------------------- things of no use


ASSETS = """<asset>
    <texture name="sky" type="skybox" builtin="flat" width="8" height="48"/>
    <texture name="wood" type="2d" builtin="flat" width="8" height="8"/>
    <texture name="cloth" type="2d" builtin="flat" width="8" height="8"/>
    <material name="table" texture="wood"/>
    <material name="curtain" texture="cloth"/>
    <mesh name="used" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>
    <mesh name="ünüsed" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>
    <hfield name="hill" nrow="2" ncol="2" size="1 1 1 1" elevation="0 1 0 1"/>
  </asset>"""
SHOWN = """<geom type="mesh" mesh="used" material="table" mass="0"/>"""


def test_assets_that_nothing_uses_with_those_that_only_they_use() -> None:
    text = scene(PENDULUM.replace("</body>", SHOWN + "</body>"), head=ASSETS)
    model, survey = tried(text)
    seen = found(survey)
    assert {kind: names(one) for kind, one in seen.items()} == {
        "unused-material": ["curtain"],
        "unused-texture": ["cloth"],
        "unused-mesh": ["ünüsed"],
        "unused-hfield": ["hill"],
    }
    assert all(one.label == IDENTICAL and one.fixable for one in seen.values())
    assert seen["unused-texture"].saving.memory > 3 * 64
    left = fixed(model, survey)
    for gone in ("curtain", "cloth", "ünüsed", "hill"):
        assert gone not in left
    assert len(left.splitlines()) == len(text.splitlines()) - 4
    again, second = tried(left)
    assert second.findings == () and fixed(again, second) == left


def test_an_asset_that_a_lesson_mentions_is_used() -> None:
    lesson = 'model.mat("curtain").rgba[:] = 1; model.mesh("ünüsed"); "cloth hill"'
    text = scene(PENDULUM.replace("</body>", SHOWN + "</body>"), head=ASSETS)
    _, survey = tried(text, lesson=lesson)
    assert survey.findings == ()


def test_a_texture_of_a_kept_material_is_used() -> None:
    text = scene(PENDULUM.replace("</body>", SHOWN + "</body>"), head=ASSETS)
    _, survey = tried(text, keeps={"unused-material curtain": "for the next lesson"})
    seen = found(survey)
    assert seen["unused-material"].kept == "for the next lesson"
    assert not seen["unused-material"].fixable and not seen["unused-material"].counts
    assert "unused-texture" not in seen and survey.stale == ()


def test_an_asset_is_called_after_its_file() -> None:
    mesh = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"
    head = '<asset><mesh file="one.obj"/><mesh file="two.obj"/></asset>'
    world = PENDULUM.replace("</body>", '<geom type="mesh" mesh="one" mass="0"/></body>')
    files = {PATH: scene(world, head=head), "models/one.obj": mesh, "models/two.obj": mesh}
    _, survey = tried(files)
    assert names(found(survey)["unused-mesh"]) == ["two"]


def test_classes_that_no_element_is_of() -> None:
    head = """<default>
    <default class="outer"><geom rgba="1 0 0 1"/>
      <default class="inner"><geom size=".06"/></default>
    </default>
    <!-- for later -->
    <default class="idle"><geom rgba="1 0 0 1"/>
      <default class="idle-inner"/>
    </default> <!-- said of it -->
    <default class="read"/>
  </default>"""
    model, survey = tried(
        scene(PENDULUM.replace('name="ball"', 'name="ball" class="inner"'), head=head),
        lesson='spec.find_default("read")',
    )
    assert names(found(survey)["unused-default"]) == ["idle"]
    left = fixed(model, survey)
    assert "<!-- for later -->\n    <!-- said of it -->\n" in left
    assert "idle" not in left and 'class="outer"' in left and 'class="read"' in left


SITES = """<body name="arm" pos="0 0 1"><joint name="j" axis="0 1 0"/><geom size=".1" pos=".3 0 0"/>
      <site name="held"/><site name="read"/><site/><site name="idle"/><site name="sensed"/>
    </body>
    <site name="end"/>"""
TENDON = """<tendon><spatial stiffness="1"><site site="held"/><site site="end"/></spatial></tendon>
  <sensor>
    <framepos objtype="site" objname="sensed"/>
  </sensor>"""


def test_sites_and_sensors() -> None:
    """Those of a tendon stay; one that only an unread sensor needs goes with it."""
    model, survey = tried(scene(SITES, rest=TENDON), lesson='data.site("read")')
    seen = found(survey)
    assert names(seen["sensor-unread"]) == ["mujoco/sensor/framepos"]
    assert names(seen["unused-site"]) == [
        'mujoco/worldbody/body[@name="arm"]/site[3]',
        "idle",
        "sensed",
    ]
    left = fixed(model, survey)
    assert '<site name="held"/><site name="read"/>\n' in left
    assert "<sensor>" not in left and '"end"' in left
    assert tried(left, lesson='data.site("read")')[1].edits == ()


@pytest.mark.parametrize(
    "lesson",
    [
        "print(data.sensordata[0])",
        'print(data.sensor("touch").data, data.sensor("clock").data)',
        "for i in range(model.nsensor): print(data.sensor(i).data)",
        '{"readouts": [{"expr": "data.sensordata[model.sensor_adr[0]]"}]} ',
        "mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_SENSOR, 0)",
        "state, sensor = rollout.rollout(model, data, initial)",
        "[s.name for s in spec.sensors]",
    ],
)
def test_a_sensor_that_may_be_read_is_no_finding(lesson: str) -> None:
    sensors = '<sensor><clock name="clock"/><jointpos name="touch" joint="pivot"/></sensor>'
    _, survey = tried(scene(rest=sensors), lesson=lesson)
    assert survey.findings == ()


def test_of_two_sensors_the_one_that_is_read_stays() -> None:
    sensors = '<sensor><clock name="clock"/><jointpos name="angle" joint="pivot"/></sensor>'
    model, survey = tried(scene(rest=sensors), lesson="print(data.sensor('angle').data)")
    assert names(found(survey)["sensor-unread"]) == ["clock"]
    left = fixed(model, survey)
    assert '<sensor><jointpos name="angle" joint="pivot"/></sensor>' in left


def test_flags_for_nobody() -> None:
    head = '<option timestep="0.001">\n    <flag energy="enable" fwdinv="enable"/>\n  </option>'
    model, survey = tried(scene(head=head))
    assert set(found(survey)) == {"energy-flag", "fwdinv-flag"}
    assert '<option timestep="0.001">\n  </option>' in fixed(model, survey)
    _, survey = tried(scene(head=head), lesson="data.energy; data.solver_fwdinv")
    assert survey.findings == ()


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


def test_contacts_are_part_of_the_result() -> None:
    """A block at rest on two geoms that share its weight: none can go, though it stays put."""
    world = """<geom type="plane" size="1 1 1"/>
    <body pos="0 0 .1"><freejoint/><geom type="box" size=".1 .1 .1"/></body>"""
    _, survey = tried(scene(world))
    assert "contact-off" not in found(survey)


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


def test_a_scene_with_far_bodies_and_unread_sensors_becomes_a_tenth() -> None:
    """What a step costs goes with degrees of freedom, contacts and sensors: each by ten or more."""
    model, survey = tried(rubble(40))
    seen = found(survey)
    assert len(names(seen["far-body"])) == 40 and len(names(seen["sensor-unread"])) == 30
    assert seen["far-body"].label in (IDENTICAL, EQUAL)
    assert survey.slim_difference is not None and survey.slim_difference < 1e-12
    left = opened({PATH: fixed(model, survey)}).model
    before = model.model
    assert before.nv >= 100 * left.nv and before.nsensor == 30 and left.nsensor == 0
    contacts = []
    for one in (before, left):
        data = mujoco.MjData(one)
        mujoco.mj_resetDataKeyframe(one, data, 0)
        mujoco.mj_forward(one, data)
        contacts.append(data.ncon)
    assert contacts[0] == 160 and contacts[1] == 0
    assert left.key_qpos.tolist() == [[0.1, 0.2]]


def test_who_counts_coordinates_keeps_bodies_from_being_changed() -> None:
    _, survey = tried(rubble(3), lesson="data.qpos[0]")
    finding = found(survey)["far-body"]
    assert finding.counts and not finding.fixable
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


def piece(name: str, x: float, z: float = 0.1) -> str:
    return (
        f'<body name="{name}" pos="{x} 0 {z}"><freejoint/><geom type="box" size=".1 .1 .1"/></body>'
    )


def test_what_an_arm_cannot_reach_and_what_leans_on_what_it_can() -> None:
    """The arm reaches 0.75 m; boxes on one that it reaches stay, though they are out of reach."""
    arm = """<geom type="plane" size="9 9 1"/>
    <body name="arm" pos="0 0 .2"><joint axis="0 1 0"/><geom size=".05" pos="-.7 0 0"/></body>"""
    stack = piece("near", 0.85) + "".join(piece(f"up{i}", 0.85, 0.3 + 0.2 * i) for i in range(3))
    beside = piece("beside", 1.049) + piece("away", 1.6)
    _, survey = tried(scene(arm + stack + beside), quick=True)
    assert names(found(survey)["far-body"]) == ["away"]
    _, survey = tried(scene(arm + piece("free", 1.05) + piece("away", 1.6)))
    assert set(names(found(survey)["far-body"])) == {"free", "away"}


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


def test_scenery_that_is_far_goes_with_its_empty_bodies() -> None:
    world = (
        PENDULUM
        + """
    <geom name="sun" size="2" pos="0 0 99"/>
    <body name="house" pos="50 0 0">
      <geom size="1"/> <body><geom name="roof" size="1" pos="0 0 2"/></body>
    </body>
    <body name="mast" pos="70 0 0"><geom size="1"/><camera name="c"/></body>
    <geom name="table" size=".1" pos="0 0 .4"/>"""
    )
    model, survey = tried(scene(world), lesson="a sun, a pendulum")
    finding = found(survey)["far-geom"]
    assert names(finding) == ["house", 'mujoco/worldbody/body[@name="mast"]/geom']
    assert finding.label == IDENTICAL
    left = fixed(model, survey)
    assert "roof" not in left and '<camera name="c"/>' in left and "table" in left
    assert tried(left, lesson="a sun, a pendulum")[1].edits == ()


# -------------------------------------------------------------------------- meshes to be seen


CUBE = "-.1 -.2 -.3 -.1 -.2 .3 -.1 .2 -.3 -.1 .2 .3 .1 -.2 -.3 .1 -.2 .3 .1 .2 -.3 .1 .2 .3"


def test_a_mesh_that_is_a_box() -> None:
    head = f'<asset><mesh name="crate" vertex="{CUBE}"/></asset>'
    shown = """<geom name="g" type="mesh" mesh="crate" pos=".1 .2 .3" euler="10 20 30" mass="0"
        contype="0" conaffinity="0"/>"""
    text = scene(PENDULUM.replace("</body>", shown + "</body>"), head=head)
    model, survey = tried(text)
    finding = found(survey)["mesh-primitive"]
    assert finding.label == IDENTICAL and not finding.fixable and finding.saving.memory > 100
    left = text.encode()
    for edit in sorted(finding.edits, key=lambda one: -one.start):
        assert left[edit.start : edit.end].decode() == edit.old
        left = left[: edit.start] + edit.new.encode() + left[edit.end :]
    slim = opened({PATH: left}).model
    geom, whole = slim.geom("g"), model.model
    assert geom.type[0] == mujoco.mjtGeom.mjGEOM_BOX and slim.nmesh == 0
    assert sorted(geom.size) == pytest.approx([0.1, 0.2, 0.3], rel=1e-3)
    assert geom.pos == pytest.approx(whole.geom("g").pos, abs=1e-6)
    assert "mesh" not in left.decode()


def test_a_mesh_that_collides_or_is_no_primitive_stays() -> None:
    head = f"""<asset><mesh name="crate" vertex="{CUBE}"/>
    <mesh name="wedge" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>"""
    shown = """<geom type="mesh" mesh="crate" mass="0"/>
        <geom type="mesh" mesh="wedge" mass="0" contype="0" conaffinity="0"/>"""
    _, survey = tried(scene(PENDULUM.replace("</body>", shown + "</body>"), head=head))
    assert "mesh-primitive" not in found(survey)


# ----------------------------------------------------------------------- runs and their labels


def test_from_a_scenario_that_diverges_nothing_is_claimed() -> None:
    head = '<option timestep="0.1"/>'
    world = PENDULUM.replace("/>", ' stiffness="1e6" damping="0"/>', 1)
    text = scene(world, head=head, rest='<sensor><clock name="t"/></sensor>')
    text = text.replace("</mujoco>", '<keyframe><key name="go" qpos="1"/></keyframe></mujoco>')
    _, survey = tried(text, quick=False)
    assert survey.seen[0].judgement.status is not Status.OK
    assert survey.findings == () and survey.edits == ()


def test_a_keep_that_keeps_nothing_is_told() -> None:
    keeps = {"sensor-unread t": "shown in class", "unused-site": "for labs", "contact": "?"}
    _, survey = tried(scene(rest='<sensor><clock name="t"/></sensor>'), keeps=keeps)
    assert found(survey)["sensor-unread"].kept == "shown in class"
    assert survey.stale == ("unused-site", "contact")


def test_of_a_kind_one_may_be_kept_and_another_found() -> None:
    sensors = '<sensor><clock name="t"/><clock name="u"/></sensor>'
    model, survey = tried(scene(rest=sensors), keeps={"sensor-unread t": "shown in class"})
    by_name = {names(one)[0]: one for one in survey.findings if one.kind == "sensor-unread"}
    assert by_name["t"].kept and not by_name["u"].kept
    assert '<sensor><clock name="t"/></sensor>' in fixed(model, survey)


def test_a_file_that_is_not_to_be_changed() -> None:
    text = scene(rest='<sensor><clock name="t"/></sensor>')
    model, survey = tried(text, locked={PATH: "models/b.xml uses models/a.xml too"})
    finding = found(survey)["sensor-unread"]
    assert finding.unfixed == "models/b.xml uses models/a.xml too" and finding.counts
    assert fixed(model, survey) == text


def test_settings_are_told_only_for_the_time_that_they_save() -> None:
    """The clock of these tests says that nothing saves any."""
    world = """<geom type="plane" size="1 1 1"/>
    <body pos="0 0 .2"><freejoint/><geom type="box" size=".1 .1 .1" condim="4"/></body>"""
    _, survey = tried(scene(world))
    assert survey.findings == ()
    kinds = {one.kind for one in survey.tried}
    assert {"solver", "cone", "tolerance", "island", "sleep", "condim"} <= kinds
    assert {one.reason for one in survey.tried} == {"it saves no time"}
