"""Reports for machines: JSON, JUnit XML, SARIF 2.1.0, and the lines that CI services read.

Entry points: `to_json`, `to_junit`, `to_sarif`, `to_annotations`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any
from xml.sax.saxutils import escape, quoteattr

from coursebuild.diagnostics import Diagnostic, Severity
from coursebuild.report.sensitivity import sensitivity_value
from coursebuild.report.text import Style, diagnostic_text
from coursebuild.report.values import LabLine, Report, ScriptLine
from coursebuild.rules import RULES
from coursebuild.source import Span


def _place(span: Span | None) -> dict[str, Any]:
    if span is None:
        return dict.fromkeys(("path", "line", "column", "end_line", "end_column"))
    return {
        "path": span.path,
        "line": span.line,
        "column": span.column,
        "end_line": span.end_line,
        "end_column": span.end_column,
    }


def to_json(report: Report) -> str:
    """The report as one JSON object: `diagnostics`, `scripts`, `labs`, `summary`.

    Of the scripts, `ran` were run just now and `cached` have a remembered result.
    """
    s = report.summary
    value: dict[str, Any] = {
        "diagnostics": [_diagnostic_value(d) for d in report.diagnostics],
        "scripts": [_script_value(line) for line in report.scripts],
        "labs": [_lab_value(line) for line in report.labs],
        "summary": {
            "ok": report.ok,
            "lessons": s.lessons,
            "scripts": s.scripts,
            "ran": s.ran - s.cached,
            "cached": s.cached,
            "skipped": s.skipped,
            "errors": s.errors,
            "warnings": s.warnings,
            "silenced": s.silenced,
            "seconds": round(s.seconds, 3),
        },
    }
    if report.sensitivity is not None:
        value["sensitivity"] = sensitivity_value(report.sensitivity)
    return json.dumps(value, ensure_ascii=False, indent=2) + "\n"


def _diagnostic_value(d: Diagnostic) -> dict[str, Any]:
    return {
        "rule": d.rule,
        "severity": d.severity.value,
        **_place(d.span),
        "message": d.message,
        "label": d.label,
        "help": d.help,
        "notes": [{"message": note.message, **_place(note.span)} for note in d.notes],
    }


def _script_value(line: ScriptLine) -> dict[str, Any]:
    return {
        "path": line.path,
        "lesson": line.lesson,
        "status": line.status,
        "seconds": round(line.seconds, 3),
        "cached": line.cached,
    }


def _lab_value(line: LabLine) -> dict[str, Any]:
    return {
        "name": line.name,
        "title": line.title,
        "lesson": line.lesson,
        "status": line.status,
        "seconds": round(line.seconds, 3),
        "steps_per_second": line.steps_per_second,
        "tried": line.tried,
        "parity": line.parity,
        "cached": line.cached,
        "no_python_export": line.unexported,
    }


# --- JUnit


def _xml_text(text: str) -> str:
    """XML 1.0 has no control characters: they are replaced."""
    return "".join(
        ch if ch in "\t\n\r" or (ord(ch) >= 0x20 and ch not in "\ufffe\uffff") else "\ufffd"
        for ch in text
    )


def to_junit(report: Report) -> str:
    """One test case a script, a lab, and a file with diagnostics; errors are failures."""
    by_path: dict[str, list[Diagnostic]] = {}
    for d in report.diagnostics:
        by_path.setdefault(d.span.path, []).append(d)
    cases = [_script_case(s) for s in report.scripts]
    cases += [_lab_case(lab) for lab in report.labs]
    cases += [_file_case(path, found) for path, found in by_path.items()]
    failures = sum(1 for case in cases if "<failure" in case)
    skipped = sum(1 for case in cases if "<skipped" in case)
    head = (
        f'<testsuite name="coursebuild" tests="{len(cases)}" failures="{failures}" errors="0" '
        f'skipped="{skipped}" time="{report.summary.seconds:.3f}">'
    )
    body = "\n".join(cases)
    declaration = '<?xml version="1.0" encoding="UTF-8"?>'
    return f"{declaration}\n<testsuites>\n{head}\n{body}\n</testsuite>\n</testsuites>\n"


def _script_case(line: ScriptLine) -> str:
    head = (
        f'<testcase classname="lesson {escape(line.lesson)}" name={quoteattr(line.path)} '
        f'time="{line.seconds:.3f}"'
    )
    if line.status in ("skipped", "norun"):
        why = f"needs {', '.join(line.missing)}" if line.missing else "not run"
        return f"{head}><skipped message={quoteattr(why)}/></testcase>"
    if line.status != "ok":
        status = quoteattr(line.status)
        return f"{head}><failure type={status} message={status}/></testcase>"
    return f"{head}/>"


def _lab_case(line: LabLine) -> str:
    head = (
        f'<testcase classname="lesson {escape(line.lesson)}" name={quoteattr(line.name)} '
        f'time="{line.seconds:.3f}"'
    )
    if line.status == "ok":
        return f"{head}/>"
    status = quoteattr(line.status)
    return f"{head}><failure type={status} message={status}/></testcase>"


def _file_case(path: str, found: Iterable[Diagnostic]) -> str:
    found = list(found)
    style = Style()
    parts: list[str] = []
    for d in found:
        text = escape(_xml_text(diagnostic_text(d, style)))
        if d.severity is Severity.ERROR:
            message = f"{d.span.path}:{d.span.line}:{d.span.column}: {d.message}"
            attributes = f"type={quoteattr(d.rule)} message={quoteattr(_xml_text(message))}"
            parts.append(f"<failure {attributes}>{text}</failure>")
        else:
            parts.append(f"<system-out>{text}</system-out>")
    body = "".join(parts)
    return f'<testcase classname="course" name={quoteattr(path)} time="0.000">{body}</testcase>'


# --- SARIF


def _region(span: Span) -> dict[str, int]:
    return {
        "startLine": span.line,
        "startColumn": span.column,
        "endLine": span.end_line,
        "endColumn": span.end_column,
    }


def _location(span: Span) -> dict[str, Any]:
    return {
        "physicalLocation": {
            "artifactLocation": {"uri": span.path, "uriBaseId": "ROOT"},
            "region": _region(span),
        }
    }


def to_sarif(report: Report) -> str:
    """SARIF 2.1.0; columns count code points."""
    used = sorted({d.rule for d in report.diagnostics})
    results = []
    for d in report.diagnostics:
        text = "\n".join(
            [d.message, *([d.label] if d.label else []), *([f"help: {d.help}"] if d.help else [])]
        )
        related = [
            {**_location(note.span), "message": {"text": note.message}}
            for note in d.notes
            if note.span is not None
        ]
        result: dict[str, Any] = {
            "ruleId": d.rule,
            "ruleIndex": used.index(d.rule),
            "level": d.severity.value,
            "message": {"text": text},
            "locations": [_location(d.span)],
        }
        if related:
            result["relatedLocations"] = related
        results.append(result)
    rules = [
        {
            "id": name,
            "shortDescription": {"text": RULES[name].summary},
            "defaultConfiguration": {"level": RULES[name].severity},
        }
        for name in used
    ]
    run = {
        "tool": {"driver": {"name": "coursebuild", "rules": rules}},
        "columnKind": "unicodeCodePoints",
        "results": results,
    }
    value = {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [run],
    }
    return json.dumps(value, ensure_ascii=False, indent=2) + "\n"


# --- annotations


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def to_annotations(report: Report) -> str:
    """One workflow command a diagnostic; CI services show it beside the changed lines."""
    lines = []
    for d in report.diagnostics:
        text = "\n".join(
            [d.message, *([d.label] if d.label else []), *([f"help: {d.help}"] if d.help else [])]
        )
        lines.append(
            f"::{d.severity.value} file={_property(d.span.path)},"
            f"line={d.span.line},col={d.span.column},"
            f"endLine={d.span.end_line},endColumn={d.span.end_column},"
            f"title={_property(d.rule)}::{_data(text)}"
        )
    return "".join(line + "\n" for line in lines)
