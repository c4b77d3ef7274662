"""Who may notice that a part of a model is gone: scripts that use one, each in its own way."""

from __future__ import annotations

import textwrap

import pytest

from mjbench.pruning.survey import Survey
from mjbench.reports.diet_report import MEASURED_LABEL, Finding
from samples.surveys import names, parse_declared, run_survey, scene

pytestmark = pytest.mark.long

MODEL = scene(
    """<geom name="wall" type="box" size=".1 .1 .1" pos="0 0 2" material="m"/>
    <body name="leg" pos="0 0 1"><joint name="hip" axis="0 1 0"/>
      <geom name="shin" size=".05" pos=".3 0 0"/><site name="tip_l"/><site name="tip_r"/></body>""",
    head="""<option><flag energy="enable"/></option>
  <asset><material name="m"/><material name="spare" rgba="1 0 0 1"/>
    <mesh name="cube" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>""",
    rest="""<sensor><jointpos name="hip_l" joint="hip"/><jointvel name="hip_r" joint="hip"/>
    <subtreeangmom name="spin" body="leg"/><framepos name="at" objtype="site" objname="tip_l"/>
    <force name="felt" site="tip_l"/>
  </sensor>
  <actuator><motor name="push" joint="hip"/></actuator>
  <tendon><fixed name="cord"><joint joint="hip" coef="1"/></fixed></tendon>
  <keyframe><key name="up" qpos="1"/><key name="down" qpos="3"/></keyframe>""",
)
HEAD = """
import json, mujoco, numpy as np
from mjcourse import model_path
model = mujoco.MjModel.from_xml_path(str(model_path("leg")))
data = mujoco.MjData(model)
"""

GO = parse_declared('[[scenario]]\nname = "go"\nkeyframe = "up"\nduration = 0.1\n')

HOSTILE = {
    # What of the model it uses, by the kind of a finding, and the script.
    "concatenation": ("sensor", 'print([data.sensor("hip_" + s).data for s in "lr"])'),
    "f-string": ("sensor", 's = "r"\nprint(data.sensor(f"hip_{s}").data)'),
    "raw f-string": ("sensor", 's = "r"\nprint(fr"{data.sensordata}")'),
    "name in an f-string": ("sensor hip_l", "print(f\"{data.sensor('hip_l').data}\"[:0])"),
    "name in an f-string of prose": (
        "site tip_r",
        "print(f\"it's {data.site('tip_r').xpos}\"[:0])",
    ),
    "f-string before a text": ("sensor", 'print(f"{model}", data.sensordata, "x")'),
    "triple f-string": ("sensor", "print(f'''it's {data.sensordata}''', \"x\")"),
    "letters of another width": ("sensor", "print(data.\uff53ensordata)"),
    "size of a state": ("actuator", "print(mujoco.mj_stateSize(model, 8191))"),
    "whole state": ("actuator", "mujoco.mj_getState(model, data, np.empty(9), 31)"),
    "file mapped": ("sensor", "print(np.memmap(model_path('leg')))"),
    "number": ("sensor", "print(data.sensor(0).data)"),
    "getattr": ("sensor", 'print(getattr(data, "sensor" + "data"))'),
    "format field": ("sensor", 'print("{0.sensordata}".format(data))'),
    "pattern": ("sensor", "match data:\n    case object(sensordata=s): print(s)"),
    "function handed on": ("sensor", 'print([f(n).data for f in (data.sensor,) for n in ("at",)])'),
    "MuJoCo's viewer": ("actuator", "from mujoco import viewer\nviewer.launch(model)"),
    "MuJoCo's module": ("sensor", "from mujoco import mjx\nmjx.put_model(model)"),
    "unknown package": ("sensor", "import observe\nobserve.everything(model, data)"),
    "name2id": ("sensor", 'i = mujoco.mj_name2id(model, 20, "hip" + "_l")\nprint(i)'),
    "id of another": ("sensor", 'print(model.sensor("at").id)'),
    "what a sensor computes": (
        "sensor spin",
        "mujoco.mj_step(model, data)\nprint(data.subtree_angmom)",
    ),
    "forces at a later contact": ("sensor felt", "print(data.cfrc_ext)"),
    "forces on a body": ("sensor felt", 'print(data.body("leg").cfrc_ext[2])'),
    "momentum of a body": ("sensor spin", 'print(data.body("leg").subtree_angmom)'),
    "body as a whole": ("sensor felt", 'print(data.body("leg"))'),
    "geom as a whole": ("material", 'w = model.geom("wall")\nprint(w.pos, w)'),
    "options": ("energy", "print(model.opt)"),
    "spec": ("sensor", "spec = mujoco.MjSpec.from_file('x')\nprint(len(spec.sensors))"),
    "bound element": ("sensor", "def read(part):\n    return data.bind(part).data\nprint(read)"),
    "zip": ("sensor", "spec = mujoco.from_zip('x')\nprint(len(spec.sensors))"),
    "exec": ("sensor", 'exec("print(data." + "sensor" + "data)")'),
    "dunder": ("sensor", 'print(data.__getattribute__("sensor" + "data"))'),
    "include": ("sensor", "x = '<mujoco><include file=\"leg.xml\"/></mujoco>'"),
    "derivatives": ("sensor", "mujoco.mjd_transitionFD(model, data, 1e-6, True, *[None] * 4)"),
    "names of all": ("site", "print(model.names)"),
    "number of a site": ("site", "model.actuator_trnid[0, 0] = 1"),
    "jacobian of a site": ("site", "mujoco.mj_jacSite(model, data, None, None, 0)"),
    "keyframes in a loop": (
        "keyframe",
        "for k in range(2): mujoco.mj_resetDataKeyframe(model, data, k)",
    ),
    "keyframe array": ("keyframe", "data.qpos[:] = model.key_qpos[-1]"),
    "material by number": ("material", "model.geom_matid[0] = 1"),
    "material of a view": ("material", 'model.geom("wall").matid = 1'),
    "wall moved": ("contact-off", 'model.geom("wall").pos[0] = .3'),
    "wall grown": ("contact-off", 'g = model.geom("wall")\ng.size[:] = 3'),
    "joint changed": ("contact-off", 'model.joint("hip").pos = [9, 9, 9]'),
    "tendon changed": ("tendon", 'model.tendon("cord").stiffness = 4'),
    "commands": ("actuator", "data.ctrl[0] = 1"),
    "tendon": ("tendon", "print(data.ten_length)"),
    "energy flag": ("energy", "print(model.opt.enableflags)"),
}


