"""Reports as people read them, to the letter, and in the formats that programs read."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from itertools import product
from pathlib import Path

import pytest
from msgspec.structs import replace

from coursebuild import MANUAL
from coursebuild.core.model.results import Outcome, TrialLine
from coursebuild.core.text.characters import printable
from coursebuild.core.text.diagnostics import Diagnostic, Fix, Note, diagnose
from coursebuild.core.text.source import Source
from coursebuild.report import FORMATS, Report, ScriptLine, Style, diagnostic_text, render_report
from coursebuild.report.text import clip
from support.fixture_cases import check_text


def render(diagnostic: Diagnostic, width: int = 100) -> str:
    return diagnostic_text(diagnostic, Style(width=width))


def at(text: str, part: str) -> tuple[Source, int, int]:
    source = Source("content/lessons/4.2-x.md", text)
    start = text.index(part)
    return source, start, start + len(part)


def test_frame_label_help_and_notes() -> None:
    source, a, b = at("one\n" * 209 + "  Euler  kinetic energy  +6.641 %\nlast line\n", "+6.641")
    note = Note("classes: numeric 1\nsecond line")
    place = Note("depends on it", source.span(0, 3))
    diagnostic = diagnose(
        "output-drift",
        source.span(a, b),
        "recorded output differs from this run",
        label="this run printed +6.702",
        help="run `coursebuild update 4.2`",
        notes=[note, place],
    )
    assert render(diagnostic) == (
        "error[output-drift]: recorded output differs from this run\n"
        "  --> content/lessons/4.2-x.md:210:26\n"
        "    |\n"
        "210 |   Euler  kinetic energy  +6.641 %\n"
        "    |                          ^^^^^^ this run printed +6.702\n"
        "    = note: classes: numeric 1\n"
        "            second line\n"
        "    = note: content/lessons/4.2-x.md:1:1: depends on it\n"
        "    = help: run `coursebuild update 4.2`"
    )


def test_only_what_could_change_the_terminal_is_hidden() -> None:
    assert printable("a\0\x1b\x7f\x85\u202e\u2028\ufeffb") == "a␀␛␡\ufffd\ufffd\ufffd\ufffdb"
    family = "👩\u200d👧"  # joined to one picture
    assert printable(family) == family


def test_text_is_cut_where_its_room_ends() -> None:
    for text, visible_part in (
        ("abcd", "abcd"),
        ("abcde", "abcd"),
        ("量量", "量量"),
        ("a量量", "a量"),
        ("ab\u200dcd", "ab\u200dcd"),
    ):
        assert clip(text, 4) == visible_part, text


def test_marks_stand_below_what_is_wrong() -> None:
    """Tabs, wide characters and controls keep them in place; an empty span has one."""
    for text, start, end, line, marks in (
        ("\t量x\x1b[31mwrong", 8, 13, "    量x␛[31mwrong", "            ^^^^^"),
        ("abc def\nghi", 4, 11, "abc def", "    ^^^"),
        ("abc", 3, 3, "abc", "   ^"),
    ):
        diagnostic = diagnose("math-syntax", Source("a.md", text).span(start, end), "m")
        assert render(diagnostic).split("\n")[3:5] == [f"  1 | {line}", f"    | {marks}"]


def test_a_long_line_is_cut_around_the_marked_part() -> None:
    text = "x" * 3000 + "WRONG" + "y" * 3000
    source, a, b = at(text, "WRONG")
    lines = render(diagnose("json-syntax", source.span(a, b), "m"), width=80).split("\n")
    assert len(lines[3]) <= 82
    column = lines[4].index("^")
    assert lines[3][column : column + 5] == "WRONG"
    assert lines[4].count("^") == 5
    assert lines[3].startswith("  1 | …x")
    assert lines[3].endswith("y…")


def test_a_long_line_without_width_is_cut_too() -> None:
    source, a, b = at("a" + "\u200d" * 3000 + "WRONG", "WRONG")
    lines = render(diagnose("json-syntax", source.span(a, b), "m"), width=80).split("\n")
    assert len(lines[3]) < 200 and lines[3].endswith("WRONG")


def test_report_lists_scripts_and_ends_with_a_summary() -> None:
    scripts = (
        ScriptLine("examples/a.py", "1.1", "ok", 0.25, False),
        ScriptLine("examples/b.py", "1.1", "drift", 1.0, True),
        ScriptLine(
            "examples/c.py", "1.2", "skipped", 0.0, False, ("torch",), 1, 2, reasons=("torch",)
        ),
        ScriptLine("examples/d.py", "1.2", "norun", 0.0, False, reasons=("norun",)),
    )
    report = Report((), scripts, lessons=2, silenced=1)
    assert render_report(report, "text", Style()) == (
        "ok       examples/a.py  0.25 s\n"
        "drift    examples/b.py  cached\n"
        "skipped  examples/c.py  (needs torch; unproven: 1 output and 2 bound numbers)\n"
        "norun    examples/d.py  (norun)\n"
        "\n"
        "2 lessons, 1 script run, 1 cached: 1 failed, and 2 scripts that were not run"
        " (torch, norun) (1 silenced)\n"
    )


def test_many_diagnostics_of_a_rule_in_a_file_are_counted() -> None:
    source = Source("content/lessons/1.1-x.md", "<b>\n" * 1500)
    rules = ["html-unbalanced"] * 1500 + ["math-syntax"]
    diagnostics = tuple(
        diagnose(rule, source.span(4 * n, 4 * n + 3), "m") for n, rule in enumerate(rules)
    )
    report = Report(diagnostics, (), lessons=1)
    text = render_report(report, "text", Style())
    assert text.count("[html-unbalanced]: m\n") == 20
    assert text.count("[math-syntax]: m\n") == 1
    assert text.endswith(
        "\n\nerror[html-unbalanced]: 1,480 more in content/lessons/1.1-x.md"
        "; `coursebuild check --format json` lists all\n"
        "\n1 lesson, 0 scripts run: 1501 errors\n"
    )
    assert render_report(report, "github", Style()).count("html-unbalanced") == 1500


def test_colour_is_only_colour() -> None:
    source, a, b = at("abc def", "def")
    diagnostic = diagnose("math-syntax", source.span(a, b), "m", label="l", help="h")
    import re

    coloured = diagnostic_text(diagnostic, Style(colour=True))
    assert coloured != render(diagnostic)
    assert re.sub(r"\x1b\[[0-9;]*m", "", coloured) == render(diagnostic)


def test_labs_are_listed_like_scripts() -> None:
    labs = (
        TrialLine("1.1-lab-1", "A", "1.1", "ok", 1.239, 64206, 13, "bit-identical", False),
        TrialLine("1.1-lab-2", "", "1.1", "ok", 0.1, 1000, 1, "", True, "a `switch`"),
        TrialLine("1.1-lab-3", "", "1.1", "failed", 0.5, None, 0, "", False),
        TrialLine("1.1-lab-4", "", "1.1", "untried", untried="a kind of the course's"),
    )
    report = Report((), (), labs, lessons=1)
    assert render_report(report, "text", Style()) == (
        "ok       1.1-lab-1  64,206 steps/s, 13 things tried, bit-identical, 1.24 s\n"
        "ok       1.1-lab-2  1,000 steps/s, 1 thing tried, no Python export: a `switch`, cached\n"
        "failed   1.1-lab-3  0 things tried, 0.50 s\n"
        "untried  1.1-lab-4  (a kind of the course's)\n"
        "\n"
        "1 lesson, 0 scripts run, 3 labs tried: 1 failed, and 1 lab that was not tried"
        " (a kind of the course's)\n"
    )


LINES: tuple[ScriptLine | TrialLine, ...] = (
    *(ScriptLine("a.py", "1.1", outcome.value, 1.0, False) for outcome in Outcome),
    ScriptLine("a.py", "1.1", "drift", 1.0, False),
    ScriptLine("a.py", "1.1", "diverged", 1.0, False),
    ScriptLine("a.py", "1.1", "blocked", 0.0, False, reasons=("blocked",)),
    TrialLine("l", "", "1.1", "ok", tried=1),
    TrialLine("l", "", "1.1", "failed"),
    TrialLine("l", "", "1.1", "untried", untried="other mistakes"),
    ScriptLine("a.py", "1.1", "unasked", 0.0, False),
    TrialLine("l", "", "1.1", "unasked", untried="extract runs nothing"),
)


@pytest.mark.parametrize("form", ("text", *FORMATS))
def test_everything_holds_only_where_all_was_run_and_nothing_failed(form: str) -> None:
    """Of every way in which a script or a lab can end, with no mistake, a warning, or an error."""
    unrun = {"skipped", "norun", "unrecorded", "blocked", "untried", "unasked"}
    for line, diagnostics in product(LINES, ((), (WARNING,), (ERROR,))):
        if isinstance(line, ScriptLine) and line.status in unrun:
            line = replace(line, reasons=("norun",))
        scripts, labs = ((line,), ()) if isinstance(line, ScriptLine) else ((), (line,))
        report = Report(diagnostics, scripts, labs, lessons=1)
        is_failure = line.status not in {"ok", *unrun}
        assert report.ok is not (is_failure or diagnostics == (ERROR,)), line
        is_whole = "everything holds" in report.summary.verdict()
        assert is_whole is (line.status == "ok" and not diagnostics), line
        assert "holds" not in report.summary.verdict() or report.ok, line
        text = render_report(report, form, Style())
        if form == "text":
            assert text.endswith(f": {report.summary.verdict()}\n")
        elif form == "json":
            assert json.loads(text)["summary"]["ok"] is report.ok
        elif form == "junit":
            suite = ElementTree.fromstring(text.encode()).find("testsuite")
            assert suite is not None
            assert (suite.get("failures") == "0") is report.ok, line
            assert (suite.get("skipped") == "1") is (line.status in unrun), line


def test_a_part_of_the_work_is_not_everything() -> None:
    verdicts = [
        Report(diagnostics, (), part="2/8").summary.verdict()
        for diagnostics in ((), (WARNING, ERROR))
    ]
    assert verdicts == [
        "part 2/8 of the work holds",
        "1 error, 1 warning in part 2/8 of the work",
    ]


ROOT = Path(__file__).parents[2]
SOURCE = Source("content/lessons/1.1-a,b.md", "first\nwr\x00ng <&> here\n")
ERROR = diagnose(
    "math-syntax",
    SOURCE.span(6, 11),
    "it is 100% wrong",
    label="here",
    help=Fix("mend it", "right", "wr", safe=True),
    notes=[Note("see", SOURCE.span(0, 5)), Note("and")],
)
WARNING = diagnose("image-alt", SOURCE.span(0, 5), "no text")
SCRIPTS = (
    ScriptLine("examples/a.py", "1.1", "ok", 0.25, False),
    ScriptLine("examples/b.py", "1.1", "timeout", 60.0, False),
    ScriptLine("examples/c.py", "1.1", "skipped", 0.0, False, ("torch",), reasons=("torch",)),
    ScriptLine("examples/d.py", "1.1", "norun", 0.0, False, reasons=("norun",)),
)
LABS = (
    TrialLine("1.1-lab-1", "A & B", "1.1", "ok", 1.23456, 64206, 13, "bit-identical", True),
    TrialLine("1.1-lab-2", "", "1.1", "failed", 0.5, None, 0, "", False),
)
REPORT = Report((WARNING, ERROR), SCRIPTS, LABS, lessons=1, seconds=60.25)


@pytest.mark.parametrize("form", FORMATS)
def test_report_for_programs(form: str, rewriting: bool) -> None:
    text = render_report(REPORT, form, Style())
    check_text(Path(__file__).with_name(f"report.{form}"), text, rewriting=rewriting)
    if form == "junit":
        ElementTree.fromstring(text.encode())
    elif form != "github":
        json.loads(text)


def test_junit_has_no_character_that_xml_forbids() -> None:
    odd = diagnose("math-syntax", SOURCE.span(0, 5), "a \x01 b \uffff c \U0001d465")
    suite = ElementTree.fromstring(
        render_report(replace(REPORT, diagnostics=(odd,)), "junit", Style())
    )
    failure = suite.find(".//testcase[@classname='course']/failure")
    assert failure is not None
    assert str(failure.get("message")).endswith(": a \ufffd b \ufffd c \U0001d465")


def test_sarif_names_the_page_of_a_rule() -> None:
    run = json.loads(render_report(REPORT, "sarif", Style()))["runs"][0]
    result = run["results"][1]
    assert result["ruleId"] == "math-syntax"
    rule = run["tool"]["driver"]["rules"][result["ruleIndex"]]
    assert rule["id"] == "math-syntax"
    known_address = f"{MANUAL}rules.html#math-syntax"
    assert rule.get("helpUri") == (known_address if MANUAL else None)
    assert "\n### math-syntax\n" in (ROOT / "docs/reference/rules.md").read_text()
