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


def test_what_nothing_commands_goes_with_its_contacts_while_an_arm_moves() -> None:
    """It has a motor too, and lies on the floor; nothing that it does reaches the arm."""
    bodies = """<geom type="plane" size="20 20 1"/>
    <body name="arm" pos="0 0 2"><joint name="j" axis="0 1 0"/><geom size=".1" pos=".3 0 0"/></body>
    <body name="leg" pos="9 0 .1"><joint name="k" axis="0 1 0"/><geom size=".11"/></body>"""
    text = scene(bodies, rest='<actuator><motor joint="j"/><motor joint="k"/></actuator>')
    wave = '[[scenario]]\nname = "wave"\nduration = 0.4\ncontrols = [[0.2, 0]]\n'
    findings = findings_by_kind(run_survey(text, declarations=parse_declared(wave)))
    assert names(findings["far-body"]) == ["leg"]
    assert findings["far-body"].label == MEASURED_LABEL
    assert max(findings[kind].difference for kind in ("far-body", "contact-left")) < ALIKE


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
