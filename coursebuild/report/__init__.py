"""Diagnostics and verdicts as text, JSON, JUnit, SARIF and CI annotations.

Entry points: `Report`, `render_report(report, format, style)`.
"""

from __future__ import annotations

from typing import Literal, TypeAlias, assert_never

from coursebuild.report.terminal import Style as Style
from coursebuild.report.text import diagnostic_text as diagnostic_text
from coursebuild.report.text import to_text
from coursebuild.report.values import Report as Report
from coursebuild.report.values import ScriptLine as ScriptLine
from coursebuild.report.values import Summary as Summary
from coursebuild.report.values import summary_line as summary_line
from coursebuild.report.values import unchanged_report as unchanged_report

Format: TypeAlias = Literal["text", "json", "junit", "sarif", "github"]
FORMATS: tuple[Format, ...] = ("text", "json", "junit", "sarif", "github")


def render_report(report: Report, form: Format, style: Style) -> str:
    """The report in one of the formats, ending in a newline (or empty)."""
    if form == "text":
        return to_text(report, style)
    from coursebuild.report import machine

    match form:
        case "json":
            return machine.to_json(report)
        case "junit":
            return machine.to_junit(report)
        case "sarif":
            return machine.to_sarif(report)
        case "github":
            return machine.to_annotations(report)
        case _:
            assert_never(form)
