"""The formats that programs read."""

from __future__ import annotations

import json
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.model.results import TrialLine
from coursebuild.core.text.diagnostics import Note, diagnose
from coursebuild.core.text.source import Source
from coursebuild.report import Report, ScriptLine, Style, Summary, render_report

ROOT = Path(__file__).parents[2]
SOURCE = Source("content/lessons/1.1-a,b.md", "first\nwr\x00ng <&> here\n")
ERROR = diagnose(
    "math-syntax",
    SOURCE.span(6, 11),
    "it is 100% wrong",
    label="here",
    help="mend it",
    notes=[Note("see", SOURCE.span(0, 5)), Note("and")],
)
WARNING = diagnose("image-alt", SOURCE.span(0, 5), "no text")
SCRIPTS = (
    ScriptLine("examples/a.py", "1.1", "ok", 0.25, False),
    ScriptLine("examples/b.py", "1.1", "timeout", 60.0, False),
    ScriptLine("examples/c.py", "1.1", "skipped", 0.0, False, ("torch",)),
    ScriptLine("examples/d.py", "1.1", "norun", 0.0, False),
)
LABS = (
    TrialLine("1.1-lab-1", "A & B", "1.1", "ok", 1.23456, 64206, 13, "bit-identical", True),
    TrialLine("1.1-lab-2", "", "1.1", "failed", 0.5, None, 0, "", False),
)
REPORT = Report((WARNING, ERROR), SCRIPTS, Summary(1, 4, 2, 1, 1, 1, 0, 60.25), labs=LABS)


def test_json_has_diagnostics_scripts_labs_and_a_summary() -> None:
    value = json.loads(render_report(REPORT, "json", Style()))
    assert list(value) == ["diagnostics", "scripts", "labs", "summary"]
    assert value["diagnostics"][1] == {
        "rule": "math-syntax",
        "severity": "error",
        "path": "content/lessons/1.1-a,b.md",
        "line": 2,
        "column": 1,
        "end_line": 2,
        "end_column": 6,
        "message": "it is 100% wrong",
        "label": "here",
        "help": "mend it",
        "notes": [
            {
                "message": "see",
                "path": "content/lessons/1.1-a,b.md",
                "line": 1,
                "column": 1,
                "end_line": 1,
                "end_column": 6,
            },
            {
                "message": "and",
                "path": None,
                "line": None,
                "column": None,
                "end_line": None,
                "end_column": None,
            },
        ],
    }
    assert value["scripts"][1] == {
        "path": "examples/b.py",
        "lesson": "1.1",
        "status": "timeout",
        "seconds": 60.0,
        "cached": False,
        "missing": [],
        "unproven_outputs": 0,
        "unproven_numbers": 0,
    }
    assert value["labs"][0] == {
        "name": "1.1-lab-1",
        "title": "A & B",
        "lesson": "1.1",
        "status": "ok",
        "seconds": 1.235,
        "steps_per_second": 64206,
        "tried": 13,
        "parity": "bit-identical",
        "cached": True,
        "no_python_export": "",
        "fill": None,
    }
    assert value["summary"]["ok"] is False
    assert value["summary"]["errors"] == 1


def test_junit_is_xml_and_counts() -> None:
    suite = ElementTree.fromstring(render_report(REPORT, "junit", Style()).encode()).find(
        "testsuite"
    )
    assert suite is not None
    assert {key: suite.get(key) for key in ("tests", "failures", "skipped")} == {
        "tests": "7",
        "failures": "3",
        "skipped": "2",
    }
    reasons = [case.get("message") for case in suite.iter("skipped")]
    assert reasons == ["needs torch", "not run"]
    assert suite.find("./testcase[@name='1.1-lab-2']/failure") is not None
    assert suite.find("./testcase[@name='1.1-lab-1']/failure") is None
    failure = suite.find("./testcase[@name='content/lessons/1.1-a,b.md']/failure")
    assert failure is not None
    assert failure.get("message") == "content/lessons/1.1-a,b.md:2:1: it is 100% wrong"
    assert "<&> here" in (failure.text or "")


def test_junit_has_no_character_that_xml_forbids() -> None:
    odd = diagnose("math-syntax", SOURCE.span(0, 5), "a \x01 b \uffff c \U0001d465")
    suite = ElementTree.fromstring(
        render_report(replace(REPORT, diagnostics=(odd,)), "junit", Style())
    )
    failure = suite.find(".//testcase[@classname='course']/failure")
    assert failure is not None
    assert str(failure.get("message")).endswith(": a \ufffd b \ufffd c \U0001d465")


def test_sarif_names_rule_region_and_related_places() -> None:
    run = json.loads(render_report(REPORT, "sarif", Style()))["runs"][0]
    result = run["results"][1]
    assert result["ruleId"] == "math-syntax"
    rule = run["tool"]["driver"]["rules"][result["ruleIndex"]]
    assert rule["id"] == "math-syntax"
    home = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["urls"]["Homepage"]
    page = "docs/reference/rules.md"
    assert rule["helpUri"] == f"{home}/blob/main/{page}#math-syntax"
    assert "\n## math-syntax\n" in (ROOT / page).read_text()
    assert result["locations"][0]["physicalLocation"]["region"] == {
        "startLine": 2,
        "startColumn": 1,
        "endLine": 2,
        "endColumn": 6,
    }
    assert [related["message"]["text"] for related in result["relatedLocations"]] == ["see"]


def test_annotations_escape_what_their_syntax_uses() -> None:
    assert render_report(REPORT, "github", Style()).splitlines()[1] == (
        "::error file=content/lessons/1.1-a%2Cb.md,line=2,col=1,endLine=2,endColumn=6,"
        "title=math-syntax"
        "::it is 100%25 wrong%0Ahere%0Ahelp: mend it"
    )