def proved_findings(survey: Survey) -> list[Finding]:
    """What nothing that was looked at reads, whether it is taken out or may be for others."""
    return [finding for finding in survey.report.findings if finding.label != MEASURED_LABEL]


def test_no_hostile_script_loses_a_part() -> None:
    whole = {finding.kind for finding in proved_findings(run_survey(MODEL, declarations=GO))}
    lost = []
    for title, (part, script) in HOSTILE.items():
        kind, _, name = part.partition(" ")
        kinds = {finding for finding in whole if kind in finding}
        assert kinds, kind
        survey = run_survey(MODEL, lesson=HEAD + script, declarations=GO, only=kinds)
        findings = [finding for finding in proved_findings(survey) if finding.kind in kinds]
        lost += [
            (title, finding.kind) for finding in findings if not name or name in names(finding)
        ]
    assert lost == []


def test_what_a_script_names_stays_and_the_rest_goes() -> None:
    """The default is that everything is used, but not that everything always is."""
    script = textwrap.dedent("""
        for _ in range(10):
            mujoco.mj_step(model, data)
        print(data.time, data.joint("hip").qpos[0], data.body("leg").xpos, data.qpos[0])
        print(data.sensor("hip_l").data, data.site("tip_r").xpos)
        hinge = data.joint("hip")
        print(hinge.qpos[0])
        mujoco.mj_resetDataKeyframe(model, data, model.key("down").id)
        print("the spare cube and spin are in the prose only")
    """)
    survey = run_survey(MODEL, lesson=HEAD + script, declarations=GO)
    names_by_kind = {finding.kind: names(finding) for finding in proved_findings(survey)}
    assert names_by_kind.pop("contact-off") == []
    reasons = {(t.kind, *t.places): t.reason for t in survey.report.tried}
    assert reasons["sensor-unread", "hip_l"] == "examples/a.py may notice"
    assert names_by_kind == {
        "energy-flag": ["energy"],
        "sensor-unread": ["hip_r", "spin", "at", "felt"],
        "actuator-idle": ["push"],
        "tendon-idle": ["cord"],
        "unused-site": ["tip_l"],
        "unused-material": ["spare"],
        "unused-mesh": ["cube"],
    }
