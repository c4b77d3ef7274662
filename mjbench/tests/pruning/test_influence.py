"""Scenes whose answer is known: what a part does to the rest, at any time, is not missed."""

from __future__ import annotations

import mujoco
import pytest

from mjbench.pruning.comparison import ALIKE, compare, index_map, pruning_scenes, watch
from mjbench.reports.diet_report import MEASURED_LABEL
from samples.surveys import (
    PATH,
    findings_by_kind,
    names,
    open_files,
    parse_declared,
    run_survey,
    scene,
)

pytestmark = pytest.mark.long

CART = """<mujoco>
  <worldbody>
    <body name="cart" pos="0 0 .1"><joint name="track" type="slide" axis="1 0 0" damping=".2"/>
      <geom name="hull" type="box" size=".1 .1 .05" mass="1"/></body>
    <body name="ram" pos="-.24 0 .1"><joint name="rail" type="slide" axis="1 0 0" stiffness="1700"
      springref=".1"/><geom size=".05" mass="5" solref=".004 1" priority="1"/></body>
  </worldbody>
  <actuator><motor name="push" joint="track"/></actuator>
</mujoco>
"""
PUSH = parse_declared('[[scenario]]\nname = "push"\nduration = 1\ncontrols = [[0.2]]\n')


def test_body_that_strikes_between_two_looks_is_needed() -> None:
    """The ram hits the cart once, between 50 and 100 ms, and throws it half a metre."""
    base = open_files({PATH: CART}).model
    (run,) = (watch(base, scene) for scene in pruning_scenes(base, PUSH))
    data, hits = mujoco.MjData(base), []
    for _ in range(500):
        mujoco.mj_step(base, data)
        hits += [data.time] if data.ncon else []
    assert 0.05 < hits[0] < hits[-1] < 0.1
    spec = mujoco.MjSpec.from_string(CART)
    ram = base.body("ram").id
    spec.delete(spec.body("ram"))
    comparison = compare(base, spec.compile(), index_map(base, {"body": {ram}}), [run])
    assert comparison.difference > 1 and comparison.shown.startswith("the body cart is off by ")
    assert hits[0] < float(comparison.shown.split()[-2]) < 0.1
    assert "far-body" not in findings_by_kind(run_survey(CART, declarations=PUSH, quick=False))


def limb(name: str, place: str, joints: str, length: float, inner: str = "") -> str:
    axes = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
    hinges = "".join(
        f'<joint name="{name}_{axis}" axis="{axes[axis]}" damping=".2" armature=".01"/>'
        for axis in joints
    )
    return f"""<body name="{name}" pos="{place}">{hinges}
      <geom name="{name}" type="capsule" fromto="0 0 -.05 0 0 {-length}" size=".045"/>{inner}
    </body>"""


def humanoid() -> str:
    parts = []
    for side, y in (("left", 0.1), ("right", -0.1)):
        foot = limb(f"{side}_foot", "0 0 -.4", "yx", 0.1)
        shank = limb(f"{side}_shank", "0 0 -.45", "y", 0.38, foot)
        parts.append(limb(f"{side}_thigh", f"0 {y} -.1", "xyz", 0.42, shank))
        lower = limb(f"{side}_forearm", "0 0 -.3", "y", 0.26)
        parts.append(limb(f"{side}_arm", f"0 {2.4 * y} .4", "xy", 0.28, lower))
    waist = f"""<body name="waist"><joint name="waist_y" axis="0 1 0" stiffness="900" damping="9"/>
      <geom type="capsule" fromto="0 -.08 0 0 .08 0" size=".06"/>{parts[0]}{parts[2]}</body>"""
    sensors = '<touch site="sole"/><accelerometer site="sole"/>'
    motors = "".join(
        f'<motor name="{side}_{joint}" joint="{side}_{joint}"/>'
        for side in ("left", "right")
        for joint in ("thigh_x", "thigh_y", "thigh_z", "shank_y", "foot_y", "arm_x", "arm_y")
    )
    return scene(
        f"""<geom type="plane" size="3 3 1"/>
    <body name="torso" pos="0 0 1.3"><geom type="box" size=".08 .15 .2" pos="0 0 .25"/>
      <site name="sole"/>{waist}{parts[1]}{parts[3]}</body>""",
        rest=f"<actuator>{motors}</actuator><sensor>{sensors}</sensor>"
        '<keyframe><key name="wave" ctrl="0 0 0 0 0 0 0 0 0 0 0 0 0 0"/></keyframe>',
    )


WAVE = parse_declared(
    '[[scenario]]\nname = "wave"\nduration = 1\nhold = 0.25\ncontrols = ['
    + ", ".join(f"[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, {x}, {y}]" for x, y in ((-4, 2), (-2, -3)))
    + "]\n"
)


def test_limbs_that_nothing_commands_go_while_one_arm_moves() -> None:
    """Legs have motors too, and swing; nothing that they do reaches the arm."""
    findings = findings_by_kind(run_survey(humanoid(), declarations=WAVE))
    finding = findings["far-body"]
    assert names(finding) == ["waist", "left_arm"]
    assert finding.label == MEASURED_LABEL and finding.difference < ALIKE
    assert findings["contact-left"].difference < ALIKE


def test_couplings_and_shapes() -> None:
    """Of two equalities one carries a weight."""
    cube = " ".join(f"{x} {y} {z}" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1))
    text = scene(
        """<geom type="plane" size="3 3 1"/>
    <body name="crate" pos="0 0 .5"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <geom name="shell" type="mesh" mesh="cube"/>
      <geom name="knob" size=".1" pos="0 0 .3"/></body>
    <body name="lamp" pos="2 0 1"><joint name="cord" type="slide" axis="0 0 1"/>
      <geom size=".1"/></body>
    <body name="still" pos="4 0 2"><joint name="turn" axis="0 0 1"/><geom size=".1"/></body>""",
        head=f'<asset><mesh name="cube" vertex="{cube}" scale=".3 .3 .3"/></asset>',
        rest="""<equality><joint name="carries" joint1="cord"/>
    <joint name="idle" joint1="turn"/></equality>""",
    )
    survey = run_survey(text, lesson='"crate"')
    findings = findings_by_kind(survey)
    assert names(findings["coupling-idle"]) == ["idle"]
    shape = findings["mesh-primitive"]
    assert names(shape)[0].startswith("shell (box, off by ")
    assert (shape.label, shape.fixable) == (MEASURED_LABEL, False), "another shape is another scene"
