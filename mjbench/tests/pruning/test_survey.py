"""Things of no use, with their labels, and the text without them."""

from __future__ import annotations

import itertools
import struct

import pytest

from mjbench.reports.diet_report import INTERFACE_LABEL, PROVED_LABEL
from samples.surveys import PATH, PENDULUM, findings_by_kind, fixed_text, names, run_survey, scene

pytestmark = pytest.mark.long


@pytest.mark.parametrize("world", ["", "<!-- nothing -->", "<geom size='1'/>"])
def test_nothing_that_moves(world: str) -> None:
    survey = run_survey(scene(world))
    assert survey.report.findings == ()
    survey = run_survey("<mujoco/>")
    assert survey.report.findings == ()


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
VISIBLE_GEOM = """<geom type="mesh" mesh="used" material="table" mass="0"/>"""


def test_assets_that_nothing_uses_with_those_that_only_they_use() -> None:
    text = scene(PENDULUM.replace("</body>", VISIBLE_GEOM + "</body>"), head=ASSETS)
    survey = run_survey(text)
    findings = findings_by_kind(survey)
    assert {kind: names(finding) for kind, finding in findings.items()} == {
        "unused-material": ["curtain"],
        "unused-texture": ["cloth"],
        "unused-mesh": ["ünüsed"],
        "unused-hfield": ["hill"],
    }
    assert all(finding.label == PROVED_LABEL and finding.fixable for finding in findings.values())
    assert findings["unused-texture"].saving.text > 50
    assert findings["unused-mesh"].saving.memory > 100
    left = fixed_text(survey)
    for asset in ("curtain", "cloth", "ünüsed", "hill"):
        assert asset not in left
    assert len(left.splitlines()) == len(text.splitlines()) - 4
    second = run_survey(left)
    assert second.report.findings == () and fixed_text(second) == left


def test_a_texture_of_a_kept_material_is_used() -> None:
    text = scene(PENDULUM.replace("</body>", VISIBLE_GEOM + "</body>"), head=ASSETS)
    survey = run_survey(text, keeps={"unused-material curtain": "for the next lesson"})
    findings = findings_by_kind(survey)
    assert findings["unused-material"].kept == "for the next lesson"
    assert not findings["unused-material"].fixable and not findings["unused-material"].is_fault
    assert "unused-texture" not in findings and survey.report.stale == ()


def test_what_a_needed_part_uses_is_needed_and_the_rest_is_tried() -> None:
    """No word of the script says that it counts sensors, but its output does."""
    tip = PENDULUM.replace("</body>", '<site name="tip"/></body>')
    far = '<body name="far" pos="9 0 0"><freejoint/><geom size=".1"/></body>'
    sensor = '<sensor><framepos name="place" objtype="site" objname="tip"/></sensor>'
    survey = run_survey(
        scene(tip + far, rest=sensor),
        lesson='x = "pivot"',
        rerun=lambda files: "" if b"<framepos" in files[PATH] else "examples/a.py",
    )
    reasons = {name: t.reason for t in survey.report.tried for name in t.places}
    assert reasons["place"] == "examples/a.py prints something else then"
    assert reasons["tip"] == "something needs it"
    findings = findings_by_kind(survey)
    assert "unused-site" not in findings and names(findings["far-body"]) == ["far"]
    assert not findings["far-body"].in_rest and findings["contact-idle"].in_rest


def test_a_geom_that_nothing_can_reach_is_not_idle_too() -> None:
    limbs = "".join(
        f'<body pos="0 {y} {z}"><joint axis="0 1 0" stiffness="{stiffness}"/>'
        f'<geom name="{name}" size=".1" pos=".3 0 {below}"/></body>'
        for y, z, stiffness, name, below in (
            (0, 5, 0, "high", 0),
            (5, 0.3, 100, "stiff", 0),
            (9, 0.3, 0, "low", -0.1),
        )
    )
    survey = run_survey(scene(f'<geom type="plane" size="9 9 1"/>{limbs}'))
    findings = findings_by_kind(survey)
    assert names(findings["collision-unreachable"]) == ["high"]
    assert names(findings["collision-idle"]) == ["stiff"]


