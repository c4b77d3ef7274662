"""Diagnostics and verdicts as text, and for machines: JSON, JUnit, SARIF 2.1.0, CI annotations."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from coursebuild.core.model.results import TrialLine
from coursebuild.core.text.characters import clean_xml
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.rules import RULES, rule_address
from coursebuild.core.text.source import Span
from coursebuild.report.text import Style as Style
from coursebuild.report.text import diagnostic_text as diagnostic_text
from coursebuild.report.text import location, to_text
from coursebuild.report.values import UNASKED as UNASKED
from coursebuild.report.values import Report as Report
from coursebuild.report.values import ScriptLine as ScriptLine
from coursebuild.report.values import json_text, plain, unrun_reason
from coursebuild.report.values import unchanged_report as unchanged_report


def render_report(report: Report, form: str, style: Style, *, brief: bool = False) -> str:
    """Return the report as `text` or in a format of `FORMATS`; ends in a newline, or is empty.

    As text, and if `brief`, only what is wrong.
    """
    return to_text(report, style, brief=brief) if form == "text" else FORMATS[form](report)


def to_json(report: Report) -> str:
    """The report as one JSON object: `diagnostics`, `scripts`, `labs`, `summary`.

    In the summary, `ran` counts the scripts run just now, `cached` those with a remembered result.
    """
    s = report.summary
    summary = {"ok": s.ok, **plain(s), "ran": s.ran - s.cached, "seconds": round(s.seconds, 3)}
    value: dict[str, Any] = {
        "diagnostics": report.diagnostics,
        "scripts": [_line_value(line) for line in report.scripts],
        "labs": [_line_value(line) for line in report.labs],
        "summary": summary,
    }
    if report.sensitivity is not None:
        value["sensitivity"] = [
            {
                **plain(s, standing="status"),  # an amplification without bounds is `null`
                "doubts": [{"file": row.span.path, **plain(row)} for row in s.doubts],
                "flips": [{"file": row.span.path, **plain(row)} for row in s.flips],
                "chaotic": s.chaotic,
            }
            for s in report.sensitivity
        ]
    return json_text(value)


def _line_value(line: ScriptLine | TrialLine) -> dict[str, Any]:
    value: dict[str, Any] = plain(line, unexported="no_python_export")
    return value | {"seconds": round(line.seconds, 3)}


# --- JUnit


def to_junit(report: Report) -> str:
    """One test case for each script, lab, and file with diagnostics; errors are failures."""
    suites = Element("testsuites")
    suite = SubElement(suites, "testsuite", name="coursebuild")
    lines: tuple[ScriptLine | TrialLine, ...] = (*report.scripts, *report.labs)
    for line in lines:
        name = line.path if isinstance(line, ScriptLine) else line.name
        reason = unrun_reason(line) if isinstance(line, ScriptLine) else line.untried
        case = _add_case(suite, f"lesson {line.lesson}", name, line.seconds)
        if reason:
            SubElement(case, "skipped", message=reason)
        elif line.status != "ok":
            SubElement(case, "failure", type=line.status, message=line.status)
    for path in dict.fromkeys(d.span.path for d in report.diagnostics):
        case = _add_case(suite, "course", path, 0.0)
        for d in report.diagnostics:
            if d.span.path != path:
                continue
            if d.is_error:
                message = clean_xml(f"{location(d.span)}: {d.message}")
                element = SubElement(case, "failure", type=d.rule, message=message)
            else:
                element = SubElement(case, "system-out")
            element.text = clean_xml(diagnostic_text(d, Style()))
    suite.attrib |= {
        "tests": str(len(suite)),
        "failures": str(sum(case.find("failure") is not None for case in suite)),
        "errors": "0",
        "skipped": str(sum(case.find("skipped") is not None for case in suite)),
        "time": f"{report.seconds:.3f}",
    }
    indent(suites)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{tostring(suites, encoding="unicode")}\n'


def _add_case(suite: Element, group: str, name: str, seconds: float) -> Element:
    return SubElement(suite, "testcase", classname=group, name=name, time=f"{seconds:.3f}")


# --- SARIF

_SARIF_LEVELS = {"error": "error", "warning": "warning", "hint": "note"}


def to_sarif(report: Report) -> str:
    """The report as SARIF 2.1.0; columns count code points."""
    rule_names = sorted({d.rule for d in report.diagnostics})
    rules: list[dict[str, Any]] = [
        {
            "id": name,
            "shortDescription": {"text": RULES[name].summary},
            "defaultConfiguration": {"level": _SARIF_LEVELS[RULES[name].severity]},
        }
        for name in rule_names
    ]
    for rule in rules:
        if address := rule_address(rule["id"]):
            rule["helpUri"] = address
    run = {
        "tool": {"driver": {"name": "coursebuild", "rules": rules}},
        "columnKind": "unicodeCodePoints",
        "results": [
            _result(d, rule_names.index(d.rule), report.folder) for d in report.diagnostics
        ],
    }
    value = {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [run],
    }
    return json_text(value)


def _result(d: Diagnostic, rule: int, folder: str) -> dict[str, Any]:
    result: dict[str, Any] = {
        "ruleId": d.rule,
        "ruleIndex": rule,
        "level": _SARIF_LEVELS[d.severity],
        "message": {"text": _message(d)},
        "locations": [_location(d.span, folder)],
    }
    related_locations = [
        {**_location(note.span, folder), "message": {"text": note.message}}
        for note in d.notes
        if note.span is not None
    ]
    if related_locations:
        result["relatedLocations"] = related_locations
    if d.edits:
        changes: dict[str, list[dict[str, Any]]] = {}
        for edit in d.edits:
            replacement = {
                "deletedRegion": _region(edit.span),
                "insertedContent": {"text": edit.text},
            }
            changes.setdefault(edit.span.path, []).append(replacement)
        fix = {
            "description": {"text": d.help or f"write `{d.edits[0].text}`"},
            "artifactChanges": [
                {"artifactLocation": _artifact(folder + path), "replacements": replacements}
                for path, replacements in changes.items()
            ],
            "properties": {"safe": d.safe},
        }
        result["fixes"] = [fix]
    return result


def _location(span: Span, folder: str) -> dict[str, Any]:
    artifact = _artifact(folder + span.path)
    return {"physicalLocation": {"artifactLocation": artifact, "region": _region(span)}}


def _artifact(path: str) -> dict[str, str]:
    return {"uri": path, "uriBaseId": "ROOT"}


def _region(span: Span) -> dict[str, int]:
    return {
        "startLine": span.line,
        "startColumn": span.column,
        "endLine": span.end_line,
        "endColumn": span.end_column,
    }


def _message(d: Diagnostic) -> str:
    parts = (d.message, d.label, f"help: {d.help}" if d.help else "")
    return "\n".join(part for part in parts if part)


# --- annotations

_COMMANDS = {"error": "error", "warning": "warning", "hint": "notice"}


def to_annotations(report: Report) -> str:
    """One workflow command for each diagnostic; CI services show it beside the changed lines."""
    return "".join(
        f"::{_COMMANDS[d.severity]} file={_escape_property(report.folder + d.span.path)},"
        f"line={d.span.line},col={d.span.column},"
        f"endLine={d.span.end_line},endColumn={d.span.end_column},"
        f"title={_escape_property(d.rule)}::{_escape_data(_message(d))}\n"
        for d in report.diagnostics
    )


def _escape_property(text: str) -> str:
    return _escape_data(text).replace(":", "%3A").replace(",", "%2C")


def _escape_data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


FORMATS = {"json": to_json, "junit": to_junit, "sarif": to_sarif, "github": to_annotations}
