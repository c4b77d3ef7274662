"""Reports for machines: JSON, JUnit XML, SARIF 2.1.0, and the lines that CI services read.

Entry points: `FORMATS`; `to_json`, `to_junit`, `to_sarif`, `to_annotations`.
"""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from coursebuild.core.model.results import TrialLine
from coursebuild.core.model.sensitivity import Doubt, Flip, Sensitivity
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.rules import HELP, RULES
from coursebuild.core.text.source import Span
from coursebuild.core.text.xml import clean_xml
from coursebuild.report.terminal import Style
from coursebuild.report.text import diagnostic_text, location
from coursebuild.report.values import Report, ScriptLine, json_text, plain


def to_json(report: Report) -> str:
    """The report as one JSON object: `diagnostics`, `scripts`, `labs`, `summary`.

    Of the scripts, `ran` were run just now and `cached` have a remembered result.
    """
    s = report.summary
    summary = {"ok": report.ok, **plain(s), "ran": s.ran - s.cached, "seconds": round(s.seconds, 3)}
    value: dict[str, Any] = {
        "diagnostics": report.diagnostics,
        "scripts": [_timed(line) for line in report.scripts],
        "labs": [_timed(line) for line in report.labs],
        "summary": summary,
    }
    if report.sensitivity is not None:
        value["sensitivity"] = [_sensitivity(one) for one in report.sensitivity]
    return json_text(value)


def _timed(line: ScriptLine | TrialLine) -> dict[str, Any]:
    value: dict[str, Any] = plain(line, unexported="no_python_export")
    return value | {"seconds": round(line.seconds, 3)}


def _sensitivity(one: Sensitivity) -> dict[str, Any]:
    """What is known of a script; an amplification without bounds is `null`."""
    value: dict[str, Any] = plain(one, standing="status")
    rows: dict[str, tuple[Doubt | Flip, ...]] = {"doubts": one.doubts, "flips": one.flips}
    told = {
        name: [{"file": row.span.path, **plain(row)} for row in found]
        for name, found in rows.items()
    }
    return {**value, "chaotic": one.chaotic, **told}


# --- JUnit


def to_junit(report: Report) -> str:
    """One test case a script, a lab, and a file with diagnostics; errors are failures."""
    suites = Element("testsuites")
    suite = SubElement(suites, "testsuite", name="coursebuild")
    for script in report.scripts:
        case = _case(suite, f"lesson {script.lesson}", script.path, script.seconds)
        if script.status in ("skipped", "norun"):
            why = f"needs {', '.join(script.missing)}" if script.missing else "not run"
            SubElement(case, "skipped", message=why)
        elif script.status != "ok":
            SubElement(case, "failure", type=script.status, message=script.status)
    for lab in report.labs:
        case = _case(suite, f"lesson {lab.lesson}", lab.name, lab.seconds)
        if lab.status != "ok":
            SubElement(case, "failure", type=lab.status, message=lab.status)
    for path in dict.fromkeys(d.span.path for d in report.diagnostics):
        case = _case(suite, "course", path, 0.0)
        for d in report.diagnostics:
            if d.span.path == path:
                _outcome(case, d)
    suite.attrib |= {
        "tests": str(len(suite)),
        "failures": str(sum(case.find("failure") is not None for case in suite)),
        "errors": "0",
        "skipped": str(sum(case.find("skipped") is not None for case in suite)),
        "time": f"{report.summary.seconds:.3f}",
    }
    indent(suites)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{tostring(suites, encoding="unicode")}\n'


def _case(suite: Element, group: str, name: str, seconds: float) -> Element:
    return SubElement(suite, "testcase", classname=group, name=name, time=f"{seconds:.3f}")


def _outcome(case: Element, d: Diagnostic) -> None:
    if d.is_error:
        message = clean_xml(f"{location(d.span)}: {d.message}")
        told = SubElement(case, "failure", type=d.rule, message=message)
    else:
        told = SubElement(case, "system-out")
    told.text = clean_xml(diagnostic_text(d, Style()))


# --- SARIF


def to_sarif(report: Report) -> str:
    """SARIF 2.1.0; columns count code points."""
    used = sorted({d.rule for d in report.diagnostics})
    rules = [
        {
            "id": name,
            "shortDescription": {"text": RULES[name].summary},
            "helpUri": HELP.format(name),
            "defaultConfiguration": {"level": RULES[name].severity},
        }
        for name in used
    ]
    run = {
        "tool": {"driver": {"name": "coursebuild", "rules": rules}},
        "columnKind": "unicodeCodePoints",
        "results": [_result(d, used.index(d.rule)) for d in report.diagnostics],
    }
    value = {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [run],
    }
    return json_text(value)


def _result(d: Diagnostic, rule: int) -> dict[str, Any]:
    result: dict[str, Any] = {
        "ruleId": d.rule,
        "ruleIndex": rule,
        "level": d.severity,
        "message": {"text": _message(d)},
        "locations": [_location(d.span)],
    }
    related = [
        {**_location(note.span), "message": {"text": note.message}}
        for note in d.notes
        if note.span is not None
    ]
    return result | ({"relatedLocations": related} if related else {})


def _location(span: Span) -> dict[str, Any]:
    region = {
        "startLine": span.line,
        "startColumn": span.column,
        "endLine": span.end_line,
        "endColumn": span.end_column,
    }
    file = {"uri": span.path, "uriBaseId": "ROOT"}
    return {"physicalLocation": {"artifactLocation": file, "region": region}}


def _message(d: Diagnostic) -> str:
    parts = (d.message, d.label, f"help: {d.help}" if d.help else "")
    return "\n".join(part for part in parts if part)


# --- annotations


def to_annotations(report: Report) -> str:
    """One workflow command a diagnostic; CI services show it beside the changed lines."""
    return "".join(
        f"::{d.severity} file={_property(d.span.path)},"
        f"line={d.span.line},col={d.span.column},"
        f"endLine={d.span.end_line},endColumn={d.span.end_column},"
        f"title={_property(d.rule)}::{_data(_message(d))}\n"
        for d in report.diagnostics
    )


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


FORMATS = {"json": to_json, "junit": to_junit, "sarif": to_sarif, "github": to_annotations}