def test_an_asset_is_called_after_its_file() -> None:
    mesh = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"
    hills = struct.pack("<2i4f", 2, 2, 0, 1, 0, 1)
    head = """<asset><mesh file="one.obj"/><mesh file="two.obj"/>
    <hfield file="hills.bin" size="1 1 1 1"/></asset>"""
    world = PENDULUM.replace("</body>", '<geom type="mesh" mesh="one" mass="0"/></body>')
    files = {"models/one.obj": mesh, "models/two.obj": mesh, "models/hills.bin": hills}
    text = scene(world, head=head)
    assert names(findings_by_kind(run_survey(files | {PATH: text}))["unused-mesh"]) == ["two"]
    text = text.replace('<mesh file="two.obj"/>', "")
    assert names(findings_by_kind(run_survey(files | {PATH: text}))["unused-hfield"]) == ["hills"]


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
    survey = run_survey(
        scene(PENDULUM.replace('name="ball"', 'name="ball" class="inner"'), head=head),
        lesson='show("read")',
    )
    assert names(findings_by_kind(survey)["unused-default"]) == ["idle"]
    left = fixed_text(survey)
    assert "<!-- for later -->\n    <!-- said of it -->\n" in left
    assert "idle" not in left and 'class="outer"' in left and 'class="read"' in left


SITES = """<body name="arm" pos="0 0 1"><joint name="j" axis="0 1 0"/><geom size=".1" pos=".3 0 0"/>
      <site name="held"/><site name="read"/><site/><site name="idle"/><site name="sensed"/>
      <camera name="front"/>
    </body>
    <site name="end"/>"""
TENDON = """<tendon><spatial stiffness="1"><site site="held"/><site site="end"/></spatial></tendon>
  <sensor>
    <framepos objtype="site" objname="sensed"/>
  </sensor>"""


def test_sites_cameras_and_sensors() -> None:
    """Those of a tendon are used, one that only an unread sensor needs is not, and all stay."""
    survey = run_survey(scene(SITES, rest=TENDON), lesson='print(data.site("read").xpos)')
    findings = findings_by_kind(survey)
    assert names(findings["sensor-unread"]) == ["mujoco/sensor/framepos"]
    assert names(findings["unused-site"]) == [
        'mujoco/worldbody/body[@name="arm"]/site[3]',
        "idle",
        "sensed",
    ]
    assert names(findings["unused-camera"]) == ["front"]
    labels = {findings[kind].label for kind in ("sensor-unread", "unused-site", "unused-camera")}
    assert labels == {INTERFACE_LABEL}
    assert survey.edits == ()


@pytest.mark.parametrize(
    ("option", "left"),
    [
        ('<option cone="elliptic">\n<flag energy="enable"/></option>', '<option cone="elliptic">'),
        ('<option><flag energy="enable" fwdinv="enable"/></option>', ""),
        ('<option><!-- --><flag energy="enable"/></option>', "<option><!-- --></option>"),
        (
            '<option><flag gravity="enable" energy="enable"/></option>',
            '<option><flag gravity="enable"/></option>',
        ),
    ],
)
def test_flags_for_nobody(option: str, left: str) -> None:
    survey = run_survey(scene(head=option))
    assert set(findings_by_kind(survey)) <= {"energy-flag", "fwdinv-flag"}
    rest = fixed_text(survey)
    assert left in rest and rest.count("<flag") == left.count("<flag")
    assert rest.count("<option") == left.count("<option")
    assert run_survey(scene(head=option), lesson="print(model.opt.enableflags)").edits == ()


def test_what_only_runs_speak_for_is_told_for_the_time_that_it_saves() -> None:
    still = '<body name="still" pos="4 0 2"><joint name="turn"/><geom size=".1"/></body>'
    idle = '<equality><joint name="idle" joint1="turn"/></equality>'
    clock = itertools.count(step=10**6).__next__
    survey = run_survey(scene(PENDULUM + still, rest=idle), lesson='"still"', clock=clock)
    assert set(findings_by_kind(survey)) == {"contact-off"}, "which is proved"
    slow = {finding.kind for finding in survey.report.tried if "no time" in finding.reason}
    assert "coupling-idle" in slow
