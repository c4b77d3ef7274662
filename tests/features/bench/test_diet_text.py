"""The scene diet as text."""

from __future__ import annotations

from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.model.diet_findings import (
    DietScenario,
    ModelPlace,
    RejectedTrial,
    Saving,
    StaleKeep,
    TextEdit,
)
from coursebuild.features.bench.commands.diet import diet_text
from coursebuild.report import Style
from support.fixture_cases import check_text
from support.model_reports import diet, finding

EDIT = TextEdit("models/arm.xml", 9, 1, '    <gyro\n name="gyro"/>\n', "")
CERTAIN_SAVING = Saving(2.2, 0.01, True, 1234, 30)
FINDING = finding(
    message="nothing reads the sensor gyro",
    places=(ModelPlace("gyro", 'mujoco/sensor/gyro[@name="gyro"]', "models/arm.xml", 9, 5),),
    saving=CERTAIN_SAVING,
    edits=(EDIT,),
)
REPORT = replace(diet(FINDING), model="arm", fixed=CERTAIN_SAVING, slim=CERTAIN_SAVING)


KEPT_FINDING = replace(FINDING, kept="shown in class", fixable=False, unfixed="it is kept")
LONG_FINDING = replace(FINDING, edits=(EDIT,) * 9, unfixed="models/b.xml uses models/arm.xml too")
FAR_FINDING = replace(
    FINDING,
    kind="far-body",
    message="what the scene is about moves in the same way without the body rock",
    label="the same in what was run",
    proof="",
    shown="the body puck is off by 1.7e-06 rad at 0.59 s",
    starts=3,
    in_rest=True,
    edits=(),
    fixable=False,
    unfixed="only what is proved is changed",
)
REPORTS = [
    REPORT,
    replace(
        REPORT,
        model="kept and lost",
        findings=(KEPT_FINDING,),
        fixed=None,
        slim=None,
        scenarios=(DietScenario("go", "reset", ("the clock says 0 s",)),),
        stale=(StaleKeep("unused-site", "models/arm.toml", 3, 11),),
    ),
    replace(REPORT, model="kept", findings=(KEPT_FINDING,)),
    replace(REPORT, model="rubble", findings=(FAR_FINDING,), fixed=None),
    replace(
        REPORT,
        model="tried",
        findings=(LONG_FINDING,),
        tried=(
            RejectedTrial("cone", ("elliptic",), ""),
            RejectedTrial("solver", ("CG",), "it saves no time"),
            RejectedTrial("sleep", ("sleep",), "it saves no time"),
        ),
    ),
]


def test_findings_are_shown_with_their_saving_reason_and_change(rewriting: bool) -> None:
    text = diet_text(REPORTS, Style(width=90))
    check_text(Path(__file__).with_name("diet.txt"), text, rewriting=rewriting)
    assert [report.ok for report in REPORTS] == [False, False, True, True, False]


def test_control_characters_are_shown_and_lines_are_not_too_long() -> None:
    odd = replace(FINDING, message="nothing reads \x1b[2J " + "word " * 40)
    lines = diet_text([replace(REPORT, findings=(odd,))], Style(width=60)).splitlines()
    assert not any("\x1b" in line for line in lines)
    assert all(len(line) <= 60 for line in lines if "models/" not in line)
