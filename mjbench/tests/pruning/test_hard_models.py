"""Models that are hard to take apart: after `--fix` every bit is as it was, and nothing is left."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import mujoco
import pytest

from mjbench.pruning.model_text import ModelTextError
from mjbench.pruning.survey import Survey
from samples.surveys import PATH, findings_by_kind, fixed_text, names, open_files, run_survey

pytestmark = pytest.mark.long


def motion(model: mujoco.MjModel, joints: list[str], steps: int = 150) -> bytes:
    """Positions and velocities of joints that have names, from every keyframe, bit for bit."""
    states: list[bytes] = []
    for key in range(-1, model.nkey):
        data = mujoco.MjData(model)
        if key >= 0:
            mujoco.mj_resetDataKeyframe(model, data, key)
        for _ in range(steps):
            mujoco.mj_step(model, data)
            for name in joints:
                states += [data.joint(name).qpos.tobytes(), data.joint(name).qvel.tobytes()]
    return b"".join(states)


def joints_of(model: mujoco.MjModel) -> list[str]:
    return [name for i in range(model.njnt) if (name := model.joint(i).name)]


def whole(files: str | Mapping[str, str | bytes], *, lesson: str = "") -> tuple[Survey, str]:
    """Fix a model until nothing is left; check that it moves as before, and that this is an end."""
    before = dict({PATH: files} if isinstance(files, str) else files)
    first: Survey | None = None
    now = dict(before)
    for _ in range(6):
        survey = run_survey(now, lesson=lesson)
        first = first or survey
        if not survey.edits:
            break
        now |= survey.text.files(survey.edits)
    else:
        raise AssertionError("there is always something left")
    old, new = open_files(before).model, open_files(now).model
    joints = joints_of(new)
    assert motion(old, joints) == motion(new, joints)
    text = now[PATH]
    assert first is not None
    return first, text.decode() if isinstance(text, bytes) else text


COMMON = """<compiler angle="radian"/>
  <option wind="1 0 0"/>
  <default><default class="idle"/></default>
  <asset><material name="idle"/></asset>"""


def test_includes_are_changed_where_they_stand() -> None:
    files = {
        PATH: f'<mujoco>\n  {COMMON}\n  <include file="parts/arm.xml"/>\n</mujoco>\n'.replace(
            "\n", "\r\n"
        ),
        "models/parts/arm.xml": """<mujocoinclude>
  <!-- the arm -->
  <include file="parts/spare.xml"/>
  <worldbody><body><joint name="j" axis="0 1 0"/><geom size=".1" pos=".2 0 0"/>
    <site name="idle"/></body></worldbody>
</mujocoinclude>""",
        "models/parts/spare.xml": '<x>\n<default>\n  <default class="spare"/>\n</default>\n</x>\n',
    }
    survey = run_survey(files)
    assert set(findings_by_kind(survey)) == {"unused-default", "unused-material", "unused-site"}
    places = findings_by_kind(survey)["unused-default"].places
    assert [place.path for place in places] == [PATH, "models/parts/spare.xml"]
    assert fixed_text(survey, "models/parts/spare.xml") == files["models/parts/spare.xml"]
    arm = fixed_text(survey, "models/parts/arm.xml")
    assert '<include file="parts/spare.xml"/>' not in arm and '<site name="idle"/>' in arm
    main = fixed_text(survey)
    assert main.count("\r\n") == main.count("\n") == 5 and "idle" not in main
    whole(files)


@pytest.mark.parametrize(
    ("files", "words"),
    [
        (
            {PATH: '<mujoco><include file="none.xml"/></mujoco>'},
            "none.xml, which is not in the course",
        ),
        ({PATH: "<mujocoinclude/>"}, "its root is <mujocoinclude>"),
        ({PATH: "<robot/>"}, "its root is <robot>"),
        ({"models/b.xml": ""}, "there is no file models/a.xml"),
    ],
)
def test_what_is_no_model_of_its_own(files: Mapping[str, str], words: str) -> None:
    with pytest.raises(ModelTextError, match=words.replace(".", r"\.")):
        open_files(files)


REPLICATED = f"""<mujoco>
  {COMMON}
  <worldbody>
    <geom type="plane" size="1 1 1" pos="0 0 -1"/>
    <replicate count="3" offset="0 1 0">
      <body name="swing" pos="0 0 1"><joint name="hinge" axis="0 1 0"/>
        <geom size=".05" pos=".2 0 0"/><site name="idle"/>
        <replicate count="2" euler="0 0 1"><geom size=".01" pos=".3 0 0"/></replicate>
      </body>
    </replicate>
    <replicate count="5" offset="0 2 0">
      <body pos="80 0 1"><joint axis="1 0 0"/><geom size=".1" pos="0 .1 0"/></body>
    </replicate>
  </worldbody>
  <actuator><motor name="m" joint="hinge1"/></actuator>
  <sensor><jointpos joint="hinge2"/></sensor>
