"""The scene diet as text."""

from __future__ import annotations

from msgspec.structs import replace

from coursebuild.features.bench.commands.diet.text import diet_text
from coursebuild.numerics.reports.diet import (
    DietReport,
    DietScenario,
    ModelPlace,
    Saving,
    StaleKeep,
    TextEdit,
    Tried,
)
from coursebuild.report import Style
from support.model_reports import diet, finding

EDIT = TextEdit("models/arm.xml", 9, 1, 100, 130, '    <gyro\n name="gyro"/>\n', "")
SURE = Saving(2.2, 0.01, True, 1234, 30)
FINDING = finding(
    message="nobody reads the sensor gyro",
    places=(ModelPlace("gyro", 'mujoco/sensor/gyro[@name="gyro"]', "models/arm.xml", 9, 5),),
    saving=SURE,
    edits=(EDIT,),
)
REPORT = replace(diet(FINDING), model="arm", fixed=SURE, slim=SURE)


def lines(report: DietReport, width: int = 100) -> list[str]:
    return diet_text([report], Style(width=width)).splitlines()


def test_a_finding_is_told_with_its_saving_reason_and_change() -> None:
    assert lines(REPORT, 90) == [
        "arm",
        "  in swing",
        "",
        "  sensor-unread: nobody reads the sensor gyro",
        "    proved; ×2.2 as fast, 1,234 bytes of memory fewer, 30 bytes of text fewer",
        "    because its value goes nowhere",
        "    models/arm.xml:9:1",
        "    - <gyro",
        '    - name="gyro"/>',
        "",
        "  1 finding not explained, 1 of them for `coursebuild diet arm --fix`",
        '  what is wanted has its reason in models/arm.toml: [[keep]] finding = "sensor-unread',
        '    gyro", reason = …',
        "",
        "integrator and timestep are judged against a reference, not against the model as it is:",
        "  see `coursebuild bench`",
    ]


def test_what_is_kept_lost_or_kept_for_nothing() -> None:
    report = replace(
        REPORT,
        findings=(replace(FINDING, kept="shown in class", fixable=False, unfixed="it is kept"),),
        fixed=None,
        slim=None,
        scenarios=(DietScenario("go", 9, "reset", ("the clock says 0 s",)),),
        stale=(StaleKeep("unused-site", "models/arm.toml", 3, 11),),
    )
    told = lines(report)
    assert "  in no scenario" in told and "    kept: shown in class" in told
    assert "  scenario go: reset: the clock says 0 s; nothing is claimed from it" in told
    assert any("`unused-site` keeps nothing any more" in line for line in told)
    assert not report.ok and "- <gyro" not in "\n".join(told)
    good = replace(report, scenarios=REPORT.scenarios, stale=())
    assert good.ok and "  nothing in it is in vain" in lines(good)


def test_what_was_tried_and_many_changes() -> None:
    tried = (
        Tried("cone", "…", ("elliptic",), 1e-3, ""),
        Tried("solver", "…", ("CG",), None, "it saves no time"),
        Tried("sleep", "…", ("sleep",), None, "it saves no time"),
    )
    many = replace(FINDING, edits=(EDIT,) * 9, unfixed="models/b.xml uses models/arm.xml too")
    told = lines(replace(REPORT, tried=tried, findings=(many,)))
    assert "  tried and needed: cone" in told
    assert "  not found, because it saves no time: solver, sleep" in told
    assert "    … and 3 more changes" in told
    assert "    not for --fix: models/b.xml uses models/arm.xml too" in told


def test_control_characters_are_shown_and_lines_are_not_too_long() -> None:
    odd = replace(FINDING, message="nobody reads \x1b[2J " + "word " * 40)
    told = lines(replace(REPORT, findings=(odd,)), width=60)
    assert not any("\x1b" in line for line in told)
    assert all(len(line) <= 60 for line in told if "models/" not in line)