</mujoco>
"""


def test_what_is_repeated_is_one_element() -> None:
    survey, left = whole(REPLICATED)
    findings = findings_by_kind(survey)
    assert names(findings["far-body"]) == ["mujoco/worldbody/replicate[2]/body"]
    assert left.count("<replicate") == 3 and 'pos="80 0 1"' in left
    assert 'class="idle"' not in left and '<site name="idle"/>' in left and "jointpos" in left


def test_tendons_equalities_and_excluded_pairs() -> None:
    text = f"""<mujoco>
  {COMMON}
  <worldbody>
    <body name="a" pos="0 0 1"><joint name="ja" axis="0 1 0"/>
      <geom name="ga" size=".1" pos=".3 0 0"/>
      <site name="sa" pos=".3 0 0"/></body>
    <body name="b" pos="1 0 1"><joint name="jb" axis="0 1 0"/>
      <geom name="gb" size=".1" pos=".3 0 0"/>
      <site name="sb" pos=".3 0 0"/></body>
    <body name="c" pos="40 0 1"><joint name="jc" axis="0 1 0"/><geom name="gc" size=".1"/></body>
    <body name="d" pos="900 0 1"><freejoint name="jd"/><geom name="gd" size=".1"/></body>
  </worldbody>
  <contact><exclude body1="a" body2="d"/><pair geom1="gb" geom2="gd" condim="6"/></contact>
  <tendon>
    <spatial name="t" stiffness="5"><site site="sa"/><geom geom="ga"/><site site="sb"/></spatial>
    <fixed name="f"><joint joint="jb" coef="1"/></fixed>
  </tendon>
  <equality><joint joint1="ja" joint2="jc" polycoef="0 1 0 0 0"/></equality>
  <sensor><tendonpos tendon="t"/></sensor>
</mujoco>
"""
    survey, left = whole(text)
    findings = findings_by_kind(survey)
    assert names(findings["far-body"]) == ["d"]  # `c` is coupled to what matters
    assert any("<contact>" in edit.old for edit in findings["far-body"].edits)
    assert "<sensor>" in left and "<equality>" in left and left.count("<site") == 4


def test_composites_and_flexes_stay_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo writes what it warns of
    text = f"""<mujoco>
  {COMMON}
  <size memory="20M"/>
  <worldbody>
    <geom type="plane" size="2 2 1"/>
    <body name="rope" pos="0 0 1">
      <composite prefix="r" type="cable" curve="s" count="6 1 1" size="1">
        <joint kind="main" damping="0.01"/><geom type="capsule" size=".02"/>
      </composite>
    </body>
    <flexcomp name="cloth" type="grid" count="3 3 1" spacing=".1 .1 .1" pos="0 2 1" radius=".01"
        dim="2" mass="1"><contact selfcollide="none"/></flexcomp>
    <body pos="0 0 50"><freejoint/><geom size=".1"/></body>
  </worldbody>
  <sensor><clock/></sensor>
</mujoco>
"""
    survey, left = whole(text)
    assert {"far-body", "contact-off"}.isdisjoint(findings_by_kind(survey))
    assert '<composite prefix="r"' in left and "<flexcomp" in left and "<clock" in left


def test_an_attached_model_is_a_model_of_its_own() -> None:
    files = {
        PATH: """<mujoco>
  <asset><model name="leg" file="leg.xml"/><model name="spare" file="leg.xml"/></asset>
  <worldbody><body name="hip" pos="0 0 1"><joint name="hip" axis="0 1 0"/>
    <geom size=".1" pos=".2 0 0"/>
    <attach model="leg" body="shank" prefix="left-"/></body></worldbody>
</mujoco>
""",
        "models/leg.xml": """<mujoco><worldbody><body name="shank" pos=".2 0 0">
  <joint name="knee" axis="0 1 0"/><geom size=".05" pos=".2 0 0"/><site name="idle"/>
  </body></worldbody><sensor><jointpos joint="knee"/></sensor></mujoco>""",
    }
    survey = run_survey(files)
    assert set(findings_by_kind(survey)) == {"unused-model"}
    assert 'name="spare"' not in fixed_text(survey)
    whole(files)


def test_muscles_filters_and_delays() -> None:
    text = f"""<mujoco>
  {COMMON}
  <worldbody><body name="arm" pos="0 0 1"><joint name="j" axis="0 1 0" range="-1 1"/>
    <joint name="k" axis="1 0 0"/><geom size=".1" pos=".2 0 .1"/></body>
    <body pos="900 0 1"><freejoint/><geom size=".1"/></body></worldbody>
  <tendon><fixed name="t"><joint joint="j" coef=".1"/></fixed></tendon>
  <actuator>
    <muscle name="m" tendon="t" lengthrange="0.1 0.2"/>
    <general name="f" joint="k" dyntype="filter" dynprm=".1" gainprm="3"/>
    <intvelocity name="v" joint="k" kp="5" actrange="-1 1"/>
    <damper name="d" joint="j" kv="2" ctrlrange="0 1"/>
    <motor name="idle" joint="j"/>
  </actuator>
  <keyframe><key name="go" qpos=".1 .2 900 0 1 1 0 0 0" act="0 .5 .1" ctrl="0 1 .2 0 0"/></keyframe>
</mujoco>
"""
    survey, left = whole(text)
    finding = findings_by_kind(survey)["actuator-idle"]
    assert names(finding) == ["d", "idle"] and 'name="idle"' in left
    assert "0 1 .2" in {edit.new for edit in finding.edits}, "of the keyframe"


def test_nothing_is_proved_where_delays_keep_states_from_being_brought_over() -> None:
    motor = '<actuator><motor joint="pivot" nsample="3" delay="0.004"/></actuator>'
    world = '<body><joint name="pivot"/><geom size=".1" pos=".3 0 0"/></body>'
    text = f"<mujoco><worldbody>{world}</worldbody>{motor}<sensor><clock/></sensor></mujoco>"
    findings = findings_by_kind(run_survey(text))
    assert not any(f.is_fault for f in findings.values())
